// SPDX-License-Identifier: Apache-2.0
#include "train/registration.h"

#include <algorithm>
#include <cmath>

#include <glm/glm.hpp>

#include "sarnerf/core/error.h"

namespace sarnerf {

namespace {

/// Largest shift of a view in one pass (pixels): as far as a central difference is valid. And largest log gain: as far as it is linear.
/// A field that has hardly been learned fits no gain, and a longer step could make images infinite.
constexpr double kMostStep = 0.5;

/// Successive over-relaxation: the field has adapted to the shift so far, which makes the plain step too short.
constexpr double kOverRelaxation = 1.5;

/// α, ρ (pixels) and γ.
glm::dvec3 gauss_newton_step(const Image<float>& image, const Image<float>& rendered, const PixelLoss& pixel,
                             const glm::dvec2& shift_pixels) {
  glm::dmat3 squares(0.0);
  glm::dvec3 products(0.0);
  double errors = 0.0, n_pixels = 0.0;
  for (int i = 1; i + 1 < image.n_azimuth(); ++i)
    for (int j = 1; j + 1 < image.n_range(); ++j) {
      const double mu = std::max(0.0, double{rendered(i, j)});
      const double d = pixel.denominator(mu), e = (mu - double{image(i, j)}) / d;
      const glm::dvec3 g = glm::dvec3(0.5 * (double{rendered(i + 1, j)} - double{rendered(i - 1, j)}),
                                      0.5 * (double{rendered(i, j + 1)} - double{rendered(i, j - 1)}), mu) / d;
      squares += glm::outerProduct(g, g);
      products += e * g;
      errors += e * e;
      n_pixels += 1.0;
    }
  const double variance = errors / std::max(1.0, n_pixels);
  if (!(variance > 0.0)) return glm::dvec3(0.0);
  // In units of the noise. The prior applies to the two shifts, not to the gain.
  squares /= variance;
  products /= variance;
  constexpr double kPrior = 1.0 / (kCut_pixels * kCut_pixels);
  squares[0][0] += kPrior;
  squares[1][1] += kPrior;
  squares[2][2] += 1e-9;
  products += kPrior * glm::dvec3(shift_pixels, 0.0);
  const glm::dvec3 step = -kOverRelaxation * (glm::inverse(squares) * products);
  const double longest = std::max({std::abs(step.x), std::abs(step.y), std::abs(step.z), kMostStep});
  return step * (kMostStep / longest);
}

Image<float> divided(Image<float> image, double gain) {
  for (float& p : image.pixels()) p = static_cast<float>(double{p} / gain);
  return image;
}

}  // namespace

void ViewRegistration::remember(const TrainingSet& set) {
  if (!gain_.empty()) return;
  gain_.assign(set.images.size(), 1.0);
  for (const PosedImage& image : set.images) images_.push_back(image.power);
  for (const PosedImage& image : set.deconvolved) deconvolved_.push_back(image.power);
}

void ViewRegistration::divide_by_gains(TrainingSet& set) const {
  for (std::size_t v = 0; v < set.images.size(); ++v) {
    set.images[v].power = divided(images_[v], gain_[v]);
    if (set.deconvolved.empty()) continue;
    set.deconvolved[v].power = divided(deconvolved_[v], gain_[v]);
    set.deconvolved[v].acquisition = set.images[v].acquisition;
  }
}

void ViewRegistration::pass(TrainingSet& set, const LearnedField& field, const PixelLoss& pixel) {
  const std::size_t n = set.images.size();
  remember(set);
  std::vector<double> log_gain(n);
  double mean = 0.0;
  for (std::size_t v = 0; v < n; ++v) {
    Acquisition& a = set.images[v].acquisition;
    const Image<float> rendered = render_view(field, a);
    const glm::dvec2 shift(a.azimuth_shift_m / a.azimuth_spacing_m, a.range_shift_m / a.range_spacing_m);
    const glm::dvec3 step = gauss_newton_step(set.images[v].power, rendered, pixel, shift);
    a.azimuth_shift_m += step.x * a.azimuth_spacing_m;
    a.range_shift_m += step.y * a.range_spacing_m;
    log_gain[v] = step.z;
    mean += step.z / static_cast<double>(n);
  }
  remove_common_translation(set.images);
  for (std::size_t v = 0; v < n; ++v) gain_[v] *= std::exp(log_gain[v] - mean);
  divide_by_gains(set);
  ++n_done_;
}

void ViewRegistration::save(Archive& archive, const TrainingSet& set) const {
  if (n_done_ == 0) return;
  torch::Tensor shifts = torch::empty({static_cast<std::int64_t>(set.images.size()), 3}, torch::kDouble);
  auto* out = shifts.data_ptr<double>();
  for (std::size_t v = 0; v < set.images.size(); ++v) {
    *out++ = set.images[v].acquisition.azimuth_shift_m;
    *out++ = set.images[v].acquisition.range_shift_m;
    *out++ = gain_[v];
  }
  archive.tensors["shifts"] = shifts;
  add_text(archive, "registration", {{"passes", n_done_}});
}

void ViewRegistration::restore(const Archive& archive, TrainingSet& set, const std::string& where) {
  if (n_passes_ == 0 || archive.tensors.find("shifts") == archive.tensors.end()) return;
  const torch::Tensor shifts = archive.tensor("shifts", torch::kDouble, 2, where).contiguous();
  if (shifts.size(0) != static_cast<std::int64_t>(set.images.size()) || shifts.size(1) != 3)
    throw CheckpointError(where + ": the views' shifts are those of other images");
  n_done_ = member<int>(text_of(archive, "registration", where), "passes", where);
  remember(set);
  const auto* in = shifts.data_ptr<double>();
  for (std::size_t v = 0; v < set.images.size(); ++v, in += 3) {
    if (!std::isfinite(in[0]) || !std::isfinite(in[1]) || !(in[2] > 0.0))
      throw CheckpointError(where + ": the views' shifts are damaged");
    set.images[v].acquisition.azimuth_shift_m = in[0];
    set.images[v].acquisition.range_shift_m = in[1];
    gain_[v] = in[2];
  }
  divide_by_gains(set);
}

}  // namespace sarnerf

// SPDX-License-Identifier: Apache-2.0
#include "train/loss.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "field/tensors.h"
#include "files/archives.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/parallel.h"
#include "sarnerf/core/text.h"

namespace sarnerf {

PixelLoss::Term PixelLoss::of(double first, double second, double image) const {
  if (root > 0.0) {
    const double least = root * absolute;
    const double a = std::sqrt(std::max(0.0, first) + least), b = std::sqrt(std::max(0.0, second) + least);
    const double seen = std::sqrt(std::max(0.0, image) + least);
    return {(a - seen) * (b - seen) / absolute, (b - seen) / (2.0 * a * absolute), (a - seen) / (2.0 * b * absolute)};
  }
  const double d = denominator(0.5 * (first + second)), e = (first - image) / d, other = (second - image) / d;
  if (std::abs(e) <= bound && std::abs(other) <= bound) return {e * other, other / d, e / d};
  const double near = std::clamp(e, -bound, bound), near_other = std::clamp(other, -bound, bound);
  const double beyond = std::abs(e - near), beyond_other = std::abs(other - near_other);
  return {near * near_other + bound * (beyond + beyond_other), (beyond > 0.0 ? near : near_other) / d,
          (beyond_other > 0.0 ? near_other : near) / d};
}

/// Power whose root counts as none, over the peak.
constexpr double kRoot = 0.01;

PixelLoss pixel_loss(const TrainingSet& set, const TrainerOptions& options) {
  if (!set.ground || !(options.misfit > 0.0)) return {0.0, double{set.peak}, options.field == "surface" ? kRoot : 0.0};
  const double speckle = set.ground->speckled ? 1.0 / *set.ground->looks : 0.0;
  PixelLoss loss{std::sqrt(speckle + options.misfit * options.misfit), options.misfit * set.ground->plane->mean_power()};
  if (options.error_bound > 0.0) loss.bound = options.error_bound;
  return loss;
}

namespace {

/// Whether the response is a part of the model: where images are not deconvolved.
bool is_through_response(const TrainingSet& set) { return set.resolution && set.ground && set.deconvolved.empty(); }

}  // namespace

std::string loss_text(const TrainingSet& set, const TrainerOptions& options) {
  const PixelLoss pixel = pixel_loss(set, options);
  const std::string through = is_through_response(set) ? ", seen through the impulse response" : "";
  if (pixel.root > 0.0) return format("mean square error of the root of power (+ %g of the peak)", pixel.root) + through;
  if (pixel.relative == 0.0) return "mean square error of power over the peak's square (paper, eq. 31)" + through;
  const std::string bound = options.error_bound > 0.0 ? format(" (linear beyond %.3g s)", options.error_bound) : "";
  return format("mean of (error of power / s)^2%s with s^2 = (%.3g of the power)^2 + (%.3g of the ground's mean)^2",
                bound.c_str(), pixel.relative, options.misfit) + through;
}

namespace {

/// Adds the term of one pixel to a loss, and its derivatives to those by the two renderings, which may be the same.
void add_pixel(DataLoss& loss, const PixelLoss& pixel, float first, float second, float image, float& by_first, float& by_second) {
  const double mu = 0.5 * (double{first} + double{second}), seen = double{image};
  const PixelLoss::Term term = pixel.of(double{first}, double{second}, seen);
  loss.value += term.value;
  loss.square_error += (mu - seen) * (mu - seen);
  loss.image_square += seen * seen;
  ++loss.n_pixels;
  by_first += static_cast<float>(term.by_first);
  by_second += static_cast<float>(term.by_second);
}

/// Rows of a block over the distance within which a response has all but 1 % of its energy: three quarters of the rows then
/// have all their neighbours in the block.
constexpr int kBlockOfBorders = 8;

}  // namespace

DataTerm::DataTerm(const TrainingSet& set, const PixelLoss& pixel, int n_renderings)
    : pixel_(pixel), n_renderings_(static_cast<std::size_t>(n_renderings)) {
  if (n_renderings != 1 && n_renderings != 2) throw UsageError("rows can be rendered once or twice a step");
  if (!is_through_response(set)) return;
  const auto matrices = response_matrices(set.images, *set.resolution);
  // Views of one kind share their matrices' memory: narrow() copies nothing.
  for (std::size_t v = 0; v < set.images.size(); ++v) {
    const PosedImage& image = set.images[v];
    const ResponseMatrix& m = *matrices[v];
    rows_of_a_block_ = std::max(rows_of_a_block_, static_cast<std::uint32_t>(kBlockOfBorders * m.border.azimuth));
    views_.push_back({m.azimuth.narrow(1, m.border.azimuth, image.power.n_azimuth()),
                      m.range.narrow(0, m.border.range, image.power.n_range()), {}, std::vector<Rendering>(n_renderings_),
                      m.border.azimuth, {}});
  }
  update(set, {}, {});
}

void DataTerm::update(const TrainingSet& set, std::span<const RowReference> rows, std::span<const LayoverShadowWindow> windows) {
  if (views_.empty()) return;
  std::vector<std::vector<Rendering>> before;
  std::vector<float> level;  // beyond the borders
  for (std::size_t v = 0; v < views_.size(); ++v) {
    const PosedImage& image = set.images[v];
    View& view = views_[v];
    const torch::Tensor ground = tensor_of(ground_image(*set.ground->plane, image.acquisition));
    level.push_back(ground.mean().item<float>());
    before.push_back(view.renderings);
    for (Rendering& of : view.renderings) of.rendered = ground.clone();
    view.image = tensor_of(image.power);
    view.learned.assign(static_cast<std::size_t>(image.power.n_azimuth()), 0);
  }
  for (const RowReference& r : rows) {
    View& view = views_[r.view];
    view.learned[r.row] = 1;
    const LayoverShadowWindow& w = windows[r.view];
    const auto row = [&](const torch::Tensor& of) {
      return of.select(0, r.row).slice(0, w.first_bin, std::max(w.first_bin, w.end_bin));
    };
    for (std::size_t n = 0; n < n_renderings_; ++n) row(view.renderings[n].rendered).copy_(row(before[r.view][n].rendered));
  }
  for (std::size_t v = 0; v < views_.size(); ++v)
    for (Rendering& of : views_[v].renderings)
      of.seen = views_[v].azimuth.matmul(of.rendered - level[v]).matmul(views_[v].range) + level[v];
}

DataLoss DataTerm::of(const RowBatch& batch, const torch::Tensor& rendered) {
  const torch::NoGradGuard no_gradients;
  const torch::Tensor pixels = rendered.contiguous();
  return views_.empty() ? of_rows(batch, pixels.data_ptr<float>()) : through_response(batch, pixels.data_ptr<float>());
}

DataLoss DataTerm::of_rows(const RowBatch& batch, const float* rendered) const {
  DataLoss loss;
  const std::size_t n_pixels = batch.counts.size(), second = (n_renderings_ - 1) * n_pixels;
  loss.gradient = torch::zeros({static_cast<std::int64_t>(n_renderings_ * n_pixels)}, torch::kFloat);
  float* const by = loss.gradient.data_ptr<float>();
  for (std::size_t n = 0; n < n_pixels; ++n)
    if (batch.counts[n] != 0) add_pixel(loss, pixel_, rendered[n], rendered[second + n], batch.image[n], by[n], by[second + n]);
  return loss;
}

namespace {

/// The rows of one view in a batch.
struct RowsOfView {
  std::vector<std::int64_t> rows;
  std::vector<std::size_t> first_pixel;  ///< of each, in the batch
  torch::Tensor azimuth;                 ///< their rows of A, [n_rows, n_azimuth]
  std::vector<torch::Tensor> gradient;   ///< of each rendering, ∂loss/∂(B f) of the whole view, 0 in rows that do not count
  DataLoss loss;
};

/// 1 for rows of a view whose neighbours within the border are in the batch or cannot change.
std::vector<std::uint8_t> counted_rows(const std::vector<std::uint8_t>& learned, const std::vector<std::int64_t>& batch, int border) {
  std::vector<std::uint8_t> old = learned;
  for (const std::int64_t row : batch) old[static_cast<std::size_t>(row)] = 0;
  std::vector<std::uint8_t> counted(old.size(), 1);
  const auto n = static_cast<int>(old.size());
  for (int row = 0; row < n; ++row) {
    if (old[static_cast<std::size_t>(row)] == 0) continue;
    for (int near = std::max(0, row - border); near <= std::min(n - 1, row + border); ++near)
      counted[static_cast<std::size_t>(near)] = 0;
  }
  return counted;
}

}  // namespace

DataLoss DataTerm::through_response(const RowBatch& batch, const float* rendered) {
  std::map<std::uint32_t, RowsOfView> of_view;
  std::size_t first = 0;
  for (const RowReference& r : batch.rows) {
    RowsOfView& part = of_view[r.view];
    part.rows.push_back(r.row);
    part.first_pixel.push_back(first);
    first += static_cast<std::size_t>(views_[r.view].image.size(1));
  }
  const std::size_t n_pixels = batch.counts.size();
  // B f changes by B of what the rows change by: products of a few rows instead of whole images.
  for (auto& [v, part] : of_view) {
    View& view = views_[v];
    part.azimuth = view.azimuth.index_select(0, torch::tensor(part.rows));
    for (std::size_t r = 0; r < n_renderings_; ++r) {
      Rendering& of = view.renderings[r];
      const std::int64_t n_range = of.rendered.size(1);
      torch::Tensor change = torch::zeros({static_cast<std::int64_t>(part.rows.size()), n_range});
      for (std::size_t n = 0; n < part.rows.size(); ++n) {
        float* const row = of.rendered.data_ptr<float>() + part.rows[n] * n_range;
        float* const by = change.data_ptr<float>() + static_cast<std::int64_t>(n) * n_range;
        for (std::int64_t j = 0; j < n_range; ++j) {
          const std::size_t pixel = part.first_pixel[n] + static_cast<std::size_t>(j);
          if (batch.counts[pixel] == 0) continue;
          const float now = rendered[r * n_pixels + pixel];
          by[j] = now - row[j];
          row[j] = now;
        }
      }
      of.seen.addmm_(part.azimuth.t(), change.matmul(view.range));
      part.gradient.push_back(torch::zeros_like(of.seen));
    }
  }
  std::vector<std::pair<const View*, RowsOfView*>> list;
  for (auto& [v, part] : of_view) list.emplace_back(&views_[v], &part);
  parallel_for(list.size(), 1, [&](std::size_t begin, std::size_t end, int) {
    for (std::size_t n = begin; n < end; ++n) {
      const auto& [view, part] = list[n];
      const float* const first_mu = view->renderings.front().seen.data_ptr<float>();
      const float* const second_mu = view->renderings.back().seen.data_ptr<float>();
      const float* const image = view->image.data_ptr<float>();
      float* const by_first = part->gradient.front().data_ptr<float>();
      float* const by_second = part->gradient.back().data_ptr<float>();
      const std::int64_t n_range = view->image.size(1);
      const std::vector<std::uint8_t> counted = counted_rows(view->learned, part->rows, view->border);
      for (std::int64_t row = 0; row < view->image.size(0); ++row) {
        if (counted[static_cast<std::size_t>(row)] == 0) continue;
        for (std::int64_t p = row * n_range; p < (row + 1) * n_range; ++p)
          add_pixel(part->loss, pixel_, first_mu[p], second_mu[p], image[p], by_first[p], by_second[p]);
      }
    }
  });
  DataLoss loss;
  loss.gradient = torch::zeros({static_cast<std::int64_t>(n_renderings_ * n_pixels)}, torch::kFloat);
  for (const auto& [view, part] : list) {
    loss.value += part->loss.value;
    loss.square_error += part->loss.square_error;
    loss.image_square += part->loss.image_square;
    loss.n_pixels += part->loss.n_pixels;
    for (std::size_t r = 0; r < n_renderings_; ++r) {
      float* const gradient = loss.gradient.data_ptr<float>() + r * n_pixels;
      const torch::Tensor back = part->azimuth.matmul(part->gradient[r]).matmul(view->range).contiguous();
      const std::int64_t n_range = back.size(1);
      for (std::size_t n = 0; n < part->rows.size(); ++n) {
        // A row that comes twice in the batch: B f has the later rendering.
        if (std::find(part->rows.begin() + static_cast<std::ptrdiff_t>(n) + 1, part->rows.end(), part->rows[n]) != part->rows.end())
          continue;
        const float* const row = back.data_ptr<float>() + static_cast<std::int64_t>(n) * n_range;
        for (std::int64_t j = 0; j < n_range; ++j) {
          const std::size_t pixel = part->first_pixel[n] + static_cast<std::size_t>(j);
          if (batch.counts[pixel] != 0) gradient[pixel] = row[j];
        }
      }
    }
  }
  return loss;
}

namespace {

constexpr const char *kRendered = "rendered_rows", *kSeen = "seen_rows";

}  // namespace

void DataTerm::save(Archive& archive) const {
  if (views_.empty()) return;
  // Views may differ in size: their pixels stand one behind the other.
  std::vector<torch::Tensor> rendered, seen;
  for (const View& view : views_)
    for (const Rendering& of : view.renderings) {
      rendered.push_back(of.rendered.flatten());
      seen.push_back(of.seen.flatten());
    }
  archive.tensors[kRendered] = torch::cat(rendered);
  archive.tensors[kSeen] = torch::cat(seen);
}

void DataTerm::restore(const Archive& archive, const std::string& where) {
  if (views_.empty()) return;
  const torch::Tensor rendered = archive.tensor(kRendered, torch::kFloat, 1, where);
  const torch::Tensor seen = archive.tensor(kSeen, torch::kFloat, 1, where);
  std::int64_t n_pixels = 0;
  for (const View& view : views_) n_pixels += static_cast<std::int64_t>(n_renderings_) * view.image.numel();
  if (rendered.numel() != n_pixels || seen.numel() != n_pixels)
    throw CheckpointError(where + ": the rendered rows are those of other images");
  std::int64_t first = 0;
  for (View& view : views_) {
    const auto take = [&](const torch::Tensor& flat) {
      return flat.narrow(0, first, view.image.numel()).view(view.image.sizes()).clone();
    };
    for (Rendering& of : view.renderings) {
      of = {take(rendered), take(seen)};
      first += view.image.numel();
    }
  }
}

namespace {

/// Of the least error so far, and of black images.
constexpr double kDivergence = 1000.0, kWorseThanBlack = 10.0;

}  // namespace

DivergenceGuard::DivergenceGuard(const TrainingSet& set) : peak_(double{set.peak}), mean_square_(0.0) {
  for (const PosedImage& image : set.training_images()) {
    double sum = 0.0;
    for (const float p : image.power.pixels()) sum += (double{p} / peak_) * (double{p} / peak_);
    mean_square_ += sum / static_cast<double>(image.power.pixels().size() * set.images.size());
  }
}

void DivergenceGuard::check(const DataLoss& loss, std::int64_t step) {
  const double error = loss.per_pixel(loss.square_error) / peak_ / peak_;
  const double black = mean_square_ + loss.per_pixel(loss.image_square) / peak_ / peak_;
  if (!std::isfinite(loss.value) || !std::isfinite(error) || (error > kDivergence * least_ && error > kWorseThanBlack * black))
    throw NumericsError("training diverges: at step " + std::to_string(step) + " the mean square error is " +
                        std::to_string(error) + " of the peak's square; use lower learning rates");
  least_ = std::min(least_, error);
}

}  // namespace sarnerf

// SPDX-License-Identifier: Apache-2.0
#include "train/loss.h"

#include <cmath>
#include <map>

#include <torch/csrc/autograd/autograd.h>

#include "files/archives.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/text.h"

namespace sarnerf {

PixelLoss::Term PixelLoss::of(double rendered, double image) const {
  const double d = relative ? std::max(0.0, rendered) + scale : scale, error = (rendered - image) / d;
  const double bounded = huber_delta > 0.0 ? std::clamp(error, -huber_delta, huber_delta) : error;
  return {bounded * (2.0 * error - bounded), 2.0 * bounded / d};
}

PixelLoss pixel_loss(const TrainingSet& set, const TrainerOptions& options) {
  if (!set.ground || !(options.relative_epsilon > 0.0)) return {false, double{set.peak}, 0.0};
  return {true, options.relative_epsilon * set.ground->plane->mean_power(), options.huber_delta};
}

namespace {

/// Whether the response is a part of the model: where images are not deconvolved.
bool is_through_response(const TrainingSet& set) { return set.resolution && set.ground && set.deconvolved.empty(); }

}  // namespace

std::string loss_text(const TrainingSet& set, const TrainerOptions& options) {
  const PixelLoss pixel = pixel_loss(set, options);
  const std::string through = is_through_response(set) ? ", seen through the impulse response" : "";
  if (!pixel.relative) return "mean square error of power over the peak's square (paper, eq. 31)" + through;
  const std::string errors =
      pixel.huber_delta > 0.0 ? format("mean of Huber's function (delta %.3g) of relative errors", pixel.huber_delta)
                              : "mean square of relative errors";
  return errors + format(" of power, epsilon %.3g times the ground's mean", options.relative_epsilon) + through;
}

namespace {

/// Adds the term of one pixel to a loss, and returns its gradient.
float add_pixel(DataLoss& loss, const PixelLoss& pixel, float rendered, float image) {
  const double mu = double{rendered}, seen = double{image};
  const PixelLoss::Term term = pixel.of(mu, seen);
  loss.value += term.value;
  loss.square_error += (mu - seen) * (mu - seen);
  loss.image_square += seen * seen;
  ++loss.n_pixels;
  return static_cast<float>(term.gradient);
}

}  // namespace

DataTerm::DataTerm(const TrainingSet& set, const PixelLoss& pixel) : pixel_(pixel) {
  if (!is_through_response(set)) return;
  const auto matrices = response_matrices(set.images, *set.resolution);
  // Views of one kind share their matrices' memory: narrow() copies nothing.
  for (std::size_t v = 0; v < set.images.size(); ++v) {
    const PosedImage& image = set.images[v];
    const ResponseMatrix& m = *matrices[v];
    View view{m.azimuth.narrow(1, m.border.azimuth, image.power.n_azimuth()),
              m.range.narrow(0, m.border.range, image.power.n_range()), tensor_of(image.power),
              tensor_of(ground_image(*set.ground->plane, image.acquisition))};
    view.level = view.rendered.mean().item<float>();
    views_.push_back(std::move(view));
  }
}

void DataTerm::set_images(const TrainingSet& set) {
  for (std::size_t v = 0; v < views_.size(); ++v) views_[v].image = tensor_of(set.images[v].power);
}

DataLoss DataTerm::of(const RowBatch& batch, const torch::Tensor& rendered) {
  const torch::NoGradGuard no_gradients;
  const torch::Tensor pixels = rendered.contiguous();
  return views_.empty() ? of_rows(batch, pixels.data_ptr<float>()) : through_response(batch, pixels.data_ptr<float>());
}

DataLoss DataTerm::of_rows(const RowBatch& batch, const float* rendered) const {
  DataLoss loss;
  loss.gradient = torch::zeros({static_cast<std::int64_t>(batch.counts.size())}, torch::kFloat);
  float* const gradient = loss.gradient.data_ptr<float>();
  for (std::size_t n = 0; n < batch.counts.size(); ++n) {
    if (batch.counts[n] == 0) continue;
    gradient[n] = add_pixel(loss, pixel_, rendered[n], batch.image[n]);
  }
  return loss;
}

DataLoss DataTerm::through_response(const RowBatch& batch, const float* rendered) {
  std::map<std::uint32_t, torch::Tensor> back_along_range;  // ρ'(e) / d, seen along range, of the views that have rows
  std::size_t first = 0;
  for (const RowReference& r : batch.rows) {
    torch::Tensor& view = views_[r.view].rendered;
    float* const row = view.data_ptr<float>() + static_cast<std::int64_t>(r.row) * view.size(1);
    for (std::int64_t j = 0; j < view.size(1); ++j, ++first)
      if (batch.counts[first] != 0) row[j] = rendered[first];
    back_along_range[r.view];
  }
  DataLoss loss;
  for (auto& [v, back] : back_along_range) {
    const View& view = views_[v];
    torch::Tensor mean = (view.azimuth.matmul(view.rendered - view.level).matmul(view.range) + view.level).contiguous();
    float* const mu = mean.data_ptr<float>();
    const float* const image = view.image.data_ptr<float>();
    for (std::int64_t n = 0; n < mean.numel(); ++n)
      mu[n] = add_pixel(loss, pixel_, mu[n], image[n]);
    back = mean.matmul(view.range);
  }
  loss.gradient = torch::zeros({static_cast<std::int64_t>(batch.counts.size())}, torch::kFloat);
  float* const gradient = loss.gradient.data_ptr<float>();
  first = 0;
  for (const RowReference& r : batch.rows) {
    const torch::Tensor row = views_[r.view].azimuth[r.row].matmul(back_along_range[r.view]).contiguous();
    for (std::int64_t j = 0; j < row.numel(); ++j, ++first)
      if (batch.counts[first] != 0) gradient[first] = row.data_ptr<float>()[j];
  }
  return loss;
}

namespace {

constexpr const char* kName = "rendered_rows";

}  // namespace

void DataTerm::save(Archive& archive) const {
  if (views_.empty()) return;
  // Views may differ in size: their pixels stand one behind the other.
  std::vector<torch::Tensor> flat;
  for (const View& view : views_) flat.push_back(view.rendered.flatten());
  archive.tensors[kName] = torch::cat(flat);
}

void DataTerm::restore(const Archive& archive, const std::string& where) {
  if (views_.empty()) return;
  const torch::Tensor flat = archive.tensor(kName, torch::kFloat, 1, where);
  std::int64_t first = 0;
  for (View& view : views_) {
    const std::int64_t n = view.rendered.numel();
    if (first + n > flat.numel()) throw CheckpointError(where + ": the rendered rows are those of other images");
    view.rendered = flat.narrow(0, first, n).view(view.rendered.sizes()).clone();
    first += n;
  }
  if (first != flat.numel()) throw CheckpointError(where + ": the rendered rows are those of other images");
}

void RowGradients::carry_back(const RenderedRows& rows) const {
  if (!(distortion > 0.0)) return torch::autograd::backward({rows.pixels}, {pixels});
  torch::autograd::backward({rows.pixels, rows.distortion}, {pixels, torch::full({1}, distortion, torch::kDouble)});
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

// SPDX-License-Identifier: Apache-2.0
#include "train/response.h"

#include <algorithm>
#include <cstdlib>
#include <map>
#include <tuple>
#include <utility>

#include "files/archives.h"
#include "sarnerf/core/error.h"

namespace sarnerf {

namespace {

/// [n, n + 2 border]
torch::Tensor matrix_of(const Kernel& kernel, int n, int border) {
  torch::Tensor matrix = torch::zeros({n, n + 2 * border}, torch::kFloat);
  auto entries = matrix.accessor<float, 2>();
  for (int to = 0; to < n; ++to)
    for (int from = 0; from < n + 2 * border; ++from) {
      const int apart = to + border - from;
      if (std::abs(apart) > kernel.reach()) continue;
      const double tap = kernel.taps[static_cast<std::size_t>(kernel.reach() + apart)];
      entries[to][from] = static_cast<float>(tap * tap);
    }
  return matrix;
}

}  // namespace

std::vector<std::shared_ptr<const ResponseMatrix>> response_matrices(const std::vector<PosedImage>& images,
                                                                     const Resolution& resolution) {
  std::map<std::tuple<int, int, double, double>, std::shared_ptr<const ResponseMatrix>> known;
  std::vector<std::shared_ptr<const ResponseMatrix>> matrices;
  for (const PosedImage& image : images) {
    const Acquisition& a = image.acquisition;
    auto& matrix = known[{a.n_azimuth, a.n_range, a.azimuth_spacing_m, a.range_spacing_m}];
    if (!matrix) {
      const ImpulseResponse response = impulse_response(resolution, a.azimuth_spacing_m, a.range_spacing_m);
      const Border border = border_of(response, a.n_azimuth, a.n_range);
      matrix = std::make_shared<ResponseMatrix>(
          ResponseMatrix{border, matrix_of(response.azimuth, a.n_azimuth, border.azimuth),
                         matrix_of(response.range, a.n_range, border.range).t().contiguous()});
    }
    matrices.push_back(matrix);
  }
  return matrices;
}

namespace {

constexpr int kIterations = 60;

/// Of the largest pixel.
constexpr float kTail = 1e-4f;

/// Power below which a quotient of two says nothing, of the image's largest.
constexpr float kFaintest = 1e-12f;

/// Each iteration begins ahead of where the last one ended, by as much of the last change as the changes before say
/// (Biggs and Andrews 1997). What lies beyond the borders is found, too, as far as it leaks in, and cut off.
torch::Tensor without_response(const torch::Tensor& image, const ResponseMatrix& response) {
  const float faintest = kFaintest * image.max().item<float>();
  if (!(faintest > 0.0f)) return torch::zeros_like(image);
  const torch::Tensor kept = response.adjoint_of(torch::ones_like(image));
  torch::Tensor sharp = torch::full_like(kept, image.mean().item<float>()), before, step;
  double ahead = 0.0;
  for (int n = 0; n < kIterations; ++n) {
    const torch::Tensor from = n > 1 ? (sharp + ahead * (sharp - before)).clamp_min(0.0f) : sharp;
    before = sharp;
    sharp = from * response.adjoint_of(image / response.of(from).clamp_min(faintest)) / kept;
    const torch::Tensor last = std::exchange(step, sharp - from);
    if (n == 0) continue;
    const double square = last.square().sum().item<double>();
    ahead = square > 0.0 ? std::clamp((step * last).sum().item<double>() / square, 0.0, 1.0) : 0.0;
  }
  const Border& border = response.border;
  return sharp.narrow(0, border.azimuth, image.size(0)).narrow(1, border.range, image.size(1));
}

}  // namespace

std::vector<PosedImage> sharpened(const std::vector<PosedImage>& images, const Resolution& resolution) {
  const torch::NoGradGuard no_gradients;
  const auto matrices = response_matrices(images, resolution);
  std::vector<PosedImage> sharp = images;
  float peak = 0.0f;
  for (std::size_t v = 0; v < images.size(); ++v) {
    sharp[v].power = image_of(without_response(tensor_of(images[v].power).clamp_min(0.0f), *matrices[v]));
    for (const float p : sharp[v].power.pixels()) peak = std::max(peak, p);
  }
  for (PosedImage& image : sharp)
    for (float& p : image.power.pixels())
      if (p < kTail * peak) p = 0.0f;
  return sharp;
}

namespace {

constexpr const char* kName = "rendered_rows";

torch::Tensor image_of_ground(const LevelGround& ground, const Acquisition& a) {
  Image<float> image(a.n_azimuth, a.n_range);
  for (int i = 0; i < a.n_azimuth; ++i) {
    const GroundBins bins = ground_bins(ground, a, i);
    for (int j = 0; j < a.n_range; ++j) image(i, j) = static_cast<float>(bins.power[static_cast<std::size_t>(j)]);
  }
  return tensor_of(image);
}

}  // namespace

RowsThroughResponse::RowsThroughResponse(const TrainingSet& set, double floor, double most) : floor_(floor), most_(most) {
  const auto matrices = response_matrices(set.images, *set.resolution);
  // Views of one kind share their matrices' memory: narrow() copies nothing.
  for (std::size_t v = 0; v < set.images.size(); ++v) {
    const PosedImage& image = set.images[v];
    const ResponseMatrix& m = *matrices[v];
    View view{m.azimuth.narrow(1, m.border.azimuth, image.power.n_azimuth()),
              m.range.narrow(0, m.border.range, image.power.n_range()), tensor_of(image.power),
              image_of_ground(*set.clutter->ground, image.acquisition)};
    view.level = view.rendered.mean().item<float>();
    views_.push_back(std::move(view));
  }
}

torch::Tensor RowsThroughResponse::inverse_scale(const torch::Tensor& power) const {
  return floor_ > 0.0 ? 1.0 / (power.clamp_min(0.0f) + floor_) : torch::ones_like(power);
}

/// e / (μ + floor) before the way back along azimuth: of all rows, seen along range.
torch::Tensor RowsThroughResponse::gradient(const View& v) const {
  const torch::Tensor mean = v.azimuth.matmul(v.rendered - v.level).matmul(v.range) + v.level;
  const torch::Tensor inverse = inverse_scale(mean);
  torch::Tensor error = (mean - v.image) * inverse;
  if (most_ > 0.0) error = error.clamp(-most_, most_);
  return (error * inverse).matmul(v.range);
}

torch::Tensor RowsThroughResponse::wanted(std::span<const RowReference> rows, const torch::Tensor& pixels,
                                          const torch::Tensor& counts) {
  std::map<std::uint32_t, torch::Tensor> along_range;  // of the views that have rows
  std::int64_t first = 0;
  for (const RowReference& r : rows) {
    torch::Tensor row = views_[r.view].rendered[r.row];
    row.copy_(torch::where(counts.narrow(0, first, row.size(0)) > 0, pixels.narrow(0, first, row.size(0)), row));
    first += row.size(0);
    along_range[r.view];
  }
  for (auto& [view, gradients] : along_range) gradients = gradient(views_[view]);
  torch::Tensor wanted = pixels.clone();
  first = 0;
  for (const RowReference& r : rows) {
    const torch::Tensor g = views_[r.view].azimuth[r.row].matmul(along_range[r.view]);
    torch::Tensor row = wanted.narrow(0, first, g.size(0));
    row.sub_(g / inverse_scale(row).square());
    first += g.size(0);
  }
  return wanted;
}

void RowsThroughResponse::save(Archive& archive) const {
  // Views may differ in size: their pixels stand one behind the other.
  std::vector<torch::Tensor> flat;
  for (const View& view : views_) flat.push_back(view.rendered.flatten());
  archive.tensors[kName] = torch::cat(flat);
}

void RowsThroughResponse::restore(const Archive& archive, const std::string& where) {
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

}  // namespace sarnerf

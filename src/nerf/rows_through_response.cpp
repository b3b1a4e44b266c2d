// SPDX-License-Identifier: Apache-2.0
#include "rows_through_response.h"

#include <map>

#include "image_tensor.h"
#include "response_matrix.h"
#include "sarnerf/core/error.h"

namespace sarnerf {
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

// SPDX-License-Identifier: Apache-2.0
#include "grid_learning.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "sarnerf/nerf/carving.h"

namespace sarnerf {

std::vector<RowReference> rows_that_see(const TrainingSet& set, const Box& box_m) {
  std::vector<RowReference> rows;
  if (box_m.empty()) return rows;
  for (std::uint32_t v = 0; v < set.images.size(); ++v) {
    const Acquisition& a = set.images[v].acquisition;
    const glm::dvec3 h = radar_frame(a).h;
    double low_m = std::numeric_limits<double>::infinity(), high_m = -low_m;
    for (const glm::dvec3& corner : box_m.corners()) {
      low_m = std::min(low_m, glm::dot(corner, h));
      high_m = std::max(high_m, glm::dot(corner, h));
    }
    for (int i = 0; i < a.n_azimuth; ++i) {
      if (a.row_offset_m(i + 0.5) >= low_m && a.row_offset_m(i - 0.5) <= high_m)
        rows.push_back({v, static_cast<std::uint32_t>(i)});
    }
  }
  return rows;
}

RowsOfPass rows_of_pass(const TrainingSet& set, const Box& box_m, std::size_t n_wanted) {
  const std::vector<RowReference> all = rows_that_see(set, box_m);
  const std::size_t stride = std::max<std::size_t>(1, all.size() / n_wanted);
  RowsOfPass pass;
  for (std::size_t n = 0; n < all.size(); n += stride) pass.rows.push_back(all[n]);
  if (!all.empty()) pass.share = static_cast<double>(pass.rows.size()) / static_cast<double>(all.size());
  return pass;
}

GridField initial_grid_field(const TrainingSet& set, const GridOptions& options, const Monitor& monitor) {
  const GridTransform transform =
      grid_transform(set, options.voxel_size_m * std::exp2(options.n_levels - 1));
  CarvedVoxels carved = carve(set, transform, monitor);
  GridField field(transform, options.harmonics_degree, double{set.bright});
  if (set.clutter) field.ground = set.clutter->ground;
  field.resolution = set.resolution;
  const auto n = std::count(carved.active.begin(), carved.active.end(), std::uint8_t{1});
  auto coefficients = torch::zeros({n, field.channels().n_source()});
  coefficients.select(1, 0).fill_(options.initial_brightness * std::sqrt(4.0 * std::numbers::pi));
  const torch::Tensor log_depth = torch::full({n}, std::log(options.initial_depth));
  field.set_voxels(std::move(carved.topology), carved.active, log_depth, coefficients);
  return field;
}

namespace {

/// Extinction (1/m) and the isotropic coefficient of brightness 1: [n_voxels × 2].
std::vector<float> grey_values(const GridField& field) {
  constexpr float kOne = 3.5449077f;  // √(4π)
  std::vector<float> values(2 * field.n_voxels(), 0.0f);
  const float* a = field.log_depth.data_ptr<float>();
  const auto density = static_cast<float>(0.5 / field.transform().voxel_size_m);
  for (std::size_t n = 0; n < field.n_active(); ++n) {
    float* const value = &values[2 * std::size_t{field.active_voxels()[n]}];
    value[0] = density * std::exp(a[n]);
    value[1] = kOne;
  }
  return values;
}

}  // namespace

std::vector<std::uint8_t> worth_keeping(const GridField& field, const TrainingSet& set,
                                        const RowsOfPass& pass, const RaySampling& sampling,
                                        const GridOptions& options) {
  const std::span<const RowReference> rows = pass.rows;
  // Derivatives of the sum of all pixels by the isotropic coefficients are what voxels return of their brightness,
  // whatever that is: a field of the same extinction and equally bright everywhere does.
  const FieldChannels grey{false, 0, SourceBasis::harmonics};
  const std::vector<float> values = grey_values(field);
  const BrickView<const float> view{&field.topology(), field.transform(), grey.count(), values};
  RaySampling without_priors = sampling;
  without_priors.distortion = 0.0;
  RowRenderer renderer(view, grey, field.occupancy(), without_priors);
  const auto n_channels = static_cast<std::size_t>(grey.count());
  const auto isotropic = static_cast<std::size_t>(grey.first_source());
  std::vector<float> exposure(field.n_active() * n_channels), pixels, ones;
  std::vector<double> returned(field.n_active(), 0.0);
  constexpr std::size_t kRows = 256;
  for (std::size_t first = 0; first < rows.size(); first += kRows) {
    std::vector<RowRequest> some;
    std::size_t n_pixels = 0;
    for (const RowReference& r : rows.subspan(first, std::min(kRows, rows.size() - first))) {
      some.push_back({set.images[r.view].acquisition, static_cast<int>(r.row)});
      n_pixels += static_cast<std::size_t>(some.back().acquisition.n_range);
    }
    pixels.resize(n_pixels);
    ones.assign(n_pixels, 1.0f);
    renderer.forward(some, pixels);
    renderer.backward(ones, field.active_voxels(), exposure);
    for (std::size_t n = 0; n < returned.size(); ++n) returned[n] += double{exposure[n * n_channels + isotropic]};
  }
  const float* a = field.log_depth.data_ptr<float>();
  const auto least = static_cast<float>(std::log(options.prune_depth));
  const double least_returned = options.prune_exposure * pass.share * static_cast<double>(set.images.size());
  std::vector<std::uint8_t> keep(field.n_active());
  for (std::size_t n = 0; n < keep.size(); ++n) keep[n] = a[n] >= least && returned[n] > least_returned ? 1 : 0;
  return keep;
}

}  // namespace sarnerf

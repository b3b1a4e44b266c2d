// SPDX-License-Identifier: Apache-2.0
#include "surface/row_slices.h"

#include <algorithm>
#include <cmath>

namespace sarnerf {

namespace {

/// Samples begin, begin + k_step, … of a slice, n_samples in all.
void copy_samples(const Slice& from, std::size_t begin, int k_step, int n_samples, const SliceGroup& group,
                  Slice& to) {
  to.n_rays = n_samples - 2;
  if (to.n_rays < 0) return;
  to.resize(to.n_rays);
  to.k_step = k_step;
  to.first = from.first + static_cast<int>(begin) - 1 + k_step;
  to.along_m = from.along_m;
  to.width_m = from.width_m * group.n_slices;
  const auto step = static_cast<std::size_t>(k_step);
  const auto shift = static_cast<float>(group.shift), rays = static_cast<float>(k_step);
  const auto slices = static_cast<float>(group.n_slices);
  for (std::size_t n = 0, m = begin; n < static_cast<std::size_t>(n_samples); ++n, m += step) {
    to.surface[n] = from.surface[m];
    to.bin[n] = from.bin[m] + shift * from.bin_per_slice[m];
    to.bin_per_ray[n] = rays * from.bin_per_ray[m];
    to.bin_per_slice[n] = slices * from.bin_per_slice[m];
    to.gamma[n] = rays * slices * from.gamma[m];
  }
}

}  // namespace

void append_groups(int n_slices, std::vector<SliceGroup>& groups) {
  const std::size_t begin = groups.size();
  groups.resize(begin + static_cast<std::size_t>(n_slices));
  int n_pairs = 0;
  for (int first = 0; first < n_slices;) {
    const int left = n_slices - first;
    const int n = left == 4 ? 2 : std::min(left, kCoarser);
    const int chosen = first + (n == 2 ? n_pairs++ % 2 : n / 2);
    groups[begin + static_cast<std::size_t>(chosen)] = {n, first + 0.5 * (n - 1) - chosen};
    first += n;
  }
}

void SliceSubset::take(const Slice& slice, int k_step, const SliceGroup& group) {
  const int last = slice.n_rays + 1;
  const int whole = last / k_step;
  copy_samples(slice, 0, k_step, whole + 1, group, steps);
  copy_samples(slice, static_cast<std::size_t>(whole * k_step), 1, last - whole * k_step + 1, group, rest);
}

namespace {

/// Rows with more corners than slices, and more than this, are cut equally: their errors average out.
constexpr std::ptrdiff_t kAlwaysCut = 4;
/// Corners closer than this fraction of a slice count as one.
constexpr double kSameCorner = 1e-3;
/// Smallest number of slices between two corners in rows of few corners, however close the corners are. A wall nearly
/// parallel to the slices begins and ends in such a gap, and the part that it hides changes throughout it. A single slice
/// there would be wrong by percents of an image; the error estimate would miss that, since coarser samplings have the
/// same slice.
constexpr int kLeastBetween = 3;

}  // namespace

RowSlices::RowSlices(const Acquisition& acquisition, int n_slices, std::span<const glm::vec3> vertices_m,
                     const glm::dvec3& origin_from_aim_m)
    : acquisition_(acquisition), n_slices_(n_slices) {
  // Rows of one slice are compared with the neighbouring row, which must then have one slice, too.
  if (n_slices == 1) return;
  if (double(vertices_m.size()) > double(acquisition.n_azimuth) * n_slices) return;
  const glm::dvec3 h = radar_frame(acquisition).h;
  const double same_m = kSameCorner * acquisition.azimuth_spacing_m / n_slices;
  for (const glm::vec3& v : vertices_m) corners_m_.push_back(glm::dot(glm::dvec3(v) + origin_from_aim_m, h));
  std::sort(corners_m_.begin(), corners_m_.end());
  const auto same = [&](double a, double b) { return b - a < same_m; };
  corners_m_.erase(std::unique(corners_m_.begin(), corners_m_.end(), same), corners_m_.end());
}

void RowSlices::row(int i, std::vector<RowSlice>& slices, std::vector<SliceGroup>& groups) const {
  slices.clear();
  groups.clear();
  const double row_m = acquisition_.azimuth_spacing_m, equal_m = row_m / n_slices_;
  const double begin_m = acquisition_.row_offset_m(i - 0.5);
  const auto cut = [&](double from_m, double length_m, int n) {
    const double width_m = length_m / n;
    for (int s = 0; s < n; ++s) slices.push_back({from_m + (s + 0.5) * width_m, width_m, width_m / equal_m});
    append_groups(n, groups);
  };
  const double least_m = kSameCorner * equal_m;
  const auto first = std::lower_bound(corners_m_.begin(), corners_m_.end(), begin_m + least_m);
  const auto last = std::lower_bound(first, corners_m_.end(), begin_m + row_m - least_m);
  if (first == last || last - first > std::max<std::ptrdiff_t>(kAlwaysCut, n_slices_)) {
    for (int s = 0; s < n_slices_; ++s) slices.push_back({begin_m + (s + 0.5) * equal_m, equal_m, 1.0});
    append_groups(n_slices_, groups);
    return;
  }
  const int least = last - first <= kAlwaysCut ? kLeastBetween : 1;
  double from_m = begin_m;
  for (auto corner = first;; ++corner) {
    const double to_m = corner == last ? begin_m + row_m : *corner;
    cut(from_m, to_m - from_m, std::max(least, static_cast<int>(std::lround((to_m - from_m) / equal_m))));
    if (corner == last) return;
    from_m = to_m;
  }
}

}  // namespace sarnerf

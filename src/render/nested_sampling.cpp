// SPDX-License-Identifier: Apache-2.0
#include "nested_sampling.h"

namespace sarnerf {
namespace {

/// Groups of two slices, the last one of three if their number is odd.
std::vector<SliceGroup> groups_of(int n_sub_rows) {
  std::vector<SliceGroup> groups(static_cast<std::size_t>(n_sub_rows));
  int n_groups = 0;
  for (int first = 0; first < n_sub_rows; ++n_groups) {
    const int left = n_sub_rows - first;
    const int n = left < 4 ? left : 2;
    // The middle slice, or the two beside the middle in turn.
    const int chosen = first + n / 2 - (n % 2 == 0 ? n_groups % 2 : 0);
    groups[static_cast<std::size_t>(chosen)] = {n, first + 0.5 * (n - 1) - chosen};
    first += n;
  }
  return groups;
}

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

NestedLevel nested_level(int k_step, int n_sub_rows) {
  if (n_sub_rows == 1) return {k_step, {{1, 1.0}}, true};
  return {k_step, groups_of(n_sub_rows), false};
}

void SliceSubset::take(const Slice& slice, int k_step, const SliceGroup& group) {
  const int last = slice.n_rays + 1;
  const int whole = last / k_step;
  copy_samples(slice, 0, k_step, whole + 1, group, steps);
  copy_samples(slice, static_cast<std::size_t>(whole * k_step), 1, last - whole * k_step + 1, group, rest);
}

}  // namespace sarnerf

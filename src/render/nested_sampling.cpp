// SPDX-License-Identifier: Apache-2.0
#include "nested_sampling.h"

#include <algorithm>

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

}  // namespace sarnerf

// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/dataset/outliers.h"

#include <algorithm>
#include <queue>
#include <set>

#include "sarnerf/core/format.h"

namespace sarnerf {
namespace {

constexpr float kGap = 10.0f;
constexpr std::size_t kPixelsForEach = 10'000, kImagesForEach = 4;

struct Dimmer {
  bool operator()(const Outlier& a, const Outlier& b) const { return a.power > b.power; }
};

/// The `n` brightest pixels, brightest first.
std::vector<Outlier> brightest(std::span<const PosedImage> images, std::size_t n) {
  std::priority_queue<Outlier, std::vector<Outlier>, Dimmer> kept;
  for (std::size_t v = 0; v < images.size(); ++v) {
    const Image<float>& power = images[v].power;
    for (int i = 0; i < power.n_azimuth(); ++i) {
      const auto row = power.row(i);
      for (int j = 0; j < power.n_range(); ++j) {
        const float p = row[static_cast<std::size_t>(j)];
        if (kept.size() == n && !(p > kept.top().power)) continue;
        if (kept.size() == n) kept.pop();
        kept.push({v, i, j, p, 0.0f});
      }
    }
  }
  std::vector<Outlier> list;
  for (; !kept.empty(); kept.pop()) list.push_back(kept.top());
  std::reverse(list.begin(), list.end());
  return list;
}

}  // namespace

std::vector<Outlier> find_outliers(std::span<const PosedImage> images) {
  std::size_t n_pixels = 0;
  for (const PosedImage& image : images) n_pixels += image.power.pixels().size();
  const std::size_t most = std::max<std::size_t>(1, n_pixels / kPixelsForEach);
  std::vector<Outlier> top = brightest(images, most + 1);
  std::size_t n_above = top.empty() ? 0 : top.size() - 1;
  // Where all other pixels are 0 there is nothing to compare with.
  while (n_above > 0 && !(top[n_above].power > 0.0f && top[n_above - 1].power / top[n_above].power > kGap)) --n_above;
  if (n_above == 0) return {};
  const float limit = top[n_above].power;
  top.resize(n_above);
  std::set<std::size_t> holders;
  for (Outlier& outlier : top) {
    outlier.limit = limit;
    holders.insert(outlier.image);
  }
  if (holders.size() * kImagesForEach > images.size()) return {};
  return top;
}

std::vector<Outlier> limit_outliers(std::span<PosedImage> images) {
  std::vector<Outlier> outliers = find_outliers(images);
  for (const Outlier& o : outliers) images[o.image].power(o.i, o.j) = o.limit;
  return outliers;
}

std::string outlier_text(const Outlier& outlier, std::span<const PosedImage> images) {
  return format("%s: pixel %d, %d (azimuth row, range bin) holds a power of %.3g, and no pixel that others confirm more than "
                "%.3g: it counts as that; is the file damaged?",
                images[outlier.image].name.c_str(), outlier.i, outlier.j, double{outlier.power}, double{outlier.limit});
}

}  // namespace sarnerf

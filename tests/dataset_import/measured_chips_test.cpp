// SPDX-License-Identifier: Apache-2.0
// What cannot be known without measured chips: that growing TargetAz turns targets as we say. SARNERF_MSTAR names a
// folder with manifest.csv (file, azimuth_deg, depression_deg) and amplitude/2S1_b01/17/ beside it.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "sarnerf/core/units.h"
#include "sarnerf/dataset/phoenix.h"
#include "sarnerf/dataset/image_file.h"
#include "sarnerf/dataset/image_index.h"
#include "sarnerf/evaluation/baseline.h"

using namespace sarnerf;

namespace {

constexpr int kSkipped = 77;
constexpr double kTurn_deg = 15.0, kNear_deg = 1.0;

Chip chip_of_image(const IndexedImage& indexed) {
  PhoenixChip phoenix;
  phoenix.magnitude = read_image(indexed.file);
  phoenix.target_azimuth_deg = indexed.azimuth_deg;
  phoenix.desired_depression_deg = indexed.depression_deg;
  phoenix.range_spacing_m = *indexed.range_spacing_m;
  phoenix.cross_range_spacing_m = *indexed.azimuth_spacing_m;
  return chip_of(phoenix, 4500.0);
}

PosedImage posed(Chip chip) {
  return {"chip", acquisition_of(chip.view, glm::dvec3(0.0)), std::move(chip.image)};
}

/// Of what both images show: pixels that turning did not bring in from outside.
double correlation(const Image<float>& turned, const Image<float>& truth) {
  double n = 0, sa = 0, sb = 0, saa = 0, sbb = 0, sab = 0;
  for (std::size_t p = 0; p < truth.pixels().size(); ++p) {
    const double a = turned.pixels()[p], b = truth.pixels()[p];
    if (!(a > 0.0)) continue;
    n += 1, sa += a, sb += b, saa += a * a, sbb += b * b, sab += a * b;
  }
  return (n * sab - sa * sb) / std::sqrt((n * saa - sa * sa) * (n * sbb - sb * sb));
}

double correlation_turned(const PosedImage& from, const PosedImage& to, double by_deg) {
  Acquisition wanted = from.acquisition;
  wanted.azimuth_rad += rad_from_deg(by_deg);
  return correlation(interpolate_view(std::vector{from}, wanted, Interpolation::rotated_linear),
                     to.power);
}

}  // namespace

int main() {
  const char* const root = std::getenv("SARNERF_MSTAR");
  if (root == nullptr) {
    std::puts("skipped: SARNERF_MSTAR names no folder of measured chips");
    return kSkipped;
  }
  const std::filesystem::path folder = root;
  auto images = read_image_index(folder / "manifest.csv", folder / "amplitude/2S1_b01/17");
  std::sort(images.begin(), images.end(),
            [](const auto& a, const auto& b) { return a.azimuth_deg < b.azimuth_deg; });
  double right = 0.0, wrong = 0.0, none = 0.0;
  int n_pairs = 0, n_right_best = 0;
  for (std::size_t a = 0; a < images.size(); a += 12) {
    const auto b = std::find_if(
        images.begin() + static_cast<std::ptrdiff_t>(a), images.end(), [&](const auto& image) {
          return std::abs(image.azimuth_deg - images[a].azimuth_deg - kTurn_deg) < kNear_deg;
        });
    if (b == images.end()) continue;
    const PosedImage from = posed(chip_of_image(images[a])), to = posed(chip_of_image(*b));
    const double by_deg = b->azimuth_deg - images[a].azimuth_deg;
    const double plus = correlation_turned(from, to, by_deg),
                 minus = correlation_turned(from, to, -by_deg);
    const double still = correlation_turned(from, to, 0.0);
    std::printf("%8.3f -> %8.3f deg: turned %.3f, turned the other way %.3f, not turned %.3f\n",
                images[a].azimuth_deg, b->azimuth_deg, plus, minus, still);
    right += plus, wrong += minus, none += still;
    n_right_best += plus > minus ? 1 : 0;
    ++n_pairs;
  }
  if (n_pairs < 10) {
    std::printf("expected ten pairs of chips and more, found %d\n", n_pairs);
    return 1;
  }
  std::printf(
      "mean of %d pairs: turned %.3f, the other way %.3f, not turned %.3f; the right way wins %d "
      "times\n",
      n_pairs, right / n_pairs, wrong / n_pairs, none / n_pairs, n_right_best);
  return right > wrong && right > none && n_right_best >= 0.8 * n_pairs ? 0 : 1;
}

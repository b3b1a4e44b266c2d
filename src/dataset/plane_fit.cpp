// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "interpolate_between.h"
#include "sarnerf/core/metrics.h"
#include "sarnerf/core/parallel.h"

namespace sarnerf {
namespace {

constexpr std::size_t kMostLeftOut = 12;
constexpr int kSteps = 16;  ///< of the search, on each side of the aim point
constexpr int kRefinements = 4;

/// Predicts some of the views from all others.
class LeaveOneOut {
 public:
  LeaveOneOut(Views views, double peak, const Monitor& monitor)
      : views_(views), peak_(peak), monitor_(monitor) {}

  /// Mean PSNR (dB), of a finite PSNR for equal images so that duplicates do not decide.
  double psnr_db_at(double plane_height_m) const {
    const std::size_t count = std::min(views_.size(), kMostLeftOut);
    std::vector<double> psnr(count);
    parallel_for(count, 1, [&](std::size_t begin, std::size_t end, int) {
      for (std::size_t n = begin; n < end; ++n) {
        monitor_.check();
        const std::size_t left_out = n * views_.size() / count;
        std::vector<const PosedImage*> others(views_.begin(), views_.end());
        others.erase(others.begin() + static_cast<std::ptrdiff_t>(left_out));
        const PosedImage& truth = *views_[left_out];
        const Image<float> image = interpolate_between(
            others, truth.acquisition, Interpolation::rotated_linear, plane_height_m);
        psnr[n] = std::min(100.0, psnr_db(image, truth.power, peak_));
      }
    });
    double sum = 0.0;
    for (const double value : psnr) sum += value;
    return sum / double(count);
  }

 private:
  Views views_;
  double peak_;
  const Monitor& monitor_;
};

struct Candidate {
  double height_m = 0.0;
  double psnr_db = -std::numeric_limits<double>::infinity();
};

}  // namespace

double fitted_plane_height_m(std::span<const PosedImage> training, const Monitor& monitor) {
  const std::vector<const PosedImage*> views = checked_views(training);
  double peak = 0.0, half_swath_m = std::numeric_limits<double>::infinity();
  for (const PosedImage* view : views) {
    const Acquisition& a = view->acquisition;
    for (const float p : view->power.pixels()) peak = std::max(peak, double(p));
    half_swath_m =
        std::min(half_swath_m, 0.5 * a.n_range * a.range_spacing_m / std::cos(a.incidence_rad));
  }
  if (views.size() < 2 || !(peak > 0.0)) return 0.0;

  const LeaveOneOut left_out(views, peak, monitor);
  Candidate best;
  const auto offer = [&](double height_m) {
    const double psnr = left_out.psnr_db_at(height_m);
    if (psnr > best.psnr_db) best = {height_m, psnr};
  };
  double step_m = half_swath_m / kSteps;
  offer(0.0);  // first, so that it is what remains where the height makes no difference
  for (int n = 1; n <= kSteps; ++n) {
    offer(n * step_m);
    offer(-n * step_m);
  }
  for (int n = 0; n < kRefinements; ++n) {
    step_m *= 0.5;
    const double middle_m = best.height_m;
    offer(middle_m + step_m);
    offer(middle_m - step_m);
  }
  return best.height_m;
}

}  // namespace sarnerf

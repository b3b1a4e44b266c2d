// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "interpolate_between.h"
#include "leave_one_out.h"

namespace sarnerf {
namespace {

constexpr int kSteps = 16;  ///< of the search, on each side of the aim point
constexpr int kRefinements = 4;

struct Candidate {
  double height_m = 0.0;
  double psnr_db = -std::numeric_limits<double>::infinity();
};

}  // namespace

double fitted_plane_height_m(std::span<const PosedImage> training, const Monitor& monitor) {
  const std::vector<const PosedImage*> views = checked_views(training);
  const LeaveOneOut left_out(views, monitor);
  if (!left_out.possible()) return 0.0;
  double half_swath_m = std::numeric_limits<double>::infinity();
  for (const PosedImage* view : views) {
    const Acquisition& a = view->acquisition;
    half_swath_m =
        std::min(half_swath_m, 0.5 * a.n_range * a.range_spacing_m / std::cos(a.incidence_rad));
  }

  Candidate best;
  const auto offer = [&](double height_m) {
    const double psnr = left_out.psnr_db([&](Views others, const Acquisition& wanted) {
      return interpolate_between(others, wanted, Interpolation::rotated_linear, height_m);
    });
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

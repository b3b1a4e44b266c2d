// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/dataset/baseline.h"

#include <cstdio>
#include <limits>

#include "interpolate_between.h"
#include "leave_one_out.h"
#include "sarnerf/core/gaussian_blur.h"
#include "sarnerf/dataset/background.h"

namespace sarnerf {
namespace {

constexpr double kBlurs_pixels[] = {0.0, 0.7, 1.0, 1.5, 2.0};

Image<float> view_between(Views training, const Acquisition& wanted, const Baseline& b) {
  const Average average = b.of_amplitudes ? Average::amplitude : Average::power;
  Image<float> view = gaussian_blur(
      interpolate_between(training, wanted, b.method, b.plane_height_m, average), b.blur_pixels);
  if (b.of_amplitudes)
    for (float& p : view.pixels()) p *= p;
  return view;
}

}  // namespace

std::string name(const Baseline& baseline) {
  std::string text(name(baseline.method));
  char value[40];
  if (baseline.blur_pixels != 0.0) {
    std::snprintf(value, sizeof value, ", blurred by %.2g", baseline.blur_pixels);
    text += value;
  }
  if (baseline.of_amplitudes) text += ", amplitudes";
  if (supposes_plane(baseline.method) && baseline.plane_height_m != 0.0) {
    std::snprintf(value, sizeof value, " (plane at %.2f m)", baseline.plane_height_m);
    text += value;
  }
  return text;
}

Image<float> baseline_view(std::span<const PosedImage> training, const Acquisition& wanted,
                           const Baseline& baseline) {
  validate(wanted);
  return view_between(checked_views(training), wanted, baseline);
}

double fitted_blur_pixels(std::span<const PosedImage> training, const Baseline& baseline,
                          const Monitor& monitor) {
  const std::vector<const PosedImage*> views = checked_views(training);
  const LeaveOneOut left_out(views, monitor);
  double best_pixels = 0.0, best_db = -std::numeric_limits<double>::infinity();
  if (!left_out.possible()) return best_pixels;
  for (const double blur_pixels : kBlurs_pixels) {
    Baseline blurred = baseline;
    blurred.blur_pixels = blur_pixels;
    const double psnr = left_out.psnr_db([&](Views others, const Acquisition& wanted) {
      return view_between(others, wanted, blurred);
    });
    if (psnr > best_db) {
      best_db = psnr;
      best_pixels = blur_pixels;
    }
  }
  return best_pixels;
}

std::vector<Baseline> default_baselines(std::span<const PosedImage> training,
                                        const Monitor& monitor) {
  std::vector<Baseline> baselines;
  for (const Interpolation method : interpolations_for(training)) baselines.push_back({method});
  if (baselines.empty()) return baselines;
  const double fitted_m = fitted_plane_height_m(training, monitor);
  if (fitted_m != 0.0) {
    for (const Interpolation method : interpolations_for(training)) {
      if (supposes_plane(method)) baselines.push_back({method, fitted_m});
    }
  }
  if (!is_speckled(training)) return baselines;
  for (const double height_m : {0.0, fitted_m}) {
    for (const Interpolation method : despeckling_for(training)) {
      for (const bool of_amplitudes : {false, true}) {
        Baseline b{method, height_m, 0.0, of_amplitudes};
        b.blur_pixels = fitted_blur_pixels(training, b, monitor);
        // Unblurred, it is in the list.
        if (method == Interpolation::rotated_linear && b.blur_pixels == 0.0 && !of_amplitudes) continue;
        baselines.push_back(b);
      }
    }
    if (fitted_m == 0.0) break;
  }
  return baselines;
}

}  // namespace sarnerf

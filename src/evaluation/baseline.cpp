// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/evaluation/baseline.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <vector>

#include "sarnerf/core/image_analysis.h"
#include "sarnerf/core/metrics.h"
#include "sarnerf/core/parallel.h"
#include "sarnerf/dataset/posed_image.h"
#include "view_interpolation.h"

namespace sarnerf {

namespace {

constexpr std::size_t kMostLeftOut = 12;

}  // namespace

LeaveOneOut::LeaveOneOut(Views views, const Monitor& monitor) : views_(views), monitor_(monitor) {
  for (const PosedImage* view : views) {
    for (const float p : view->power.pixels()) peak_ = std::max(peak_, double(p));
  }
}

double LeaveOneOut::psnr_db(const Predict& predict) const {
  const std::size_t count = std::min(views_.size(), kMostLeftOut);
  std::vector<double> psnr(count);
  parallel_for(count, 1, [&](std::size_t begin, std::size_t end, int) {
    for (std::size_t n = begin; n < end; ++n) {
      monitor_.check();
      const std::size_t left_out = n * views_.size() / count;
      std::vector<const PosedImage*> others(views_.begin(), views_.end());
      others.erase(others.begin() + static_cast<std::ptrdiff_t>(left_out));
      const PosedImage& truth = *views_[left_out];
      psnr[n] = capped_psnr_db(predict(others, truth.acquisition), truth.power, peak_);
    }
  });
  double sum = 0.0;
  for (const double value : psnr) sum += value;
  return sum / double(count);
}

namespace {

constexpr int kSteps = 16;  ///< heights tried on each side of the aim point
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
  offer(0.0);  // first, so that 0 is kept where the height makes no difference
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
        // The unblurred baseline is already in the list.
        if (method == Interpolation::rotated_linear && b.blur_pixels == 0.0 && !of_amplitudes) continue;
        baselines.push_back(b);
      }
    }
    if (fitted_m == 0.0) break;
  }
  return baselines;
}

}  // namespace sarnerf

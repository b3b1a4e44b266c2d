// SPDX-License-Identifier: Apache-2.0
#include "leave_one_out.h"

#include <algorithm>

#include "sarnerf/core/metrics.h"
#include "sarnerf/core/parallel.h"

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
      psnr[n] = std::min(
          100.0, sarnerf::psnr_db(predict(others, truth.acquisition), truth.power, peak_));
    }
  });
  double sum = 0.0;
  for (const double value : psnr) sum += value;
  return sum / double(count);
}

}  // namespace sarnerf

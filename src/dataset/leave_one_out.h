// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>

#include "sarnerf/core/monitor.h"
#include "view_neighbours.h"

namespace sarnerf {

/// Judges a way to predict views by training images alone: up to twelve of them, spread over the set, are predicted
/// from all others.
class LeaveOneOut {
 public:
  /// Views and monitor must outlive it.
  LeaveOneOut(Views views, const Monitor& monitor);

  /// Whether there is anything to judge by: two views, and some power in them.
  bool possible() const { return views_.size() > 1 && peak_ > 0.0; }

  /// The image of a view, of the views that remain.
  using Predict = std::function<Image<float>(Views others, const Acquisition& wanted)>;

  /// Mean PSNR of power (dB), at most 100 for a view so that duplicates do not decide. Throws Interrupted when the
  /// monitor asks for it.
  double psnr_db(const Predict& predict) const;

 private:
  Views views_;
  const Monitor& monitor_;
  double peak_ = 0.0;
};

}  // namespace sarnerf

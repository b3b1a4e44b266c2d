// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "columns.h"
#include "sarnerf/core/parallel.h"
#include "sarnerf/geometry/acquisition.h"
#include "sight.h"

namespace sarnerf {

/// Space outside of a true solid that no ray of any view reaches before it meets the true surface. Images hold nothing about it:
/// a solid that fills it explains them as well as the truth does.
struct HiddenSpace {
  double extracted_m3 = 0.0;  ///< of it, what an extracted solid fills
  double whole_m3 = 0.0;      ///< all of it within the truth's box: what the best hull without a prior would fill
};

/// Measures it above the truth's lowest point, on points of every kStride-th vertical line at as wide steps. `truth_sight` is of
/// the true surface. Throws Interrupted. Cost: a ray for each point and view, up to the first that reaches it.
HiddenSpace hidden_space(const Columns& extracted, const Columns& truth, const Box& truth_box_m, const Sight& truth_sight,
                         std::span<const Acquisition> views, const Monitor& monitor);

}  // namespace sarnerf

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "sarnerf/render/engine.h"

namespace sarnerf {

/// One render on the way to a tolerance.
struct ToleranceStep {
  int n_elevation = 0, n_sub_rows = 0;
  double estimate = 0.0;  ///< of E
  double seconds = 0.0;
};

/// The cheapest sampling that is expected to meet a tolerance.
struct ToleranceChoice {
  Sampling sampling;        ///< ray spacing and slices a row; good for other views of the scene, too
  double expected_s = 0.0;  ///< of a view like this one
  std::vector<ToleranceStep> steps;  ///< pilots that it follows from
};

/// Renders a view coarsely, with its error by direction, and works out how many rays and slices will do: errors
/// fall with the spacing to the power 1.2 in both directions (measured, docs/accuracy.md), and what is left is
/// shared equally, since the cost is the product of both. Pilots grow until the step that is left is short
/// enough to trust. `tolerance` is E. Cost: about a tenth of the view that it chooses.
ToleranceChoice choose_sampling(const Engine& engine, const Acquisition& acquisition, double tolerance,
                                const Monitor& monitor = {});

/// A view that says of itself that it meets a tolerance.
struct TolerantView {
  RenderedView view;
  ViewPlan plan;         ///< as rendered
  bool met = true;       ///< false after kMostAttempts
  int n_attempts = 1;
};
inline constexpr int kMostAttempts = 5;

/// Renders a view as planned and, while its estimate is above the tolerance, again with finer sampling. A blank
/// view, whose error is not known, is met.
TolerantView render_to_tolerance(const Engine& engine, const ViewPlan& plan, double tolerance,
                                 const Monitor& monitor = {});

}  // namespace sarnerf

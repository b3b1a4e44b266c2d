// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "sarnerf/render/engine.h"

namespace sarnerf {

/// A render on the way to a tolerance.
struct ToleranceStep {
  int n_elevation = 0, n_sub_rows = 0;
  double estimate = 0.0;  ///< of E
  double seconds = 0.0;
};

/// A view that says of itself that it meets a tolerance.
struct TolerantView {
  RenderedView view;
  ViewPlan plan;       ///< as rendered
  bool met = true;     ///< false after kMostAttempts
  std::vector<ToleranceStep> steps;  ///< all renders, the last one is this view
};
inline constexpr std::size_t kMostAttempts = 5;

/// The cheapest sampling that is expected to meet a tolerance.
struct ToleranceChoice {
  Sampling sampling;        ///< ray spacing and slices a row; good for similar views of the scene, too
  std::vector<ToleranceStep> steps;
  std::optional<TolerantView> met;  ///< the last pilot, if it met the tolerance already
};

/// Renders a view coarsely, with its error by direction, ever finer until the step that is left is short enough
/// to trust a prediction: errors fall with a power of the spacing in either direction. Of all samplings that are
/// expected to meet the tolerance, the one with the fewest rays is chosen. `tolerance` is E, between 0 and 1; above
/// 5 % images know too little of their error, and what meets 5 % is made instead. Cost: a tenth to a third of the
/// view that it chooses.
ToleranceChoice choose_sampling(const Engine& engine, const Acquisition& acquisition, double tolerance,
                                Integrator integrator = Integrator::exact, const Monitor& monitor = {});

/// Renders a view as planned and, while its own estimate is above the tolerance, again with finer sampling. A
/// blank view, whose error is not known, counts as met.
TolerantView render_to_tolerance(const Engine& engine, const ViewPlan& plan, double tolerance,
                                 const Monitor& monitor = {});

}  // namespace sarnerf

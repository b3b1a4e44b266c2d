// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/render/engine.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>

#include "sarnerf/core/error.h"
#include "sarnerf/core/text.h"

namespace sarnerf {
namespace {

/// Mean error E of the automatic sampling over scenes, and the power of the ray spacing or slice width with which
/// errors decrease from there.
constexpr double kAutomaticError = 0.006, kOrder = 1.4;
/// Factor by which the first pilot is coarser, in both directions, than what scenes need on average. It is smaller for
/// coarse tolerances, because the error of a poorly converged image is hard to estimate.
double pilot_coarser(double tolerance) { return std::clamp(3.5 * std::pow(0.01 / tolerance, 0.35), 2.0, 3.5); }
/// Power with which errors decrease near the tolerance. It grows as errors become smaller: a poorly resolved scene has
/// the power of one that loses whole pieces between rays. Measured over 13 scenes from three sides. The spread between
/// scenes is as large, and two pilots do not determine a scene's own power better than this.
double order(double tolerance) { return std::clamp(kOrder - 0.2 * std::log(tolerance / 0.01), 0.9, 2.0); }
/// Fractions of the tolerance: the largest estimate that is accepted (it may be too low), and the error that predictions
/// aim at (so that renders rarely have to be repeated).
constexpr double kSafety = 0.97, kAim = 0.75;
/// Largest refinement of either direction over which a prediction is trusted, and refinement from pilot to pilot.
constexpr double kTrustedStep = 9.0, kPilotStep = 3.0;
/// Smallest refinement factor of a direction: where the pilot was too fine, the sampling may become this much coarser.
constexpr double kCoarsest = 0.7;
/// A view that missed the tolerance is rendered again with at least this many times the rays.
constexpr double kLeastGrowth = 1.4;
constexpr int kMostPilots = 8;

/// A single slice a row gives a poor error estimate, multiples of three the best: see row_slices.h. Two slices may both
/// miss a wall that is nearly parallel to them, and underestimate the error by a factor of eight, so that fine
/// tolerances need three.
constexpr int kFewestSlices = 2;
int fewest_slices(double tolerance) { return tolerance < 0.03 ? 3 : kFewestSlices; }
int more_slices(int n) { return n < 3 ? n + 1 : n + 3; }
int slices_at_least(double wanted) {
  int n = kFewestSlices;
  while (n < 0.95 * wanted) n = more_slices(n);
  return n;
}

/// Next sampling relative to the last one.
struct Refinement {
  double rays;  ///< factor on the density of rays
  int n_slices;
};
constexpr double kFar = std::numeric_limits<double>::infinity();

/// The refinement with the fewest rays whose predicted error is kAim of the tolerance; `rays` is kFar if no trusted number
/// of slices reaches it. The squares of both directions' errors add up: each candidate number of slices fixes the
/// along-track part, and the rays must meet what is left for the elevation part.
Refinement fewest_rays(const ViewPlan& plan, const ErrorEstimate& error, double tolerance) {
  const double aim = kAim * tolerance, p = order(tolerance);
  const bool apart = !std::isnan(error.elevation);
  const double both = apart ? std::hypot(error.elevation, error.along_track) : std::numbers::sqrt2;
  const double elevation = error.relative * (apart ? error.elevation : 1.0) / both;
  const double along_track = error.relative * (apart ? error.along_track : 1.0) / both;
  const int most = slices_at_least(kTrustedStep * plan.n_slices);
  Refinement best{kFar, most};
  double fewest = kFar;
  const double wanted = std::max(kCoarsest * plan.n_slices, double(fewest_slices(tolerance)));
  for (int n = slices_at_least(wanted); n <= most; n = more_slices(n)) {
    const double slices = double(n) / plan.n_slices, along = along_track * std::pow(slices, -p);
    if (!(along < aim)) continue;
    const double rays = std::max({std::pow(elevation / std::sqrt(aim * aim - along * along), 1.0 / p), kCoarsest,
                                  kLeastGrowth / slices});
    if (rays * slices >= fewest) continue;
    fewest = rays * slices;
    best = {rays, n};
  }
  return best;
}

double spacing_m(const ViewPlan& plan) { return plan.fan.step_rad * plan.acquisition.slant_range_m; }

/// Sampling to render after a view that missed the tolerance, and whether it is expected to meet it.
struct NextSampling {
  Sampling sampling;
  bool trusted = true;
};

NextSampling next_sampling(const ViewPlan& plan, const ErrorEstimate& error, double tolerance) {
  // An unknown error allows no prediction: refine both directions.
  const bool known = !std::isnan(error.relative);
  Refinement r = known ? fewest_rays(plan, error, tolerance) : Refinement{kFar, slices_at_least(kPilotStep * plan.n_slices)};
  NextSampling next;
  next.trusted = std::max(r.rays, double(r.n_slices) / plan.n_slices) <= kTrustedStep;
  if (!next.trusted) {
    r.rays = std::min(r.rays, kPilotStep);
    r.n_slices = std::min(r.n_slices, slices_at_least(kPilotStep * plan.n_slices));
  }
  next.sampling.integrator = plan.integrator;
  next.sampling.ray_spacing_m = spacing_m(plan) / r.rays;
  next.sampling.n_slices = r.n_slices;
  return next;
}

/// Images of a larger error are too poorly resolved to estimate it: coarser tolerances are replaced by this one.
constexpr double kCoarsestTolerance = 0.05;

/// The tolerance that is used: at most kCoarsestTolerance. Throws UsageError outside (0, 1).
double checked(double tolerance) {
  if (tolerance > 0.0 && tolerance < 1.0) return std::min(tolerance, kCoarsestTolerance);
  throw UsageError("a tolerance must lie between 0 and 1; it is " + format("%.6g", tolerance));
}

/// An image of unknown error passes only if it is blank; otherwise it has too few rays and is refined.
bool meets(const RenderedView& view, double tolerance) {
  if (!std::isnan(view.error.relative)) return view.error.relative <= kSafety * tolerance;
  return std::ranges::none_of(view.beta0.pixels(), [](float p) { return p > 0.0f; });
}

ToleranceStep render_step(const Engine& engine, const ViewPlan& plan, const Monitor& monitor, RenderedView& view) {
  const auto start = std::chrono::steady_clock::now();
  view = engine.render(plan, monitor);
  const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start;
  return {plan.fan.n_elevation, plan.n_slices, view.error.relative, elapsed.count()};
}

}  // namespace

ToleranceChoice choose_sampling(const Engine& engine, const Acquisition& acquisition, double tolerance,
                                Integrator integrator, const Monitor& monitor) {
  tolerance = checked(tolerance);
  ToleranceChoice choice;
  choice.sampling.integrator = integrator;
  ViewPlan plan = engine.plan(acquisition, choice.sampling);
  if (plan.fan.n_elevation == 0) return choice;
  const double finer = std::pow(kAutomaticError / tolerance, 1.0 / kOrder) / pilot_coarser(tolerance);
  choice.sampling.ray_spacing_m = spacing_m(plan) / finer;
  choice.sampling.n_slices = slices_at_least(plan.n_slices * finer);
  for (int n = 0; n < kMostPilots; ++n) {
    plan = engine.plan(acquisition, choice.sampling);
    plan.error.by_direction = true;
    RenderedView view;
    const ToleranceStep step = render_step(engine, plan, monitor, view);
    choice.steps.push_back(step);
    if (meets(view, tolerance)) {
      choice.met = TolerantView{std::move(view), std::move(plan), true, {step}};
      return choice;
    }
    const NextSampling next = next_sampling(plan, view.error, tolerance);
    choice.sampling = next.sampling;
    if (next.trusted) return choice;
  }
  return choice;
}

TolerantView render_to_tolerance(const Engine& engine, const ViewPlan& plan, double tolerance,
                                 const Monitor& monitor) {
  tolerance = checked(tolerance);
  TolerantView out;
  out.plan = plan;
  out.plan.error.estimate = true;
  for (;;) {
    out.steps.push_back(render_step(engine, out.plan, monitor, out.view));
    const ErrorEstimate& error = out.view.error;
    out.met = meets(out.view, tolerance);
    if (out.met || out.steps.size() == kMostAttempts) return out;
    ViewPlan again = engine.plan(plan.acquisition, next_sampling(out.plan, error, tolerance).sampling);
    request_layers(again, plan.layers);
    again.error = out.plan.error;
    out.plan = std::move(again);
  }
}

}  // namespace sarnerf

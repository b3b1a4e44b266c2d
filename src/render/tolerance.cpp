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

/// What the automatic sampling of scenes has on average, and the power of the ray spacing or slice width with which
/// errors fall from there.
constexpr double kAutomaticError = 0.006, kOrder = 1.4;
/// The first pilot is so much coarser, in both directions, than what scenes need on average. Less so where the
/// tolerance is coarse itself: hardly converged images say little.
double pilot_coarser(double tolerance) { return std::clamp(3.5 * std::pow(0.01 / tolerance, 0.35), 2.0, 3.5); }
/// Near the tolerance, errors fall the faster the smaller they are: a hardly resolved scene has the power of
/// one that is lost piece by piece. Measured over 13 scenes from three sides; the spread between scenes is as large,
/// and two pilots do not know a scene's own power better than this.
double order(double tolerance) { return std::clamp(kOrder - 0.2 * std::log(tolerance / 0.01), 0.9, 2.0); }
/// What an estimate must keep of the tolerance, since it may be too low itself, and what predictions aim at, so that
/// they rarely have to be repeated.
constexpr double kSafety = 0.97, kAim = 0.75;
/// A prediction is trusted over this step of either direction; pilots come closer by the other.
constexpr double kTrustedStep = 9.0, kPilotStep = 3.0;
/// How much coarser than the pilot either direction may become if the pilot was too fine in it.
constexpr double kCoarsest = 0.7;
/// What missed the tolerance comes again with at least so many times the rays.
constexpr double kLeastGrowth = 1.4;
constexpr int kMostPilots = 8;

/// A single slice a row says too little about itself, and threes say most: see row_slices.h. Two may both miss
/// what a wall shows that is nearly parallel to them, and not know it by a factor of eight: not for fine tolerances.
constexpr int kFewestSlices = 2;
int fewest_slices(double tolerance) { return tolerance < 0.03 ? 3 : kFewestSlices; }
int more_slices(int n) { return n < 3 ? n + 1 : n + 3; }
int slices_at_least(double wanted) {
  int n = kFewestSlices;
  while (n < 0.95 * wanted) n = more_slices(n);
  return n;
}

/// How much finer either direction should be sampled.
struct Refinement {
  double rays;  ///< times as dense
  int n_sub_rows;
};
constexpr double kFar = std::numeric_limits<double>::infinity();

/// The fewest rays that are expected to have kAim of the tolerance; kFar times as dense if no trusted number of
/// slices has. Both directions' errors add up in squares; how much of the sum is left to either follows from the
/// numbers of slices that there are to choose from.
Refinement fewest_rays(const ViewPlan& plan, const ErrorEstimate& error, double tolerance) {
  const double aim = kAim * tolerance, p = order(tolerance);
  const bool apart = !std::isnan(error.elevation);
  const double both = apart ? std::hypot(error.elevation, error.along_track) : std::numbers::sqrt2;
  const double elevation = error.relative * (apart ? error.elevation : 1.0) / both;
  const double along_track = error.relative * (apart ? error.along_track : 1.0) / both;
  const int most = slices_at_least(kTrustedStep * plan.n_sub_rows);
  Refinement best{kFar, most};
  double fewest = kFar;
  const double wanted = std::max(kCoarsest * plan.n_sub_rows, double(fewest_slices(tolerance)));
  for (int n = slices_at_least(wanted); n <= most; n = more_slices(n)) {
    const double slices = double(n) / plan.n_sub_rows, along = along_track * std::pow(slices, -p);
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

/// What to render after a view that missed the tolerance, and whether that is expected to meet it.
struct NextSampling {
  Sampling sampling;
  bool trusted = true;
};

NextSampling next_sampling(const ViewPlan& plan, const ErrorEstimate& error, double tolerance) {
  // Of an error that is not known nothing can be predicted.
  const bool known = !std::isnan(error.relative);
  Refinement r = known ? fewest_rays(plan, error, tolerance) : Refinement{kFar, slices_at_least(kPilotStep * plan.n_sub_rows)};
  NextSampling next;
  next.trusted = std::max(r.rays, double(r.n_sub_rows) / plan.n_sub_rows) <= kTrustedStep;
  if (!next.trusted) {
    r.rays = std::min(r.rays, kPilotStep);
    r.n_sub_rows = std::min(r.n_sub_rows, slices_at_least(kPilotStep * plan.n_sub_rows));
  }
  next.sampling.integrator = plan.integrator;
  next.sampling.ray_spacing_m = spacing_m(plan) / r.rays;
  next.sampling.n_sub_rows = r.n_sub_rows;
  return next;
}

/// Images of more than this error are too little resolved to know it: who asks for a coarser one gets this.
constexpr double kCoarsestTolerance = 0.05;

/// The tolerance that views are made to meet.
double checked(double tolerance) {
  if (tolerance > 0.0 && tolerance < 1.0) return std::min(tolerance, kCoarsestTolerance);
  throw UsageError("a tolerance must lie between 0 and 1; it is " + format("%.6g", tolerance));
}

/// A blank image, whose error is not known either, is no reason to look closer; one of too few rays is.
bool meets(const RenderedView& view, double tolerance) {
  if (!std::isnan(view.error.relative)) return view.error.relative <= kSafety * tolerance;
  return std::ranges::none_of(view.beta0.pixels(), [](float p) { return p > 0.0f; });
}

ToleranceStep render_step(const Engine& engine, const ViewPlan& plan, const Monitor& monitor, RenderedView& view) {
  const auto start = std::chrono::steady_clock::now();
  view = engine.render(plan, monitor);
  const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start;
  return {plan.fan.n_elevation, plan.n_sub_rows, view.error.relative, elapsed.count()};
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
  choice.sampling.n_sub_rows = slices_at_least(plan.n_sub_rows * finer);
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

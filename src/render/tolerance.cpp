// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/render/tolerance.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numbers>

#include "sarnerf/core/error.h"

namespace sarnerf {
namespace {

/// Errors fall with spacing or slice width to this power: 1.0 to 1.7 over scenes and samplings.
constexpr double kOrder = 1.2;
/// The first pilot: of the automatic ray spacing, and slices a row.
constexpr double kPilotSpacing = 4.0;
constexpr int kPilotSlices = 2;
/// Largest step of either direction that the order is trusted for.
constexpr double kLongestStep = 4.0;
/// Predictions aim a little below the tolerance, so that they rarely have to be repeated.
constexpr double kAim = 0.9;
constexpr int kMostPilots = 6;

/// How much finer either direction should be sampled.
struct Refinement {
  double rays = 1.0, slices = 1.0;
};

/// Half of the squared error is left to either direction.
double finer(double error, double tolerance) {
  return std::pow(std::max(error, 1e-12) * std::numbers::sqrt2 / (kAim * tolerance), 1.0 / kOrder);
}

Refinement refinement(const ErrorEstimate& error, double tolerance) {
  if (std::isnan(error.elevation)) {  // not known apart
    const double both = finer(error.relative / std::numbers::sqrt2, tolerance);
    return {std::max(1.0, both), std::max(1.0, both)};
  }
  Refinement r{finer(error.elevation, tolerance), finer(error.along_track, tolerance)};
  // What one direction does not use of its share is the other's.
  const auto rest_for = [&](double other) {
    const double left = kAim * kAim * tolerance * tolerance - other * other;
    return std::sqrt(std::max(left, 0.5 * kAim * kAim * tolerance * tolerance));
  };
  if (r.rays < 1.0) r.slices = std::pow(error.along_track / rest_for(error.elevation), 1.0 / kOrder);
  if (r.slices < 1.0) r.rays = std::pow(error.elevation / rest_for(error.along_track), 1.0 / kOrder);
  return {std::max(1.0, r.rays), std::max(1.0, r.slices)};
}

double spacing_m(const ViewPlan& plan) { return plan.fan.step_rad * plan.acquisition.slant_range_m; }

Sampling refined(const ViewPlan& plan, const Refinement& r) {
  Sampling sampling;
  sampling.integrator = plan.integrator;
  sampling.ray_spacing_m = spacing_m(plan) / r.rays;
  sampling.n_sub_rows = static_cast<int>(std::ceil(plan.n_sub_rows * r.slices - 1e-9));
  return sampling;
}

/// A plan like another one, sampled differently.
ViewPlan plan_again(const Engine& engine, const ViewPlan& plan, const Sampling& sampling) {
  ViewPlan again = engine.plan(plan.acquisition, sampling);
  request_layers(again, plan.layers);
  again.error = plan.error;
  return again;
}

void require_tolerance(double tolerance) {
  if (tolerance > 0.0 && tolerance < 1.0) return;
  throw UsageError("a tolerance must lie between 0 and 1; it is " + std::to_string(tolerance));
}

}  // namespace

ToleranceChoice choose_sampling(const Engine& engine, const Acquisition& acquisition, double tolerance,
                                const Monitor& monitor) {
  require_tolerance(tolerance);
  ToleranceChoice choice;
  ViewPlan plan = engine.plan(acquisition, {});
  if (plan.fan.n_elevation == 0) return choice;
  Sampling sampling;
  sampling.ray_spacing_m = kPilotSpacing * spacing_m(plan);
  sampling.n_sub_rows = std::min(kPilotSlices, plan.n_sub_rows);
  for (int n = 0; n < kMostPilots; ++n) {
    plan = engine.plan(acquisition, sampling);
    plan.error.by_direction = true;
    const auto start = std::chrono::steady_clock::now();
    const ErrorEstimate error = engine.render(plan, monitor).error;
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    choice.steps.push_back({plan.fan.n_elevation, plan.n_sub_rows, error.relative, seconds});
    choice.sampling = sampling;
    choice.expected_s = seconds;
    // A blank image has no error, and cannot be mended by more rays.
    if (!(error.relative > tolerance)) return choice;
    const Refinement wanted = refinement(error, tolerance);
    const bool trusted = std::max(wanted.rays, wanted.slices) <= kLongestStep;
    const Refinement next{std::min(wanted.rays, kLongestStep), std::min(wanted.slices, kLongestStep)};
    sampling = refined(plan, next);
    choice.sampling = sampling;
    choice.expected_s = seconds * next.rays * next.slices;
    if (trusted) return choice;
  }
  return choice;
}

TolerantView render_to_tolerance(const Engine& engine, const ViewPlan& plan, double tolerance,
                                 const Monitor& monitor) {
  require_tolerance(tolerance);
  TolerantView out;
  out.plan = plan;
  out.plan.error.estimate = out.plan.error.by_direction = true;
  for (out.n_attempts = 1;; ++out.n_attempts) {
    out.view = engine.render(out.plan, monitor);
    const ErrorEstimate& error = out.view.error;
    out.met = !(error.relative > tolerance);
    if (out.met || out.n_attempts == kMostAttempts) return out;
    Refinement r = refinement(error, tolerance);
    // The last step was short of what it should have been: never again by so little that it would not count.
    constexpr double kLeastStep = 1.1;
    if (r.rays < kLeastStep && r.slices < kLeastStep) {
      (error.elevation > error.along_track ? r.rays : r.slices) = 1.25;
    }
    r = {std::min(r.rays, kLongestStep), std::min(r.slices, kLongestStep)};
    out.plan = plan_again(engine, out.plan, refined(out.plan, r));
  }
}

}  // namespace sarnerf

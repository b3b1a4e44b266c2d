// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/render/tolerance.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numbers>
#include <string>

#include "sarnerf/core/error.h"

namespace sarnerf {
namespace {

/// Errors fall with ray spacing or slice width to this power until pilots have measured it, and to no less or
/// more than these.
constexpr double kOrder = 1.4, kLeastOrder = 0.9, kMostOrder = 2.0;
/// The first pilot is so much coarser, in both directions, than what scenes need on average, whose automatic
/// sampling has E = 0.6 %. Less so where the tolerance is coarse itself: hardly converged images say little.
constexpr double kAutomaticError = 0.006;
double pilot_coarser(double tolerance) { return std::clamp(3.5 * std::pow(0.01 / tolerance, 0.35), 2.0, 3.5); }
/// A prediction is trusted over this step of either direction; pilots come closer by the other.
constexpr double kTrustedStep = 5.0, kPilotStep = 3.0;
/// What an estimate must keep of the tolerance, since it may be too low itself, and what predictions aim at, so that
/// they rarely have to be repeated.
constexpr double kSafety = 0.9, kAim = 0.8;
/// What missed the tolerance comes again at least so much finer.
constexpr double kLeastStep = 1.25;
constexpr int kMostPilots = 8;

/// How much finer either direction should be sampled.
struct Refinement {
  double rays = 1.0, slices = 1.0;
  double longest() const { return std::max(rays, slices); }
  Refinement capped(double most) const { return {std::min(rays, most), std::min(slices, most)}; }
};

struct Orders {
  double rays = kOrder, slices = kOrder;
};

double order(double error_before, double error, double step, double otherwise) {
  if (!(step > 1.05) || !(error_before > 0.0) || !(error > 0.0)) return otherwise;
  return std::clamp(std::log(error_before / error) / std::log(step), kLeastOrder, kMostOrder);
}

/// Half of the squared error is left to either direction, and what one does not use of it to the other.
Refinement refinement(const ErrorEstimate& error, double tolerance, const Orders& orders) {
  const double aim = kAim * tolerance, share = aim / std::numbers::sqrt2;
  const bool apart = !std::isnan(error.elevation);
  const double rays = apart ? error.elevation : error.relative / std::numbers::sqrt2;
  const double slices = apart ? error.along_track : error.relative / std::numbers::sqrt2;
  const auto left_by = [&](double other) { return std::sqrt(aim * aim - std::min(other, share) * std::min(other, share)); };
  const auto factor = [](double of_error, double allowed, double p) {
    return std::max(1.0, std::pow(of_error / allowed, 1.0 / p));
  };
  return {factor(rays, left_by(slices), orders.rays), factor(slices, left_by(rays), orders.slices)};
}

double spacing_m(const ViewPlan& plan) { return plan.fan.step_rad * plan.acquisition.slant_range_m; }

/// A number of slices whose thirds estimate the error best, if that is not much more than wanted.
int n_slices(double wanted) {
  if (wanted <= 2.1) return std::max(1, static_cast<int>(std::lround(wanted)));
  return 3 * static_cast<int>(std::ceil(wanted / 3.0 - 0.1));
}

Sampling refined(const ViewPlan& plan, const Refinement& r) {
  Sampling sampling;
  sampling.integrator = plan.integrator;
  sampling.ray_spacing_m = spacing_m(plan) / r.rays;
  sampling.n_sub_rows = n_slices(plan.n_sub_rows * r.slices);
  return sampling;
}

void require_tolerance(double tolerance) {
  if (tolerance > 0.0 && tolerance < 1.0) return;
  throw UsageError("a tolerance must lie between 0 and 1; it is " + std::to_string(tolerance));
}

/// NaN, the error of a blank image, is no reason to look closer.
bool meets(const ErrorEstimate& error, double tolerance) { return !(error.relative > kSafety * tolerance); }

ToleranceStep render_step(const Engine& engine, const ViewPlan& plan, const Monitor& monitor, RenderedView& view) {
  const auto start = std::chrono::steady_clock::now();
  view = engine.render(plan, monitor);
  const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start;
  return {plan.fan.n_elevation, plan.n_sub_rows, view.error.relative, elapsed.count()};
}

}  // namespace

ToleranceChoice choose_sampling(const Engine& engine, const Acquisition& acquisition, double tolerance,
                                Integrator integrator, const Monitor& monitor) {
  require_tolerance(tolerance);
  ToleranceChoice choice;
  choice.sampling.integrator = integrator;
  ViewPlan plan = engine.plan(acquisition, choice.sampling);
  if (plan.fan.n_elevation == 0) return choice;
  const double finer = std::pow(kAutomaticError / tolerance, 1.0 / kOrder) / pilot_coarser(tolerance);
  choice.sampling.ray_spacing_m = spacing_m(plan) / finer;
  // A single slice a row says too little about itself.
  choice.sampling.n_sub_rows = std::max(2, n_slices(plan.n_sub_rows * finer));
  Orders orders;
  ErrorEstimate before;
  for (int n = 0; n < kMostPilots; ++n) {
    plan = engine.plan(acquisition, choice.sampling);
    plan.error.by_direction = true;
    RenderedView view;
    const ToleranceStep step = render_step(engine, plan, monitor, view);
    const ErrorEstimate& error = view.error;
    if (!choice.steps.empty()) {
      const ToleranceStep& last = choice.steps.back();
      orders.rays = order(before.elevation, error.elevation, double(step.n_elevation) / last.n_elevation,
                          orders.rays);
      // Rows of one slice are compared with their neighbours, which measures no order.
      if (last.n_sub_rows > 1) {
        orders.slices = order(before.along_track, error.along_track,
                              double(step.n_sub_rows) / last.n_sub_rows, orders.slices);
      }
    }
    choice.steps.push_back(step);
    if (meets(error, tolerance)) {
      choice.met = TolerantView{std::move(view), std::move(plan), true, {step}};
      return choice;
    }
    const Refinement wanted = refinement(error, tolerance, orders);
    const bool trusted = wanted.longest() <= kTrustedStep;
    const Refinement next = wanted.capped(trusted ? kTrustedStep : kPilotStep);
    choice.sampling = refined(plan, next);
    if (trusted) return choice;
    before = std::move(view.error);
  }
  return choice;
}

TolerantView render_to_tolerance(const Engine& engine, const ViewPlan& plan, double tolerance,
                                 const Monitor& monitor) {
  require_tolerance(tolerance);
  TolerantView out;
  out.plan = plan;
  out.plan.error.estimate = true;
  for (;;) {
    out.steps.push_back(render_step(engine, out.plan, monitor, out.view));
    const ErrorEstimate& error = out.view.error;
    out.met = meets(error, tolerance);
    if (out.met || out.steps.size() == kMostAttempts) return out;
    Refinement r = refinement(error, tolerance, {}).capped(kTrustedStep);
    r = {std::max(r.rays, kLeastStep), std::max(r.slices, kLeastStep)};
    ViewPlan again = engine.plan(plan.acquisition, refined(out.plan, r));
    request_layers(again, plan.layers);
    again.error = out.plan.error;
    out.plan = std::move(again);
  }
}

}  // namespace sarnerf

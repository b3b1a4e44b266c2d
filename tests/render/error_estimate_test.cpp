// SPDX-License-Identifier: Apache-2.0
// What renders say about their own error, against exact visibility in double precision.
#include "sarnerf/render/engine.h"

#include <algorithm>

#include "catch.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/metrics.h"
#include "sarnerf/core/parallel.h"
#include "reference/section_reference.h"
#include "scenes.h"

using namespace sarnerf;
using namespace sarnerf::test;

namespace {

/// A platform of oblique walls with a checker, a shell that leans on it, and a tree beside it, on the ground.
Scene busy_scene() {
  Scene scene = empty_scene(matte(1.0));
  scene.materials.push_back(matte(2.0));
  scene.materials.back().texture = {Texture::Kind::checker, 1.0, 0.25, {}};
  scene.materials.push_back(fog(0.2, 0.05));
  add_frustum(scene, {4.0, 3.0}, {2.0, 2.5}, 5.0, 0.4, {0.0, 0.0, 0.0}, 1);
  add_sheet(scene, {-6.0, 0.0, -1.0}, {3.0, 4.0, 0.3}, {0.5, 0.0, 3.0});
  add_box(scene, {3.0, 4.0, 3.0}, 0.2, {7.0, 0.0, 2.0}, 2);
  scene.ground = Ground{0, 0.0};
  return scene;
}

Scene plain_building() {
  Scene scene = empty_scene(matte(1.0));
  add_box(scene, {12.0, 6.0, 8.0}, 0.35);
  return scene;
}

RenderedView render(const SurfaceEngine& engine, const Acquisition& view, double density, int n_slices,
                    const ErrorRequest& request = {}) {
  Sampling sampling;
  sampling.n_elevation = std::max(1, static_cast<int>(density * engine.plan(view, {}).fan.n_elevation));
  sampling.n_slices = n_slices;
  ViewPlan plan = engine.plan(view, sampling);
  plan.error = request;
  return engine.render(plan);
}

}  // namespace

TEST_CASE("estimates lie between half and three times the error in nine renders of ten", "[error]") {
  int n = 0, n_good = 0;
  for (const Scene& scene : {busy_scene(), plain_building()}) {
    const SurfaceEngine engine(scene);
    for (const double azimuth_deg : {20.0, 77.0}) {
      const Acquisition view = view_of(45.0, 1e4, 80, 80, 0.3, azimuth_deg);
      const Image<float> reference = section_reference(scene, view, 256);
      for (const double density : {0.25, 0.5, 1.0}) {
        for (const int n_slices : {1, 2, 3, 5, 9}) {
          const RenderedView rendered = render(engine, view, density, n_slices);
          const double error = relative_l2_error(rendered.beta0, reference);
          INFO("density " << density << ", slices " << n_slices << ": error " << error << ", estimate "
                          << rendered.error.relative);
          CHECK(rendered.error.relative > 0.25 * error);
          // A single slice is compared with the next row's: too strict for smooth walls.
          CHECK(rendered.error.relative < (n_slices == 1 ? 12.0 : 6.0) * error);
          ++n;
          n_good += rendered.error.relative >= 0.5 * error && rendered.error.relative <= 3.0 * error;
        }
      }
    }
  }
  INFO(n_good << " of " << n);
  CHECK(n_good >= 0.9 * n);
}

TEST_CASE("an estimate changes nothing about the image, and is the same on any number of threads", "[error]") {
  const Scene scene = busy_scene();
  const SurfaceEngine engine(scene);
  const Acquisition view = view_of(40.0, 1e4, 40, 60, 0.4, 10.0);
  const RenderedView silent = render(engine, view, 0.5, 4, {false, false, false});
  CHECK(std::isnan(silent.error.relative));
  for (const int n_threads : {1, 3}) {
    const ThreadLimit limit(n_threads);
    const RenderedView told = render(engine, view, 0.5, 4, {true, true, true});
    CHECK(std::ranges::equal(told.beta0.pixels(), silent.beta0.pixels()));
    CHECK(told.error.relative == render(engine, view, 0.5, 4).error.relative);
    // Errors of the two directions are close to independent.
    const double both = std::hypot(told.error.elevation, told.error.along_track);
    CHECK(both == Approx(told.error.relative).epsilon(0.3));
  }
}

TEST_CASE("the error map has the estimate's norm", "[error]") {
  const Scene scene = busy_scene();
  const SurfaceEngine engine(scene);
  const Acquisition view = view_of(40.0, 1e4, 40, 60, 0.4, 10.0);
  Sampling sampling;
  sampling.n_slices = 6;
  ViewPlan plan = engine.plan(view, sampling);
  LayerRequest request;
  request.layers.add(Layer::error);
  request_layers(plan, request);
  const RenderedView rendered = engine.render(plan);
  double of_map = 0.0, of_image = 0.0;
  for (const float p : rendered.layers.error.pixels()) of_map += double(p) * p;
  for (const float p : rendered.beta0.pixels()) of_image += double(p) * p;
  CHECK(std::sqrt(of_map / of_image) == Approx(rendered.error.relative).epsilon(1e-6));
}

TEST_CASE("walls nearly parallel to the slices do not deceive the estimate", "[error]") {
  Scene scene = empty_scene(matte(0.0));
  add_box(scene, {7.0, 2.6, 2.3});
  const SurfaceEngine engine(scene);
  for (const double azimuth_deg : {1.0, 2.0, 3.0, 5.0}) {
    const Acquisition view = view_of(40.0, 1e4, 80, 80, 0.3, azimuth_deg);
    const Image<float> reference = section_reference(scene, view, 256);
    for (const int n_slices : {2, 3, 6, 9}) {
      const RenderedView rendered = render(engine, view, 1.0, n_slices);
      const double error = relative_l2_error(rendered.beta0, reference);
      INFO("azimuth " << azimuth_deg << ", slices " << n_slices << ": error " << error << ", estimate "
                      << rendered.error.relative);
      CHECK(error < 0.01);
      CHECK(rendered.error.relative > 0.5 * error);
    }
  }
}

TEST_CASE("a blank image has no error that is known", "[error]") {
  Scene scene = empty_scene(matte(1.0, 0.0));
  add_box(scene, {2.0, 2.0, 2.0});
  const SurfaceEngine engine(scene);
  const Acquisition view = view_of(45.0, 1e4, 16, 16);
  CHECK(std::isnan(engine.render(engine.plan(view, {})).error.relative));
  CHECK(render_to_tolerance(engine, engine.plan(view, {}), 0.01).met);
}

TEST_CASE("views meet the tolerance that was asked for", "[tolerance]") {
  for (const Scene& scene : {busy_scene(), plain_building()}) {
    const SurfaceEngine engine(scene);
    const Acquisition view = view_of(45.0, 1e4, 80, 80, 0.3, 20.0);
    const Image<float> reference = section_reference(scene, view, 256);
    std::uint64_t n_rays_before = 0;
    for (const double tolerance : {0.05, 0.01, 0.003}) {
      ToleranceChoice choice = choose_sampling(engine, view, tolerance);
      CHECK_FALSE(choice.steps.empty());
      std::vector<ToleranceStep> steps = choice.steps;
      if (choice.met) steps.clear();  // the last pilot is the view
      const TolerantView found = choice.met ? std::move(*choice.met)
                                            : render_to_tolerance(engine, engine.plan(view, choice.sampling), tolerance);
      steps.insert(steps.end(), found.steps.begin(), found.steps.end());
      double n_rays = 0.0;
      for (const ToleranceStep& step : steps) n_rays += double(step.n_elevation) * step.n_slices;
      const double error = relative_l2_error(found.view.beta0, reference);
      INFO("tolerance " << tolerance << ": error " << error << ", estimate " << found.view.error.relative);
      CHECK(found.met);
      CHECK(found.view.error.relative <= tolerance);
      CHECK(error <= tolerance);
      CHECK(found.plan.n_kept_rays > n_rays_before);  // nobody pays for more than was asked
      CHECK(n_rays < 3.0 * steps.back().n_elevation * steps.back().n_slices);  // nor much for the search
      n_rays_before = found.plan.n_kept_rays;
    }
  }
  const Scene scene = plain_building();
  const SurfaceEngine engine(scene);
  for (const double nonsense : {0.0, 1.0, -0.1}) {
    CHECK_THROWS_AS(choose_sampling(engine, view_of(45.0), nonsense), UsageError);
  }
}

TEST_CASE("coarse tolerances are met, although hardly resolved images know too little of their error", "[tolerance]") {
  Material checker = matte(2.0);
  checker.texture = {Texture::Kind::checker, 1.0, 0.25, {}};
  Scene upright = empty_scene(checker), inverted = upright, box = upright;
  add_frustum(upright, {5.0, 5.0}, {2.5, 2.5}, 6.0);
  add_frustum(inverted, {2.5, 2.5}, {5.0, 5.0}, 6.0);
  add_box(box, {12.0, 6.0, 8.0});
  int n_too_sure = 0;
  for (const Scene& scene : {upright, inverted, box}) {
    const SurfaceEngine engine(scene);
    for (const double azimuth_deg : {20.0, 65.0, 130.0}) {
      const Acquisition view = view_of(45.0, 1e4, 80, 80, 0.3, azimuth_deg);
      const Image<float> reference = section_reference(scene, view, 128);
      const auto error = [&](const RenderedView& rendered) { return relative_l2_error(rendered.beta0, reference); };
      for (const double density : {0.05, 0.07, 0.1}) {
        const RenderedView coarse = render(engine, view, density, 2);
        n_too_sure += coarse.error.relative < 0.1 && error(coarse) > 0.1;
      }
      for (const double tolerance : {0.1, 0.2}) {
        ToleranceChoice choice = choose_sampling(engine, view, tolerance);
        const TolerantView found = choice.met ? std::move(*choice.met)
                                              : render_to_tolerance(engine, engine.plan(view, choice.sampling), tolerance);
        INFO("azimuth " << azimuth_deg << ", tolerance " << tolerance);
        CHECK(error(found.view) <= tolerance);
      }
    }
  }
  CHECK(n_too_sure >= 3);  // else there is nothing to guard against here
}

TEST_CASE("what a few rays or slices cannot tell is not told", "[error]") {
  for (const Scene& scene : {busy_scene(), plain_building()}) {
    const SurfaceEngine engine(scene);
    const Acquisition view = view_of(45.0, 1e4, 80, 80, 0.3, 20.0);
    const Image<float> reference = section_reference(scene, view, 128);
    for (int n_elevation = 1; n_elevation <= 24; ++n_elevation) {
      Sampling sampling;
      sampling.n_elevation = n_elevation;
      const ViewPlan plan = engine.plan(view, sampling);
      const RenderedView rendered = engine.render(plan);
      const double error = relative_l2_error(rendered.beta0, reference);
      INFO(n_elevation << " rays: error " << error << ", estimate " << rendered.error.relative);
      const bool known = why_error_is_unknown(plan).empty();
      CHECK(known == (plan.n_widest_slice >= kFewestForError));
      CHECK(known == !std::isnan(rendered.error.relative));
      if (known) CHECK(rendered.error.relative > 0.1 * error);
      if (!known) CHECK(rendered.warnings.size() == 1);
    }
  }
  // A tolerance is not met by not knowing.
  Scene speck = empty_scene(matte(1.0));
  add_box(speck, {0.5, 0.5, 0.5});
  const SurfaceEngine engine(speck);
  const Acquisition view = view_of(45.0, 1e4, 16, 16, 0.3, 20.0);
  const ToleranceChoice choice = choose_sampling(engine, view, 0.05);
  REQUIRE_FALSE(choice.steps.empty());
  const TolerantView found = choice.met ? *choice.met : render_to_tolerance(engine, engine.plan(view, choice.sampling), 0.05);
  CHECK(found.view.error.relative <= 0.05);
}

// SPDX-License-Identifier: Apache-2.0
// How rows are cut into slices.
#include "surface/row_slices.h"

#include <algorithm>
#include <random>

#include "catch.h"
#include "scenes.h"

using namespace sarnerf;
using namespace sarnerf::test;

namespace {

/// At azimuth 0 the radar flies along −x: this puts a vertex at an along-track coordinate.
std::vector<glm::vec3> vertices_at(const std::vector<double>& along_m) {
  std::vector<glm::vec3> vertices;
  for (const double a : along_m) vertices.push_back(glm::vec3(-a, 1.0, 2.0));
  return vertices;
}

}  // namespace

TEST_CASE("slices cover their row, end at corners, and count as much as they are wide", "[slices]") {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> anywhere(-6.0, 6.0);
  for (const int n_slices : {2, 3, 9}) {
    const Acquisition view = view_of(45.0, 1e4, 12, 8, 1.0);
    std::vector<double> corners;
    for (int n = 0; n < 15; ++n) corners.push_back(anywhere(random));
    const RowSlices rows(view, n_slices, vertices_at(corners), glm::dvec3(0.0));
    std::vector<RowSlice> slices;
    std::vector<SliceGroup> groups;
    for (int i = 0; i < view.n_azimuth; ++i) {
      rows.row(i, slices, groups);
      REQUIRE(slices.size() == groups.size());
      double end = view.row_offset_m(i - 0.5), weight = 0.0;
      int represented = 0;
      for (const RowSlice& s : slices) {
        CHECK(s.along_m - 0.5 * s.width_m == within_margin(end, 1e-12));
        end = s.along_m + 0.5 * s.width_m;
        weight += s.weight;
        CHECK(s.weight == Approx(s.width_m * n_slices / view.azimuth_spacing_m));
        CHECK(s.weight < 2.0);
        // No corner lies inside.
        for (const double c : corners) {
          CHECK_FALSE((c > s.along_m - 0.499 * s.width_m && c < s.along_m + 0.499 * s.width_m));
        }
      }
      CHECK(end == within_margin(view.row_offset_m(i + 0.5), 1e-12));
      CHECK(weight == Approx(n_slices));
      // What groups stand for adds up to the row, and is centred where they say.
      double covered = view.row_offset_m(i - 0.5);
      for (std::size_t s = 0; s < slices.size(); ++s) {
        if (groups[s].n_slices == 0) continue;
        represented += groups[s].n_slices;
        const double width_m = groups[s].n_slices * slices[s].width_m;
        CHECK(slices[s].along_m + groups[s].shift * slices[s].width_m - 0.5 * width_m == within_margin(covered, 1e-12));
        covered += width_m;
      }
      CHECK(represented == static_cast<int>(slices.size()));
      CHECK(covered == within_margin(end, 1e-12));
    }
  }
}

TEST_CASE("between two close corners there are three slices, between many corners only one", "[slices]") {
  const Acquisition view = view_of(45.0, 1e4, 4, 8, 1.0);
  std::vector<RowSlice> slices;
  std::vector<SliceGroup> groups;
  const auto cut = [&](const std::vector<double>& corners) {
    RowSlices(view, 6, vertices_at(corners), glm::dvec3(0.0)).row(1, slices, groups);
    return slices.size();
  };
  const double begin_m = view.row_offset_m(0.5);
  CHECK(cut({begin_m + 0.5, begin_m + 0.51}) == 3 + 3 + 3);
  std::vector<double> corners;
  for (int n = 0; n < 5; ++n) corners.push_back(begin_m + 0.5 + 0.01 * n);
  CHECK(cut(corners) == 3 + 4 + 3);
}

TEST_CASE("meshes of many corners, and rows of one slice, are cut equally", "[slices]") {
  const Acquisition view = view_of(45.0, 1e4, 4, 8, 1.0);
  std::vector<double> many;
  for (int n = 0; n < 200; ++n) many.push_back(-2.0 + 0.02 * n + 0.003);
  std::vector<RowSlice> slices;
  std::vector<SliceGroup> groups;
  for (const auto& [n_slices, corners] : {std::pair{9, many}, std::pair{1, std::vector<double>{0.25}}}) {
    RowSlices(view, n_slices, vertices_at(corners), glm::dvec3(0.0)).row(1, slices, groups);
    CHECK(slices.size() == static_cast<std::size_t>(n_slices));
    for (const RowSlice& s : slices) CHECK(s.weight == 1.0);
  }
}

TEST_CASE("a box at an angle converges with the square of the slices", "[slices]") {
  Scene scene = empty_scene(matte(0.0));
  add_box(scene, {6.0, 3.0, 4.0}, 0.5);
  const SurfaceEngine engine(scene);
  const Acquisition view = view_of(45.0, 1e4, 40, 40, 0.4);
  const auto image = [&](int n_slices) {
    Sampling sampling;
    sampling.n_elevation = 600;
    sampling.n_slices = n_slices;
    return engine.render(engine.plan(view, sampling)).beta0;
  };
  const Image<float> limit = image(96);
  const double coarse = relative_l2(image(3), limit), fine = relative_l2(image(12), limit);
  INFO("3 slices: " << coarse << ", 12: " << fine);
  CHECK(std::log(coarse / fine) / std::log(4.0) > 1.6);
}

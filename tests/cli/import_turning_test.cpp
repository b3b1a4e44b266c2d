// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <numeric>

#include "catch.h"
#include "program.h"
#include "sarnerf/core/units.h"
#include "sarnerf/dataset/image_file.h"
#include "sarnerf/dataset/posed_image.h"
#include "sarnerf/evaluation/baseline.h"

using namespace sarnerf;

namespace {

double correlation(const Image<float>& a, const Image<float>& b) {
  const auto n = static_cast<double>(a.pixels().size());
  const auto sum = [&](const Image<float>& x, const Image<float>& y) {
    return std::inner_product(x.pixels().begin(), x.pixels().end(), y.pixels().begin(), 0.0);
  };
  const Image<float> one(a.n_azimuth(), a.n_range(), 1.0f);
  const auto covariance = [&](const Image<float>& x, const Image<float>& y) {
    return sum(x, y) / n - sum(x, one) / n * (sum(y, one) / n);
  };
  return covariance(a, b) / std::sqrt(covariance(a, a) * covariance(b, b));
}

}  // namespace

TEST_CASE("simulated views become Phoenix chips and come back, and still turn the right way",
          "[import]") {
  const SceneFolder folder;
  // A flat L on the ground: nearly all of it lies in the plane that views are turned about.
  write_text(
      folder / "l.obj",
      "v -3 0 -3\nv 3 0 -3\nv 3 0 -1.5\nv -1.5 0 -1.5\nv -1.5 0 3\nv -3 0 3\n"
      "v -3 0.05 -3\nv 3 0.05 -3\nv 3 0.05 -1.5\nv -1.5 0.05 -1.5\nv -1.5 0.05 3\nv -3 0.05 3\n"
      "f 1 2 3 4 5 6\nf 12 11 10 9 8 7\nf 1 7 8 2\nf 2 8 9 3\nf 3 9 10 4\nf 4 10 11 5\nf 5 11 12 "
      "6\nf 6 12 7 1\n");
  const Outcome render =
      folder.run({"l.obj", "--depression", "30", "--azimuth", "30,50,70", "--quantity", "amplitude",
                  "--size", "60x60", "--spacing", "0.2", "--slant-range", "4500", "-o", "views"});
  INFO(render.err);
  REQUIRE(render.code == 0);
  const Conditions here{folder.path()};
  REQUIRE(sar_import({"phoenix", "views", "-o", "chips"}, here).code == 0);
  const Outcome import = sar_import({"mstar", "chips", "-o", "back"}, here);
  INFO(import.err);
  REQUIRE(import.code == 0);

  const Dataset before = read_manifest(folder / "views"), after = read_manifest(folder / "back");
  REQUIRE(after.views.size() == 3);
  for (std::size_t n = 0; n < 3; ++n) {
    CHECK(after.views[n].azimuth_deg == before.views[n].azimuth_deg);
    CHECK(after.views[n].incidence_deg == before.views[n].incidence_deg);
    CHECK(after.views[n].slant_range_m == before.views[n].slant_range_m);
    CHECK(after.views[n].azimuth_spacing_m == before.views[n].azimuth_spacing_m);
    CHECK(read_text(folder / "back" / after.views[n].image) ==
          read_text(folder / "views" / before.views[n].image));
  }

  const auto images = load_images(folder / "back", after, std::vector<std::size_t>{0, 1, 2});
  const auto turned = [&](double by_deg) {
    Acquisition wanted = images[1].acquisition;
    wanted.azimuth_rad += rad_from_deg(by_deg);
    return interpolate_view(std::vector{images[1]}, wanted, Interpolation::rotated_linear);
  };
  CHECK(correlation(turned(20.0), images[2].power) > 0.8);
  CHECK(correlation(turned(-20.0), images[0].power) > 0.8);
  CHECK(correlation(turned(-20.0), images[2].power) < 0.6);
  CHECK(correlation(turned(20.0), images[0].power) < 0.6);
}

// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <filesystem>

#include "catch.h"
#include "program.h"
#include "sarnerf/dataset/image_file.h"
#include "sarnerf/dataset/manifest.h"

using namespace sarnerf;

namespace {

std::vector<std::string> formed_view(const std::string& output, const std::vector<std::string>& more = {}) {
  return with({"box.obj", "--pitch", "50", "--azimuth", "30", "--size", "48x40", "--spacing", "0.2", "-q", "-o", output}, more);
}

const std::vector<std::string> kMstar = {"--resolution", "0.305", "--window", "taylor:-35", "--looks",
                                         "1",            "--nesz", "-25",      "--ground",   "grass"};

}  // namespace

TEST_CASE("image formation is off unless asked for, and then part of the recipe") {
  const SceneFolder folder;
  REQUIRE(folder.run(formed_view("off")).code == 0);
  CHECK_FALSE(has(read_text(folder / "off.json"), "formation"));

  REQUIRE(folder.run(formed_view("on", kMstar)).code == 0);
  CHECK(read_text(folder / "on.tif") != read_text(folder / "off.tif"));
  const std::string recipe = read_text(folder / "on.json");
  for (const char* piece : {"\"formation\"", "\"resolution_m\"", "\"taylor:-35,4\"", "\"looks\": 1.0",
                            "\"nesz_db\": -25.0", "\"seed\": 1", "\"bandwidth_per_m\"", "\"peak_sidelobe_db\""}) {
    INFO(piece);
    CHECK(has(recipe, piece));
  }

  // Settings that spell out the defaults are the same recipe; another seed is another one.
  const Outcome same = folder.run(with(formed_view("on", kMstar), {"--seed", "1", "--window", "taylor:-35,4"}));
  CHECK(same.code == 2);  // an option given twice
  const Outcome done = folder.run({"box.obj", "--pitch", "50", "--azimuth", "30", "--size", "48x40", "--spacing",
                                   "0.2", "-o", "on", "--resolution", "0.305,0.305", "--window",
                                   "taylor:-35.0,4", "--looks", "1.0", "--nesz", "-25", "--ground", "grass",
                                   "--seed", "1"});
  INFO(done.err);
  CHECK(done.code == 0);
  CHECK(has(done.err, "already done"));
  const Outcome other = folder.run(with(formed_view("on", kMstar), {"--seed", "2"}));
  CHECK(other.code == 2);
  CHECK(is_error_line(other.err, "formation.seed: 1 there, 2 now"));
}

TEST_CASE("a dataset says which impulse response its images have") {
  const SceneFolder folder;
  const std::vector<std::string> two{"box.obj", "--pitch", "50", "--azimuth", "0,30", "--size", "24x20", "--spacing", "0.2"};
  REQUIRE(folder.run(with(two, {"-o", "sharp"})).code == 0);
  REQUIRE(folder.run(with(two, {"-o", "seen", "--resolution", "0.5,0.4", "--window", "taylor:-30"})).code == 0);
  CHECK_FALSE(sarnerf::read_manifest(folder / "sharp").resolution);
  CHECK(sarnerf::read_manifest(folder / "seen").resolution ==
        sarnerf::Resolution{0.5, 0.4, sarnerf::window_from_text("taylor:-30")});
}

TEST_CASE("speckle depends on seed and view, not on threads, sweeps or interruptions") {
  const SceneFolder folder;
  const auto sweep = [&](const std::string& output, const std::vector<std::string>& more) {
    std::vector<std::string> all = {"box.obj", "--pitch", "35,50", "--azimuth", "0:330:30", "--size",
                                    "48x40",   "--spacing", "0.2", "-q", "-o", output};
    return folder.run(with(with(all, kMstar), more)).code;
  };
  REQUIRE(sweep("a", {"--threads", "1"}) == 0);
  REQUIRE(sweep("b", {"--threads", "2"}) == 0);
  REQUIRE(sweep("c", {"--threads", "20"}) == 0);
  CHECK(folder.contents("a") == folder.contents("b"));
  CHECK(folder.contents("a") == folder.contents("c"));
  CHECK(has(read_manifest(folder / "a").provenance_json, "\"nesz_db\":-25"));

  const auto whole = folder.contents("a");
  std::filesystem::remove(folder / "a/images/view_003.tif");
  std::filesystem::remove(folder / "a/images/view_017.tif");
  CHECK(sweep("a", {}) == 0);
  CHECK(folder.contents("a") == whole);

  REQUIRE(folder.run(formed_view("one", kMstar)).code == 0);
  CHECK(read_text(folder / "one.tif") == read_text(folder / "a/images/view_013.tif"));
  REQUIRE(folder.run(formed_view("two", with(kMstar, {"--seed", "2"}))).code == 0);
  CHECK(read_text(folder / "two.tif") != read_text(folder / "one.tif"));
}

TEST_CASE("calibration and quantity come after formation, and the ground is even up to the borders") {
  const SceneFolder folder;
  const auto render = [&](const char* name, const std::vector<std::string>& more) {
    REQUIRE(folder.run(formed_view(name, more)).code == 0);
    return read_image(folder / (std::string(name) + ".tif"));
  };
  const auto beta0 = render("a", kMstar), sigma0 = render("b", with(kMstar, {"--calibration", "sigma0"})),
             amplitude = render("c", with(kMstar, {"--quantity", "amplitude"}));
  const double sine = std::sin(50.0 / 180.0 * std::acos(-1.0));
  for (std::size_t n = 0; n < beta0.pixels().size(); ++n) {
    CHECK(sigma0.pixels()[n] == Approx(beta0.pixels()[n] * sine).epsilon(2e-3));
    CHECK(amplitude.pixels()[n] == Approx(std::sqrt(beta0.pixels()[n])));
  }

  const std::vector<std::string> ground = {"--ground", "grass", "--aim", "100,0,0"};
  const auto even = render("d", ground);
  for (const char* window : {"none", "taylor:-35"}) {
    const auto formed = render(window, with(ground, {"--resolution", "0.3", "--window", window}));
    for (std::size_t n = 0; n < even.pixels().size(); ++n) {
      CHECK(formed.pixels()[n] == Approx(even.pixels()[n]).epsilon(0.02));
    }
  }
}

TEST_CASE("the plan tells what is formed and what is left out") {
  const SceneFolder folder;
  const Outcome off = folder.run(formed_view("a", {"--dry-run"}));
  CHECK(has(off.out, "impulse response, speckle, noise: not asked for"));
  const Outcome on = folder.run(formed_view("a", with(kMstar, {"--dry-run"})));
  for (const char* piece : {"0.305 x 0.305 m", "taylor:-35,4", "-35.2 dB", "1 look of the full resolution",
                            "noise of -25 dB", "cycles/m"}) {
    INFO(piece);
    CHECK(has(on.out, piece));
  }
  CHECK_FALSE(has(on.out, "impulse response, speckle"));
  const Outcome mean = folder.run(formed_view("a", {"--resolution", "0.305", "--dry-run"}));
  CHECK(has(mean.out, "speckle, noise: not asked for"));
}

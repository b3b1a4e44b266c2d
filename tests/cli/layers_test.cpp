// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <filesystem>

#include "catch.h"
#include "program.h"
#include "sarnerf/dataset/image_file.h"

using namespace sarnerf;

namespace {

const std::vector<std::string> kLayersView = {"box.obj", "--pitch", "50", "--size", "32x40", "--spacing", "0.2", "-q"};

}  // namespace

TEST_CASE("layers stand beside the image, add up to it, and go with it") {
  const SceneFolder folder;
  const auto all = with(kLayersView, {"-o", "a", "--layers", "all", "--ground", "grass"});
  REQUIRE(folder.run(all).code == 0);
  const Image<float> image = read_image(folder / "a.tif");
  std::vector<Image<float>> parts;
  for (const char* layer : {"ground", "wall", "roof", "other"}) {
    parts.push_back(read_image(folder / (std::string("a.") + layer + ".tif")));
  }
  for (std::size_t n = 0; n < image.pixels().size(); ++n) {
    double total = 0.0;
    for (const auto& part : parts) total += double(part.pixels()[n]);
    CHECK(total == Approx(image.pixels()[n]).epsilon(1e-6));
  }
  for (const char* file : {"a.mask.tif", "a.mask.png", "a.incidence.tif", "a.elevation.png", "a.scatterers.tif",
                           "a.components.png", "a.error.tif", "a.error.png"}) {
    INFO(file);
    CHECK(std::filesystem::exists(folder / file));
  }
  const Image<float> mask = read_image(folder / "a.mask.tif");
  for (const float value : mask.pixels()) CHECK((value >= 0.0f && value <= 3.0f));

  // The image is the same without; a layer that is missing makes the view unfinished; fewer layers are
  // another recipe, and with --overwrite the others go.
  REQUIRE(folder.run(with(kLayersView, {"-o", "b", "--ground", "grass"})).code == 0);
  CHECK(read_text(folder / "a.tif") == read_text(folder / "b.tif"));
  std::filesystem::remove(folder / "a.wall.tif");
  REQUIRE(folder.run(all).code == 0);
  CHECK(std::filesystem::exists(folder / "a.wall.tif"));
  const auto fewer = with(kLayersView, {"-o", "a", "--layers", "mask", "--ground", "grass"});
  CHECK(is_error_line(folder.run(fewer).err, "layers: [\"ground\""));
  REQUIRE(folder.run(with(fewer, {"--overwrite"})).code == 0);
  CHECK_FALSE(std::filesystem::exists(folder / "a.wall.tif"));
  CHECK_FALSE(std::filesystem::exists(folder / "a.components.png"));
  CHECK(std::filesystem::exists(folder / "a.mask.tif"));
}

TEST_CASE("layers of a sweep have a folder, survive continuing, and are the same from voxels on one thread or two") {
  const SceneFolder folder;
  const auto sweep = with(kLayersView, {"--azimuth", "0:90:30", "--layers", "roof,mask"});
  REQUIRE(folder.run(with(sweep, {"-o", "s"})).code == 0);
  CHECK(std::filesystem::exists(folder / "s/layers/view_003.roof.tif"));
  CHECK(has(read_text(folder / "s/dataset.json"), "\"layers\""));
  const auto before = folder.contents("s");
  std::filesystem::remove(folder / "s/layers/view_002.mask.tif");
  REQUIRE(folder.run(with(sweep, {"-o", "s"})).code == 0);
  CHECK(folder.contents("s") == before);
  REQUIRE(folder.run(with(kLayersView, {"--azimuth", "0:90:30", "-o", "s", "--overwrite"})).code == 0);
  CHECK_FALSE(std::filesystem::exists(folder / "s/layers"));

  const auto voxels = with(sweep, {"--engine", "voxel"});
  REQUIRE(folder.run(with(voxels, {"-o", "v1", "--threads", "1"})).code == 0);
  REQUIRE(folder.run(with(voxels, {"-o", "v2", "--threads", "2"})).code == 0);
  auto one = folder.contents("v1/layers"), two = folder.contents("v2/layers");
  CHECK(one.size() == 16);
  CHECK(one == two);
}

TEST_CASE("layers come without a border, in the image's calibration, and bad names are named") {
  const SceneFolder folder;
  REQUIRE(folder.run(with(kLayersView, {"-o", "f", "--layers", "wall,mask", "--resolution", "0.3", "--window",
                                  "taylor:-35", "--looks", "1", "--calibration", "sigma0"})).code == 0);
  CHECK(read_image(folder / "f.wall.tif").n_azimuth() == 32);
  CHECK(read_image(folder / "f.mask.tif").n_range() == 40);
  REQUIRE(folder.run(with(kLayersView, {"-o", "g", "--layers", "wall"})).code == 0);
  const Image<float> sigma = read_image(folder / "f.wall.tif"), beta = read_image(folder / "g.wall.tif");
  int n = 0;
  for (std::size_t p = 0; p < beta.pixels().size(); ++p) {
    if (!(beta.pixels()[p] > 0.0f)) continue;
    CHECK(sigma.pixels()[p] / beta.pixels()[p] == Approx(std::sin(50.0 * 3.14159265 / 180.0)).epsilon(0.01));
    ++n;
  }
  CHECK(n > 50);
  const Outcome bad = folder.run(with(kLayersView, {"--layers", "wall,shadow"}));
  CHECK(bad.code == 2);
  CHECK(is_error_line(bad.err, "found 'shadow'"));
}

// SPDX-License-Identifier: Apache-2.0
#include "../nerf/torch_catch.h"
#include "cube.h"
#include "programs.h"
#include "sarnerf/core/metrics.h"
#include "sarnerf/dataset/image_file.h"

namespace {

/// Runs a program in the folder; whatever it complains of fails the test.
void must(const ScratchFolder& folder, const char* program, const std::vector<std::string>& arguments) {
  const Outcome outcome = run_program(program, arguments, {folder.path()});
  INFO(outcome.err);
  REQUIRE(outcome.code == 0);
}

}  // namespace

TEST_CASE("a learned field looks the same from its volume, rendered by the program that knows no networks") {
  const ScratchFolder folder;
  write_cube(folder / "cube.obj");
  const std::vector<std::string> pixels{"--size", "32x32", "--spacing", "0.3", "-q"};
  const auto with_pixels = [&](std::vector<std::string> arguments) {
    arguments.insert(arguments.end(), pixels.begin(), pixels.end());
    return arguments;
  };
  must(folder, SAR_RENDER, with_pixels({"cube.obj", "--pitch", "45", "--azimuth", "0:330:30", "-o", "data"}));
  must(folder, SAR_NERF_TRAIN, {"data", "-o", "run", "--field", "grid", "--steps", "200", "-q"});
  must(folder, SAR_EXTRACT, {"run", "native.vdb", "--resolution", "native", "-q"});
  for (const std::string azimuth : {"0", "30"}) {  // onto a face; towards an edge
    must(folder, SAR_NERF_RENDER, with_pixels({"run", "--azimuth", azimuth, "-o", "field" + azimuth}));
    // So finely that what is left is the sampling of sar_nerf_render: 0.4 %.
    must(folder, SAR_RENDER,
         with_pixels({"native.vdb", "--aim", "0,0,0", "--pitch", "45", "--azimuth", azimuth, "--elevations", "400",
                      "--sub-rows", "27", "-o", "volume" + azimuth}));
    const auto field = sarnerf::read_image(folder / ("field" + azimuth + ".tif"));
    const auto volume = sarnerf::read_image(folder / ("volume" + azimuth + ".tif"));
    INFO("azimuth " << azimuth);
    CHECK(sarnerf::relative_l2_error(volume, field) <= 0.01);
  }
}

// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/dataset/posed_image.h"

#include <array>
#include <limits>
#include <numeric>

#include "catch.h"
#include "sarnerf/core/files.h"
#include "sarnerf/core/error.h"
#include "sarnerf/dataset/image_file.h"
#include "scratch_folder.h"

using namespace sarnerf;

namespace {

constexpr std::array<std::size_t, 1> kFirst{0};

/// 2 rows, 3 columns, values 1 to 6 as read.
Image<float> counted(int n_rows = 2, int n_columns = 3) {
  Image<float> image(n_rows, n_columns);
  std::iota(image.pixels().begin(), image.pixels().end(), 1.0f);
  return image;
}

Dataset one_view(const ScratchFolder& folder, const Image<float>& image) {
  AtomicFiles files(Durability::process);
  files.add(folder / "a.tif", encode_tiff(image));
  files.commit();
  Dataset dataset;
  DatasetView view;
  view.image = "a.tif";
  view.incidence_deg = 45.0;
  view.slant_range_m = 1000.0;
  view.n_azimuth = 2;
  view.n_range = 3;
  view.azimuth_spacing_m = view.range_spacing_m = 0.3;
  dataset.views = {view};
  return dataset;
}

}  // namespace

TEST_CASE("images come with azimuth rows and range growing along columns") {
  const Image<float> file = counted();
  // The pixel in the file's first row and last column, 3, goes where the axes say.
  const Image<float> flipped = to_radar_axes(file, {Axis::minus_i, Axis::minus_j});
  CHECK(flipped(1, 0) == 3.0f);
  CHECK(flipped(0, 0) == 6.0f);
  const Image<float> turned = to_radar_axes(file, {Axis::minus_j, Axis::minus_i});
  REQUIRE(turned.n_azimuth() == 3);
  REQUIRE(turned.n_range() == 2);
  CHECK(turned(0, 1) == 3.0f);
  CHECK(turned(2, 0) == 4.0f);
  const Image<float> transposed = to_radar_axes(file, {Axis::plus_j, Axis::plus_i});
  CHECK(transposed(2, 0) == 3.0f);
  CHECK_THROWS_AS(to_radar_axes(file, {Axis::plus_i, Axis::minus_i}), UsageError);
}

TEST_CASE("amplitudes are scaled, then squared") {
  const ScratchFolder folder;
  Dataset dataset = one_view(folder, counted());
  dataset.quantity = Quantity::amplitude;
  dataset.scale = 0.5;
  const auto images = load_images(folder.path(), dataset, kFirst);
  REQUIRE(images.size() == 1);
  CHECK(images[0].name == "a.tif");
  CHECK(images[0].power(1, 2) == 9.0f);
  CHECK(images[0].acquisition.slant_range_m == 1000.0);
}

TEST_CASE("images that cannot be learned from are refused by name") {
  const ScratchFolder folder;
  const auto message = [&](const Image<float>& image) -> std::string {
    const Dataset dataset = one_view(folder, image);
    try {
      load_images(folder.path(), dataset, kFirst);
    } catch (const InputError& e) {
      return e.what();
    }
    return "accepted";
  };
  Image<float> bad = counted();
  bad(0, 1) = -1.0f;
  CHECK(message(bad).find("a.tif: power cannot be negative") != std::string::npos);
  bad(0, 1) = std::numeric_limits<float>::quiet_NaN();
  CHECK(message(bad).find("a.tif") != std::string::npos);
  CHECK(message(counted(3, 2)).find("3 x 2 pixels") != std::string::npos);
}

// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/nerf/learned_field.h"

#include <filesystem>
#include <string>

#include "sarnerf/core/error.h"
#include "sarnerf/nerf/model_file.h"
#include "scratch_folder.h"
#include "small_grid.h"
#include "small_set.h"
#include "torch_catch.h"

using namespace sarnerf;

TEST_CASE("a field comes back from its file with every bit") {
  const ScratchFolder folder;
  const GridField field = small_grid(41);
  write_archive(folder / "model.pt", field.state());
  const Archive read = read_archive(folder / "model.pt");
  CHECK(same_bits(read, field.state()));
  const auto restored = restore_field(read, "model.pt");
  const Image<float> a = render_view(field, small_acquisition(1.0));
  const Image<float> b = render_view(*restored, small_acquisition(1.0));
  CHECK(std::equal(a.pixels().begin(), a.pixels().end(), b.pixels().begin()));
}

TEST_CASE("a model file keeps what is known of the images") {
  const ScratchFolder folder;
  ModelInfo info;
  info.program = "archive_test";
  info.reference_bin_m = 0.5;
  info.scene_box_m = {{-1.0, 0.0, -2.0}, {3.0, 4.0, 5.0}};
  info.aim_m = {10.0, 20.0, 30.0};
  info.quantity = Quantity::amplitude;
  info.calibration = Calibration::sigma0;
  info.scale = 2.5;
  info.peak_power = 7.0;
  info.acquisition.incidence_deg = 40.0;
  info.acquisition.slant_range_m = 5000.0;
  info.acquisition.n_azimuth = 8;
  info.acquisition.n_range = 16;
  info.acquisition.azimuth_spacing_m = info.acquisition.range_spacing_m = 0.5;
  info.acquisition.look = Look::left;
  DatasetView view = info.acquisition;
  view.azimuth_deg = 33.0;
  view.look = Look::right;
  view.image = "images/view_001.tif";
  info.training_views = {view};
  info.dataset = "views";
  info.dataset_sha256 = std::string(64, 'a');
  info.steps = 123;
  const GridField field = small_grid(43);
  write_model(folder / "model.pt", field, info);
  const Model read = read_model(folder / "model.pt");
  CHECK(same_bits(read.field->state(), field.state()));
  CHECK(read.ignored.empty());
  CHECK(read.info.program == info.program);
  CHECK(read.info.reference_bin_m == info.reference_bin_m);
  CHECK(read.info.scene_box_m.min == info.scene_box_m.min);
  CHECK(read.info.scene_box_m.max == info.scene_box_m.max);
  CHECK(read.info.aim_m == info.aim_m);
  CHECK(read.info.quantity == info.quantity);
  CHECK(read.info.calibration == info.calibration);
  CHECK(read.info.scale == info.scale);
  CHECK(read.info.peak_power == info.peak_power);
  CHECK(read.info.acquisition.incidence_deg == 40.0);
  CHECK(read.info.acquisition.n_range == 16);
  CHECK(read.info.acquisition.look == Look::left);
  REQUIRE(read.info.training_views.size() == 1);
  CHECK(read.info.training_views[0].azimuth_deg == 33.0);
  CHECK(read.info.training_views[0].look == Look::right);
  CHECK(read.info.training_views[0].image == view.image);
  CHECK(read.info.dataset == info.dataset);
  CHECK(read.info.dataset_sha256 == info.dataset_sha256);
  CHECK(read.info.steps == 123);
  // A checkpoint of training is no model.
  write_archive(folder / "checkpoint.pt", field.state());
  CHECK_THROWS_AS(read_model(folder / "checkpoint.pt"), CheckpointError);
}

TEST_CASE("damaged files are refused in one line") {
  const ScratchFolder folder;
  write_archive(folder / "model.pt", small_grid(42).state());
  const std::string whole = read_text(folder / "model.pt");
  for (const std::size_t length : {std::size_t{0}, std::size_t{1}, whole.size() / 3, whole.size() - 1}) {
    write_text(folder / "cut.pt", whole.substr(0, length));
    CHECK_THROWS_AS(read_archive(folder / "cut.pt"), CheckpointError);
  }
  write_text(folder / "text.pt", "not a model");
  CHECK_THROWS_AS(read_archive(folder / "text.pt"), CheckpointError);
  CHECK_THROWS_AS(read_archive(folder / "missing.pt"), CheckpointError);
}

TEST_CASE("no damage of eight bytes is read as another model") {
  const ScratchFolder folder;
  const Archive good = small_grid(44).state();
  write_archive(folder / "model.pt", good);
  const std::string whole = read_text(folder / "model.pt");
  std::size_t n_refused = 0, n_harmless = 0;
  for (std::size_t at = 0; at + 8 <= whole.size(); at += 61) {
    std::string bytes = whole;
    for (std::size_t n = 0; n < 8; ++n) bytes[at + n] = static_cast<char>(~bytes[at + n]);
    write_text(folder / "damaged.pt", bytes);
    try {
      const Archive read = read_archive(folder / "damaged.pt");
      CHECK(same_bits(read, good));  // the archive's padding holds nothing
      ++n_harmless;
    } catch (const CheckpointError&) {
      ++n_refused;
    }
  }
  CHECK(n_refused > 5 * n_harmless);
}

TEST_CASE("fields that do not fit together are refused") {
  const Archive good = small_grid(43).state();
  const auto refused = [](const Archive& archive) { CHECK_THROWS_AS(restore_field(archive, "m"), CheckpointError); };
  Archive bad = good;
  bad.tensors.erase("voxels");
  refused(bad);
  bad = good;
  bad.tensors["log_depth"] = bad.tensors["log_depth"].narrow(0, 0, 3);
  refused(bad);
  bad = good;
  bad.tensors["log_depth"] = bad.tensors["log_depth"] * NAN;
  refused(bad);
  bad = good;
  bad.tensors["voxels"] = bad.tensors["voxels"] + 1000000;
  refused(bad);
  bad = good;
  bad.tensors["bricks"] = torch::zeros_like(bad.tensors["bricks"]);
  refused(bad);
  bad = good;
  bad.json = R"({"field": {"kind": "hash-grid"}})";
  refused(bad);
  bad.json = "{";
  refused(bad);
}

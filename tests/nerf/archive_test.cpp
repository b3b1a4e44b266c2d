// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/nerf/learned_field.h"

#include <filesystem>
#include <string>

#include "sarnerf/core/error.h"
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

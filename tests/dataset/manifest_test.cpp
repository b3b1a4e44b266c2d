// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/dataset/manifest.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "catch.h"
#include "sarnerf/core/error.h"
#include "scratch_folder.h"

using namespace sarnerf;

namespace {

DatasetView view(const std::string& image, double azimuth_deg) {
  DatasetView v;
  v.image = image;
  v.azimuth_deg = azimuth_deg;
  v.incidence_deg = 35.1;
  v.slant_range_m = 4500.25;
  v.n_azimuth = 64;
  v.n_range = 96;
  v.azimuth_spacing_m = 0.3;
  v.range_spacing_m = 0.25;
  return v;
}

Dataset example() {
  Dataset d;
  d.quantity = Quantity::amplitude;
  d.calibration = Calibration::sigma0;
  d.scale = 4.0 / 65535.0;
  d.aim_m = {500000.1, 3.0, -4123456.7};
  d.views = {view("images/a.tif", 0.1), view("images/b.tif", 123.456)};
  d.views[1].look = Look::left;
  d.views[1].axes = {Axis::minus_j, Axis::plus_i};
  d.views[1].altitude_m = d.views[1].slant_range_m * std::cos(35.1 * 3.14159265358979 / 180.0);
  d.views[1].class_name = "T72";
  d.views[1].serial = "A64";
  d.views[1].source = "HB03787.016 \"quoted\"";
  d.scene_box_m = scene_box_of_swath(d.aim_m, d.views);
  d.resolution = Resolution{0.305, 0.4, window_from_text("taylor:-35")};
  d.splits = {{"train", {"images/a.tif"}}, {"test", {"images/b.tif"}}};
  d.provenance_json = R"({"program":"sar_render","a":1})";
  return d;
}

/// The example's text with one piece replaced.
std::string altered(const std::string& piece, const std::string& replacement) {
  std::string text = manifest_text(example());
  const auto at = text.find(piece);
  if (at == std::string::npos) throw std::runtime_error("the test looks for a missing " + piece);
  return text.replace(at, piece.size(), replacement);
}

std::string error_of(const std::string& text) {
  try {
    (void)parse_manifest(text, "dataset.json");
  } catch (const InputError& error) {
    return error.what();
  }
  return "accepted";
}

std::string error_of_folder(const std::filesystem::path& folder) {
  try {
    (void)read_manifest(folder);
  } catch (const InputError& error) {
    return error.what();
  }
  return "accepted";
}

}  // namespace

TEST_CASE("poses are exact if the manifest says so, and without the key if sar_render made the images") {
  const auto exact = [](bool said, const char* program, bool with_key) {
    Dataset d = example();
    d.exact_poses = said;
    d.provenance_json = std::string(R"({"program":")") + program + "\"}";
    std::string text = manifest_text(d);
    if (!with_key) {
      const std::size_t at = text.find("\"exact_poses\""), end = text.find('\n', at);
      REQUIRE(at != std::string::npos);
      text.erase(at, end + 1 - at);
    }
    return parse_manifest(text, "here").exact_poses;
  };
  for (const char* program : {"sar_render 0.1.0", "sar_import 0.1.0"})
    for (const bool said : {false, true}) CHECK(exact(said, program, true) == said);
  CHECK(exact(false, "sar_render 0.1.0", false));
  CHECK_FALSE(exact(true, "sar_import 0.1.0", false));
}

TEST_CASE("a manifest comes back as it was, and writes the same bytes again") {
  const Dataset d = example();
  const std::string text = manifest_text(d);
  const Dataset back = parse_manifest(text, "dataset.json");
  CHECK(manifest_text(back) == text);
  CHECK(back.quantity == d.quantity);
  CHECK(back.calibration == d.calibration);
  CHECK(back.scale == d.scale);
  CHECK(back.aim_m == d.aim_m);
  CHECK(back.scene_box_m.min == d.scene_box_m.min);
  CHECK(back.scene_box_m.max == d.scene_box_m.max);
  CHECK(back.splits == d.splits);
  CHECK(back.provenance_json == d.provenance_json);
  REQUIRE(back.views.size() == 2);
  CHECK(back.views[1].image == "images/b.tif");
  CHECK(back.views[1].azimuth_deg == 123.456);
  CHECK(back.views[1].incidence_deg == 35.1);
  CHECK(back.views[1].altitude_m == d.views[1].altitude_m);
  CHECK(back.views[1].axes == d.views[1].axes);
  CHECK(back.views[1].look == Look::left);
  CHECK(back.views[1].source == d.views[1].source);
  CHECK_FALSE(back.views[0].altitude_m);
  CHECK(back.resolution == d.resolution);

  const ScratchFolder folder;
  write_text(folder / "dataset.json", text);
  CHECK(manifest_text(read_manifest(folder.path())) == text);
  CHECK_THROWS_AS(read_manifest(folder / "absent"), InputError);
}

TEST_CASE("the scene box is what the swaths see, the largest over the views") {
  DatasetView v = view("a", 0.0);
  v.incidence_deg = 30.0;
  v.n_azimuth = 40;
  v.n_range = 30;
  v.azimuth_spacing_m = v.range_spacing_m = 0.5;
  DatasetView smaller = v;
  smaller.n_azimuth = 10;
  const std::vector<DatasetView> views{smaller, v};
  const glm::dvec3 aim(10.0, 2.0, -5.0);
  const Box box = scene_box_of_swath(aim, views);
  const double half = 0.5 * std::hypot(20.0, 15.0 / 0.5);
  CHECK(box.min.x == Approx(10.0 - half));
  CHECK(box.max.z == Approx(-5.0 + half));
  CHECK(box.min.y == 2.0);
  CHECK(box.max.y == Approx(2.0 + 7.5 / std::cos(3.14159265358979 / 6)));
  CHECK_THROWS_AS(scene_box_of_swath(aim, {}), UsageError);
}

TEST_CASE("one angle is enough, two must agree, none is refused") {
  const std::string both = "\"incidence_deg\":35.1,\"depression_deg\":54.9,";
  CHECK(parse_manifest(altered(both, "\"depression_deg\":17,"), "m").views[0].incidence_deg == 73.0);
  CHECK(parse_manifest(altered(both, "\"incidence_deg\":17,"), "m").views[0].incidence_deg == 17.0);
  CHECK(error_of(altered(both, "")).find("neither") != std::string::npos);
  const std::string error = error_of(altered(both, "\"incidence_deg\":17,\"depression_deg\":17,"));
  CHECK(error.find("dataset.json: views[0]: ") == 0);
  CHECK(error.find("contradict") != std::string::npos);
  // Both rounded to two decimals.
  CHECK(error_of(altered(both, "\"incidence_deg\":42.13,\"depression_deg\":47.88,")) == "accepted");
}

TEST_CASE("each mistake is named with its place") {
  const std::vector<std::pair<std::string, std::string>> mistakes[] = {
      {{"\"version\": 1", "\"version\": 2"}, {"", "reads version 1"}},
      {{"sarnerf-dataset", "other"}, {"", "expected format"}},
      {{"\"amplitude\"", "\"phase\""}, {"", "dataset.json: quantity: there is no quantity 'phase'"}},
      {{"\"scale\": ", "\"scale\": -"}, {"", "dataset.json: scale: expected a number above zero"}},
      {{"\"scale\"", "\"Scale\""}, {"", "the key \"scale\" is missing"}},
      {{"\"n_range\":96", "\"n_range\":96.5"}, {"", "views[0].n_range: expected a whole number"}},
      {{"\"n_range\":96", "\"n_range\":0"}, {"", "views[0].n_range: expected a whole number"}},
      {{"\"n_range\":96", "\"n_range\":1e99"}, {"", "views[0].n_range: expected a whole number"}},
      {{"\"n_range\":96", "\"n_range\":96,\"colour\":1"}, {"", "views[0]: the key \"colour\""}},
      {{"\"n_range\":96", "\"n_range\":96000"}, {"", "behind the radar"}},
      {{"\"azimuth_deg\":0.1", "\"azimuth_deg\":\"north\""}, {"", "found \"north\""}},
      {{"\"incidence_deg\":35.1,\"depression_deg\":54.9", "\"incidence_deg\":90"}, {"", "both excluded"}},
      {{"\"incidence_deg\":35.1,\"depression_deg\":54.9", "\"incidence_deg\":0"}, {"", "both excluded"}},
      {{"\"n_azimuth\":64", "\"n_azimuth\":64,\"altitude_m\":1000"}, {"", "altitude_m 1000 contradicts"}},
      {{"[\"+i\",\"+j\"]", "[\"+i\",\"-i\"]"}, {"", "views[0].axes: "}},
      {{"[\"+i\",\"+j\"]", "[\"i\",\"+j\"]"}, {"", "views[0].axes[0]: expected one of +i, -i, +j, -j"}},
      {{"\"look\":\"right\"", "\"look\":\"up\""}, {"", "views[0].look: "}},
      {{"\"images/a.tif\",\"az", "\"../a.tif\",\"az"}, {"", "inside the dataset"}},
      {{"\"images/a.tif\",\"az", "\"images/b.tif\",\"az"}, {"", "listed twice"}},
      {{"\"test\": [\n      \"images/b.tif\"", "\"test\": [\n      \"images/a.tif\""}, {"", "already in a split"}},
      {{"0.305,", "0.0,"}, {"", "impulse_response.resolution_m[0]: expected a number above zero"}},
      {{"0.305,", "0.305, 0.4,"}, {"", "impulse_response.resolution_m: expected two widths"}},
      {{"taylor:-35,4", "tailor"}, {"", "impulse_response.window: "}},
      {{"\"window\"", "\"windows\""}, {"", "impulse_response: the key \"window"}},
      {{"\"provenance\": {", "\"provenance\": [], \"x\": {"}, {"", "provenance: expected an object"}},
      {{"\"views\": [", "\"views\": [,"}, {"", "not valid JSON"}},
  };
  for (const auto& mistake : mistakes) {
    INFO(mistake[0].first << " -> " << mistake[0].second);
    const std::string error = error_of(altered(mistake[0].first, mistake[0].second));
    INFO(error);
    CHECK(error.find("dataset.json") == 0);
    CHECK(error.find(mistake[1].second) != std::string::npos);
    CHECK(error.find('\n') == std::string::npos);
  }
}

TEST_CASE("numbers beyond all doubles, and texts that would tear a message, are refused in one short line") {
  const std::string name = "images/a\\nb\\u0000.tif";
  const std::string cases[] = {
      altered("\"n_range\":96", "\"n_range\":1e999"),
      altered("\"images/a.tif\",\"az", "\"" + name + "\",\"az"),
      manifest_text(example()) + "x",
      altered("\"look\":\"right\"", "\"look\":\"a\\nb\""),
      altered("\"look\":\"right\"", "\"look\":\"" + std::string(100'000, 'x') + "\""),
      altered("\"look\":\"right\"", "\"look\":\"right\",\"\\u001b[2J\":1"),
      altered("\"look\":\"right\"", "\"look\":\"" + std::string(100'000, 'x')),
  };
  for (const std::string& text : cases) {
    const std::string error = error_of(text);
    INFO(error);
    CHECK(error.find("dataset.json: ") == 0);
    CHECK(error.size() < 1000);
    CHECK(std::none_of(error.begin(), error.end(), [](char c) { return static_cast<unsigned char>(c) < 0x20; }));
  }
}

TEST_CASE("no key stands twice in an object, and no object has thousands of them") {
  CHECK(error_of(altered("\"n_range\":96", "\"n_range\":96,\"n_range\":97")).find("'n_range' is given twice") !=
        std::string::npos);
  const auto provenance = [](int n_keys) {
    std::string keys;
    for (int n = 0; n < n_keys; ++n) keys += (n == 0 ? "\"" : ",\"") + std::to_string(n) + "\":0";
    return altered("\"provenance\": {", "\"provenance\": {\"more\":{" + keys + "},");
  };
  CHECK(error_of(provenance(4096)) == "accepted");
  CHECK(error_of(provenance(4097)).find("at most 4096 keys") != std::string::npos);
}

TEST_CASE("what would not be read is not written") {
  Dataset d = example();
  d.views[0].incidence_deg = 95.0;
  CHECK_THROWS_AS(manifest_text(d), UsageError);
  d = example();
  d.views.clear();
  CHECK_THROWS_AS(manifest_text(d), UsageError);
  d = example();
  d.provenance_json = "{";
  CHECK_THROWS_AS(manifest_text(d), UsageError);
  d = example();
  d.scale = std::nan("");
  CHECK_THROWS_AS(manifest_text(d), UsageError);
}

TEST_CASE("an unfinished dataset says how many views there will be") {
  Dataset d = example();
  CHECK_FALSE(d.unfinished());
  CHECK(unfinished_text(d).empty());
  CHECK(manifest_text(d).find("planned_views") == std::string::npos);
  d.n_planned_views = 576;
  const Dataset back = parse_manifest(manifest_text(d), "dataset.json");
  CHECK(back.unfinished());
  CHECK(back.n_planned_views == 576);
  CHECK(unfinished_text(back).find("2 of 576 views") == 0);
  d.n_planned_views = d.views.size();
  CHECK_FALSE(parse_manifest(manifest_text(d), "dataset.json").unfinished());
  CHECK(error_of(altered("\"splits\"", "\"planned_views\": 2, \"splits\"")).find("planned_views: expected more than the 2 views") !=
        std::string::npos);
  CHECK(error_of(altered("\"splits\"", "\"planned_views\": -3, \"splits\"")).find("planned_views") != std::string::npos);
}

TEST_CASE("a folder without a manifest: whether somebody began to make a dataset there") {
  const ScratchFolder folder;
  CHECK(error_of_folder(folder.path()).find("expected a dataset's folder") != std::string::npos);
  write_text(folder / "recipe.json", "{}");
  CHECK(error_of_folder(folder.path()).find("expected a dataset's folder") != std::string::npos);
  std::filesystem::create_directory(folder / "images");
  CHECK(error_of_folder(folder.path()).find("(0 images are there); repeat its command") != std::string::npos);
  write_text(folder / "images/view_000.tif", "");
  CHECK(error_of_folder(folder.path()).find("(1 image is there); repeat its command") != std::string::npos);
}

// SPDX-License-Identifier: Apache-2.0
#include <limits>
#include <nlohmann/json.hpp>
#include <span>

#include "../nerf/torch_catch.h"
#include "programs.h"
#include "sarnerf/core/files.h"
#include "sarnerf/dataset/image_file.h"
#include "sarnerf/nerf/learned_field.h"

using OrderedJson = nlohmann::ordered_json;

namespace {

void write_image(const SmallScene& scene, const std::string& name,
                 const sarnerf::Image<float>& image) {
  const auto bytes = sarnerf::encode_tiff(image);
  write_text(scene / name, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

void refused(const SmallScene& scene, const std::string& piece) {
  const Outcome outcome = scene.train({"data", "-o", "run", "--steps", "3"});
  INFO(outcome.err);
  CHECK(outcome.code == 3);
  CHECK(outcome.is_error(piece));
  CHECK_FALSE(std::filesystem::exists(scene / "run"));
}

}  // namespace

TEST_CASE("bad datasets are refused in one line that names the place") {
  const SmallScene scene(4);
  SECTION("missing image") {
    std::filesystem::remove(scene / "data/images/2.tif");
    refused(scene, "images/2.tif");
  }
  SECTION("image of another size") {
    write_image(scene, "data/images/1.tif", sarnerf::Image<float>(31, 32, 1.0f));
    refused(scene, "images/1.tif");
  }
  SECTION("a pixel that is no number") {
    sarnerf::Image<float> image(32, 32, 1.0f);
    image(3, 4) = std::numeric_limits<float>::quiet_NaN();
    write_image(scene, "data/images/3.tif", image);
    refused(scene, "images/3.tif");
  }
  SECTION("truncated image") {
    write_text(scene / "data/images/0.tif", read_text(scene / "data/images/0.tif").substr(0, 100));
    refused(scene, "images/0.tif");
  }
  SECTION("both angles missing") {
    scene.edit("data/dataset.json", "\"incidence_deg\":45.0,", "");
    scene.edit("data/dataset.json", "\"depression_deg\":45.0,", "");
    refused(scene, "views[0]");
  }
  SECTION("angles that contradict each other") {
    scene.edit("data/dataset.json", "\"depression_deg\":45.0", "\"depression_deg\":44.0");
    refused(scene, "views[0]");
  }
  SECTION("version from the future") {
    scene.edit("data/dataset.json", "\"version\": 1", "\"version\": 2");
    refused(scene, "version");
  }
  SECTION("no manifest") {
    std::filesystem::remove(scene / "data/dataset.json");
    refused(scene, "dataset.json");
  }
  SECTION("nothing but zeros") {
    for (int n = 0; n < 4; ++n)
      write_image(scene, "data/images/" + std::to_string(n) + ".tif",
                  sarnerf::Image<float>(32, 32));
    refused(scene, "nothing to learn");
  }
  SECTION("pixels that are all equal") {
    for (int n = 0; n < 4; ++n)
      write_image(scene, "data/images/" + std::to_string(n) + ".tif", sarnerf::Image<float>(32, 32, 0.5f));
    refused(scene, "are equal");
  }
  SECTION("a test set of another place") {
    scene.write_dataset("test", 5, 3.0);
    scene.edit("test/dataset.json", "\"aim_m\": [\n    0.0", "\"aim_m\": [\n    7.0");
    const Outcome outcome = scene.train({"data", "-o", "run", "--against", "test"});
    CHECK(outcome.code == 2);
    CHECK(outcome.is_error("aim point"));
  }
}

TEST_CASE("a scene box that no image shows is refused before anything is trained") {
  const SmallScene scene(12);
  const auto refused_without_model = [&] {
    const Outcome outcome = scene.train({"data", "-o", "run", "--steps", "3"});
    INFO(outcome.err);
    CHECK(outcome.code == 3);
    CHECK(outcome.is_error("nothing can be learned"));
    CHECK_FALSE(std::filesystem::exists(scene / "run/model.pt"));
  };
  const OrderedJson manifest = OrderedJson::parse(read_text(scene / "data/dataset.json"));
  OrderedJson changed = manifest;
  SECTION("beside the swath") {
    for (auto& corner : changed["scene_box_m"]) corner[0] = corner[0].get<double>() + 1000.0;
    write_text(scene / "data/dataset.json", changed.dump());
    refused_without_model();
  }
  SECTION("an aim point far away") {
    changed["aim_m"] = {1e9, 0.0, 0.0};
    write_text(scene / "data/dataset.json", changed.dump());
    refused_without_model();
  }
}

TEST_CASE("one damaged pixel changes neither the peak nor what is learned") {
  const SmallScene scene(12);
  scene.write_dataset("test", 4, 7.0);
  const auto db = [&](const std::string& run, bool warned) {
    const Outcome outcome = scene.train({"data", "-o", run, "--steps", "60", "--against", "test"});
    INFO(outcome.err);
    REQUIRE(outcome.code == 0);
    CHECK(has(outcome.err, "images/5.tif: pixel 3, 4") == warned);
    const nlohmann::json report = json_of(scene / run / "report.json");
    return report["evaluation"]["model"]["mean"]["psnr_power_db"].get<double>();
  };
  const double good_db = db("good", false);
  for (const float damage : {1e4f, 1e6f, 1e30f}) {
    sarnerf::Image<float> image = sarnerf::read_image(scene / "data/images/5.tif");
    image(3, 4) = damage;
    write_image(scene, "data/images/5.tif", image);
    const double damaged_db = db("run_" + std::to_string(damage), true);
    CHECK(damaged_db < good_db + 0.5);
    CHECK(damaged_db > good_db - 3.0);
  }
}

TEST_CASE("images of any scale are learned from alike") {
  const SmallScene scene(12);
  const auto db = [&](const std::string& run, float scale) {
    for (const char* set : {"data", "test"}) {
      scene.write_dataset(set, set == std::string("data") ? 12 : 4, set == std::string("data") ? 0.0 : 7.0);
      for (int n = 0; n < (set == std::string("data") ? 12 : 4); ++n) {
        const std::string name = std::string(set) + "/images/" + std::to_string(n) + ".tif";
        sarnerf::Image<float> image = sarnerf::read_image(scene / name);
        for (float& p : image.pixels()) p *= scale;
        write_image(scene, name, image);
      }
    }
    const Outcome outcome = scene.train({"data", "-o", run, "--steps", "60", "--against", "test"});
    INFO(outcome.err);
    REQUIRE(outcome.code == 0);
    const nlohmann::json report = json_of(scene / run / "report.json");
    return report["evaluation"]["model"]["mean"]["psnr_power_db"].get<double>();
  };
  const double usual_db = db("usual", 1.0f);
  CHECK(usual_db > 20.0);
  CHECK(db("large", 1e20f) == Approx(usual_db).margin(0.5));
  CHECK(db("small", 1e-20f) == Approx(usual_db).margin(0.5));
}

TEST_CASE("a field without matter is neither saved nor scored") {
  const SmallScene scene(3);
  scene.write_dataset("odd", 3, 0.0, 1);
  for (int n = 0; n < 3; ++n)
    write_image(scene, "odd/images/" + std::to_string(n) + ".tif", sarnerf::Image<float>(1, 1, 1.0f));
  const Outcome outcome = scene.train({"odd", "-o", "run", "--steps", "5", "--against", "data"});
  INFO(outcome.err);
  CHECK(outcome.code == 1);
  CHECK(outcome.is_error("nothing was learned"));
  CHECK_FALSE(std::filesystem::exists(scene / "run/model.pt"));
  CHECK_FALSE(std::filesystem::exists(scene / "run/report.json"));
}

TEST_CASE("odd datasets are learned from") {
  const SmallScene scene(4);
  SECTION("one view") {
    scene.write_dataset("odd", 1, 10.0);
    const Outcome outcome = scene.train({"odd", "-o", "run", "--steps", "5"});
    INFO(outcome.err);
    CHECK(outcome.code == 0);
    CHECK(has(outcome.err, "a single view"));
  }
  SECTION("one blank view among others") {
    write_image(scene, "data/images/2.tif", sarnerf::Image<float>(32, 32));
    CHECK(scene.train({"data", "-o", "run", "--steps", "5", "-q"}).code == 0);
  }
  SECTION("views of unequal sizes") {
    scene.edit("data/dataset.json", "\"n_azimuth\":32", "\"n_azimuth\":20");
    write_image(scene, "data/images/0.tif", sarnerf::Image<float>(20, 32, 0.1f));
    CHECK(scene.train({"data", "-o", "run", "--steps", "5", "-q"}).code == 0);
  }
  SECTION("views twice, with a warning") {
    scene.edit("data/dataset.json", "\"azimuth_deg\":90.0", "\"azimuth_deg\":360.0");
    const Outcome outcome = scene.train({"data", "-o", "run", "--steps", "5"});
    CHECK(outcome.code == 0);
    CHECK(has(outcome.err, "twice the weight"));
  }
  SECTION("amplitudes, with a note") {
    scene.edit("data/dataset.json", "\"quantity\": \"power\"", "\"quantity\": \"amplitude\"");
    const Outcome outcome = scene.train({"data", "-o", "run", "--steps", "5"});
    CHECK(outcome.code == 0);
    CHECK(has(outcome.err, "squared"));
  }
}

TEST_CASE("damaged runs are refused in one line") {
  const SmallScene scene(4);
  REQUIRE(scene.train({"data", "-o", "run", "--steps", "10", "-q"}).code == 0);
  const auto checkpoint = scene / "run/checkpoints/latest.pt";
  const std::string whole = read_text(checkpoint);
  SECTION("truncated checkpoint") {
    write_text(checkpoint, whole.substr(0, whole.size() / 2));
    const Outcome outcome = scene.train({"--resume", "run", "--steps", "20"});
    CHECK(outcome.code == 3);
    CHECK(outcome.is_error("truncated"));
  }
  SECTION("a model in the checkpoint's place") {
    std::filesystem::copy_file(scene / "run/model.pt", checkpoint,
                               std::filesystem::copy_options::overwrite_existing);
    const Outcome outcome = scene.train({"--resume", "run", "--steps", "20"});
    CHECK(outcome.code == 3);
    CHECK(outcome.is_error("not a checkpoint"));
  }
  SECTION("other images than before") {
    write_image(scene, "data/images/0.tif", sarnerf::Image<float>(32, 32, 0.5f));
    const Outcome outcome = scene.train({"--resume", "run", "--steps", "20"});
    CHECK(outcome.code == 2);
    CHECK(outcome.is_error("the dataset has changed"));
  }
  SECTION("another field") {
    const Outcome outcome = scene.train({"--resume", "run", "--field", "mlp"});
    CHECK(outcome.code != 0);
    CHECK(outcome.is_error("field"));
  }
  SECTION("models") {
    const std::string model = read_text(scene / "run/model.pt");
    const sarnerf::Archive archive = sarnerf::read_archive(scene / "run/model.pt");
    write_text(scene / "cut.pt", model.substr(0, model.size() - 1000));
    CHECK(scene.render({"cut.pt"}).code == 3);
    CHECK(scene.render({"cut.pt"}).is_error("truncated"));
    CHECK(scene.render({"run/checkpoints/latest.pt"}).is_error("checkpoint of a training"));
    CHECK(scene.render({"nowhere.pt"}).code == 3);
    CHECK(scene.render({"data/images/0.tif"}).code == 3);
    const auto replaced = [&](const std::string& piece, const std::string& instead) {
      sarnerf::Archive other = archive;
      const auto place = other.json.find(piece);
      REQUIRE(place != std::string::npos);
      other.json.replace(place, piece.size(), instead);
      sarnerf::write_archive(scene / "other.pt", other);  // with sums that are right
      return scene.render({"other.pt"});
    };
    CHECK(replaced("\"version\":1", "\"version\":9").is_error("version 9"));
    CHECK(replaced("\"kind\":\"grid\"", "\"kind\":\"grit\"").is_error("grit"));
  }
}

// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <csignal>
#include <nlohmann/json.hpp>

#include "../nerf/torch_catch.h"
#include "mirrored.h"
#include "output_lock.h"
#include "programs.h"
#include "sarnerf/core/metrics.h"
#include "sarnerf/core/text.h"
#include "sarnerf/dataset/image_file.h"
#include "sarnerf/nerf/learned_field.h"
#include "sarnerf/nerf/mlp_network.h"
#include "sarnerf/nerf/model_file.h"

using Json = nlohmann::json;

TEST_CASE("models that older revisions learned load and render as they did") {
  // Made with revision e07e418: sar_render data/cuboid.json --pitch 45 --azimuth 0:330:30 --size 40x40 --spacing 0.8, for
  // grid_over_ground with --ground grass --looks 4; sar_nerf_train --steps 120 --threads 1, for grid_over_ground with --option
  // residuals=0 (its kriging is gone), for mlp with --field mlp --steps 60 --option width=64 --option depth=3 --option skip=0;
  // sar_nerf_render --azimuth 17. With 9ab3f85: --size 24x24 --spacing 1.4; --field surface --steps 100 --option voxel_size_m=1.4 --option
  // albedo_bins=3; --field paper --steps 20 --option voxel_size_m=2 --option width=32 --option depth=3 --option skip=0.
  const ScratchFolder scratch;
  // A network's products are rounded as the processor's kernel has it, by about 1 % of the outputs' spread. So `paper` has two views:
  // that of the kernel `bf16`, from its revision, and that of `plain`, which f316b8c rendered when its `bf16` gave the first one.
  const bool plain = sarnerf::best_mlp_kernel({.depth = 3, .width = 32, .skip = 0}) == sarnerf::MlpKernel::plain;
  struct Case {
    const char* name;
    double tolerance;  ///< of the peak
    const char* view = "view.tif";
  };
  for (const Case& model : {Case{"models_e07e418/grid", 1e-5}, Case{"models_e07e418/grid_over_ground", 1e-5}, Case{"models_e07e418/mlp", 2e-2},
                            Case{"models_9ab3f85/surface", 1e-5}, Case{"models_9ab3f85/paper", 1e-3, plain ? "view_plain.tif" : "view.tif"}}) {
    INFO(model.name);
    const std::filesystem::path folder = std::filesystem::path(MODELS) / model.name;
    const Outcome view = run_program(SAR_NERF_RENDER, {folder.string(), "--azimuth", "17", "-o", model.name}, {scratch.path()});
    INFO(view.err);
    REQUIRE(view.code == 0);
    const auto then = sarnerf::read_image(folder / model.view), now = sarnerf::read_image(scratch / (std::string(model.name) + ".tif"));
    REQUIRE(now.n_azimuth() == then.n_azimuth());
    REQUIRE(now.n_range() == then.n_range());
    const double peak = double{*std::max_element(then.pixels().begin(), then.pixels().end())};
    REQUIRE(peak > 0.1);
    double largest = 0.0;
    for (std::size_t n = 0; n < then.pixels().size(); ++n)
      largest = std::max(largest, std::abs(double{now.pixels()[n]} - double{then.pixels()[n]}));
    CHECK(largest < model.tolerance * peak);
  }
}

TEST_CASE("residuals that an older version wrote are ignored with a warning") {
  const LearnedScene scene;
  REQUIRE(scene.render({"run", "--azimuth", "12.5", "-o", "now"}).code == 0);
  sarnerf::Archive old = sarnerf::read_archive(scene / "run/model.pt");
  old.tensors["amplitude_residuals"] = torch::ones({32 * 32}, torch::kHalf);
  std::filesystem::create_directory(scene / "old");
  sarnerf::write_archive(scene / "old/model.pt", old);
  const Outcome view = scene.render({"old", "--azimuth", "12.5", "-o", "then"});
  INFO(view.err);
  REQUIRE(view.code == 0);
  CHECK(has(view.err, "warning: old/model.pt: was written by an older version and holds residuals"));
  const auto now = sarnerf::read_image(scene / "now.tif"), then = sarnerf::read_image(scene / "then.tif");
  CHECK(std::equal(now.pixels().begin(), now.pixels().end(), then.pixels().begin(), then.pixels().end()));
}

TEST_CASE("views of a model come in files of sar_render's form") {
  const LearnedScene scene;
  const Outcome one = scene.render({"run", "--azimuth", "12.5", "-o", "view"});
  INFO(one.err);
  REQUIRE(one.code == 0);
  CHECK(one.out == "view.tif\nview.png\nview.json\n");
  const auto image = sarnerf::read_image(scene / "view.tif");

  const sarnerf::Model model = sarnerf::read_model(scene / "run/model.pt");
  sarnerf::DatasetView view = model.info.acquisition;
  view.azimuth_deg = 12.5;
  const auto expected = sarnerf::render_view(*model.field, acquisition_of(view, model.info.aim_m));
  CHECK(std::equal(image.pixels().begin(), image.pixels().end(), expected.pixels().begin(),
                   expected.pixels().end()));
  CHECK(has(scene.render({"run", "--azimuth", "12.5", "-o", "view"}).err, "already done"));
  CHECK(scene.render({"run", "--azimuth", "13", "-o", "view"}).is_error("azimuth_deg"));
  {
    const sarnerf::app::OutputLock other({scene / "view.tif"});
    CHECK(scene.render({"run", "--azimuth", "12.5", "-o", "view"}).is_error("is writing it"));
  }
  CHECK(scene.render({"run", "--azimuth", "13", "-o", "view", "--overwrite"}).code == 0);
  CHECK(scene.render({"run/model.pt", "--size", "20x40", "--spacing", "0.2,0.1", "-o", "small"})
            .code == 0);
  CHECK(sarnerf::read_image(scene / "small.tif").n_range() == 40);

  SECTION("a sweep is a dataset, whatever interrupts it") {
    const std::vector<std::string> sweep{"run",      "--pitch",    "40,45",    "--azimuth",
                                         "0:350:10", "--quantity", "amplitude"};
    auto whole = sweep, parts = sweep;
    whole.insert(whole.end(), {"-o", "whole"});
    parts.insert(parts.end(), {"-o", "parts/"});
    const Outcome made = scene.render(whole);
    INFO(made.err);
    REQUIRE(made.code == 0);
    const sarnerf::Dataset dataset = sarnerf::read_manifest(scene / "whole");
    CHECK(dataset.views.size() == 72);
    CHECK(dataset.quantity == sarnerf::Quantity::amplitude);
    const int code =
        scene
            .render(parts,
                    [&, sent = false](double) mutable {
                      if (sent || !std::filesystem::exists(scene / "parts/images/view_020.tif"))
                        return 0;
                      sent = true;
                      return SIGINT;
                    })
            .code;
    CHECK(code == 130);
    REQUIRE(scene.render(parts).code == 0);
    for (const char* file :
         {"dataset.json", "recipe.json", "SHA256SUMS", "images/view_071.tif", "png/view_003.png"})
      CHECK(read_text(scene / "parts" / file) == read_text(scene / "whole" / file));
    CHECK(has(scene.render(parts).err, "already done"));
  }
}

TEST_CASE("a damaged model is refused, and never rendered as another one") {
  const LearnedScene scene;
  REQUIRE(scene.render({"run", "--azimuth", "12.5", "-o", "whole"}).code == 0);
  const std::string model = read_text(scene / "run/model.pt");
  int n_refused = 0;
  for (std::size_t at = model.size() / 9; at + 8 < model.size(); at += model.size() / 9) {
    std::string damaged = model;
    for (std::size_t n = at; n < at + 8; ++n) damaged[n] = static_cast<char>(damaged[n] ^ 0x55);
    write_text(scene / "damaged.pt", damaged);
    const Outcome outcome = scene.render({"damaged.pt", "--azimuth", "12.5", "-o", "view", "--overwrite"});
    INFO(outcome.err);
    if (outcome.code == 0) {
      CHECK(read_text(scene / "view.tif") == read_text(scene / "whole.tif"));  // the archive's padding
    } else {
      ++n_refused;
      CHECK(outcome.code == 3);
      CHECK(outcome.is_error("damaged.pt: is not a model or checkpoint, or is truncated or damaged"));
    }
  }
  CHECK(n_refused >= 6);
}

TEST_CASE("views far from all that was trained on come with a warning") {
  const LearnedScene scene;
  const auto warning = [&](const std::vector<std::string>& view) {
    std::vector<std::string> arguments{"run", "-o", "view", "--overwrite"};
    arguments.insert(arguments.end(), view.begin(), view.end());
    const Outcome outcome = scene.render(arguments);
    INFO(outcome.err);
    REQUIRE(outcome.code == 0);
    const auto begin = outcome.err.find("far from all training views");
    return begin == std::string::npos ? "" : outcome.err.substr(begin, outcome.err.find('\n', begin) - begin);
  };
  CHECK(warning({"--azimuth", "15"}).empty());
  CHECK(warning({"--azimuth", "15", "--pitch", "50"}).empty());
  CHECK(has(warning({"--azimuth", "30", "--pitch", "15"}), "(incidence 15, azimuth 30 deg: 30 deg from the nearest)"));
  CHECK(has(warning({"--azimuth", "30", "--pitch", "80"}), "35 deg"));
  // A quarter of the azimuths: the other side was not seen.
  sarnerf::Archive archive = sarnerf::read_archive(scene / "run/model.pt");
  Json text = Json::parse(archive.json);
  auto& views = text["model"]["dataset"]["training_views"];
  views.erase(views.begin() + 3, views.end());
  archive.json = text.dump();
  sarnerf::write_archive(scene / "run/model.pt", archive);
  CHECK(warning({"--azimuth", "45"}).empty());
  CHECK_FALSE(warning({"--azimuth", "210"}).empty());
}

TEST_CASE("a dry run of views prints the plan and writes nothing") {
  const LearnedScene scene;
  const Outcome plan = scene.render({"run", "--azimuth", "0:350:10", "-o", "views", "--dry-run"});
  CHECK(plan.code == 0);
  CHECK(has(plan.out, "36 of 32 x 32 pixels"));
  CHECK_FALSE(std::filesystem::exists(scene / "views"));
  CHECK(scene.render({"run", "--azimuth", "3", "-o", "quiet", "-q"}).out == "quiet.tif\nquiet.png\nquiet.json\n");
  scene.write_dataset("test", 24, 0.0);
  const Outcome compared = scene.render({"run", "--against", "test/dataset.json", "-o", "scores", "-q"});
  INFO(compared.err);
  CHECK(compared.out == "scores/evaluation.json\n");
}

TEST_CASE("the views of a dataset are rendered as their angles give them") {
  const LearnedScene scene;
  scene.write_dataset("others", 3, 7.5, 24);
  const Outcome views = scene.render({"run", "--views", "others", "-o", "predicted"});
  INFO(views.err);
  REQUIRE(views.code == 0);
  const sarnerf::Dataset wanted = sarnerf::read_manifest(scene / "others"), made = sarnerf::read_manifest(scene / "predicted");
  REQUIRE(made.views.size() == 3);
  for (std::size_t n = 0; n < 3; ++n) {
    CHECK(made.views[n].azimuth_deg == wanted.views[n].azimuth_deg);
    CHECK(made.views[n].incidence_deg == wanted.views[n].incidence_deg);
    CHECK(made.views[n].n_range == 24);
  }
  REQUIRE(scene.render({"run", "--azimuth", "7.5", "--size", "24", "-o", "one"}).code == 0);
  const auto by_angle = sarnerf::read_image(scene / "one.tif"), by_dataset = sarnerf::read_image(scene / "predicted/images/view_000.tif");
  CHECK(std::equal(by_angle.pixels().begin(), by_angle.pixels().end(), by_dataset.pixels().begin(), by_dataset.pixels().end()));
  CHECK(has(scene.render({"run", "--views", "others", "-o", "predicted"}).err, "already done"));
  scene.write_dataset("more", 3, 8.5, 24);
  CHECK(scene.render({"run", "--views", "more", "-o", "predicted"}).code == 2);
  CHECK(scene.render({"run", "--views", "others", "--azimuth", "3"}).is_error("--views takes its views from the dataset; leave out --azimuth"));
  CHECK(scene.render({"run", "--views", "others", "--against", "data"}).is_error("leave out --views"));
  CHECK(scene.render({"run", "--views", "nowhere"}).code != 0);
}

TEST_CASE("a model is compared with the views that it has not seen") {
  const SmallScene scene;  // learned here: a model knows where its dataset was
  REQUIRE(scene.train({"data", "-o", "run", "--steps", "40", "-q"}).code == 0);
  scene.write_dataset("test", 24, 0.0);
  const Outcome compared = scene.render({"run", "--against", "test", "-o", "scores"});
  INFO(compared.err);
  REQUIRE(compared.code == 0);
  CHECK(has(compared.out, "12 views of test"));
  CHECK(has(compared.out, "| nearest view"));
  CHECK(has(compared.out, "no LPIPS: no weights"));
  const Json scores = json_of(scene / "scores/evaluation.json");
  CHECK(scores.at("views").size() == 12);
  CHECK(scores.at("model").at("views").size() == 12);
  CHECK(scores.contains("margin_db"));

  CHECK(scene.render({"run", "--against", "data"}).is_error("trained on all its views"));
  CHECK(scene.render({"run", "--against", "test", "--azimuth", "3"}).is_error("--azimuth"));
  CHECK(scene.render({"run", "--against", "test", "--training", "test"}).code == 3);

  std::filesystem::rename(scene / "data", scene / "elsewhere");
  const Outcome without = scene.render({"run", "--against", "test"});
  CHECK(without.code == 0);
  CHECK(has(without.err, "no baselines"));
  CHECK_FALSE(has(without.out, "nearest view"));
  CHECK(has(scene.render({"run", "--against", "test", "--training", "elsewhere"})
            .out, "nearest view"));
}

TEST_CASE("a model is compared with despeckled views, true neighbours beside it") {
  const LearnedScene scene;
  scene.write_dataset("test", 24, 0.0);
  // Unseen views are 30 degrees apart, odd ones 60.
  const std::vector<std::string> command{"run",         "--against", "test", "-o", "scores",
                                         "--despeckle", "60"};
  const Outcome compared = scene.render(command);
  INFO(compared.err);
  REQUIRE(compared.code == 0);
  CHECK(has(compared.out, "6 despeckled views"));
  CHECK(has(compared.out, "| true neighbours, blurred by 1"));
  const Json scores = json_of(scene / "scores/evaluation.json");
  CHECK(scores.at("views").size() == 12);
  CHECK_FALSE(scores.contains("bounds"));
  const Json& averaged = scores.at("despeckled");
  CHECK(averaged.at("views").size() == 6);
  CHECK(averaged.at("model").at("views").size() == 6);
  CHECK(averaged.at("bounds").size() == 2);
  CHECK(averaged.at("baselines").size() == scores.at("baselines").size());

  CHECK(scene.render({"run", "--against", "test", "-o", "scores"}).is_error("despeckle_deg"));
  CHECK(scene.render({"run", "--against", "test", "--despeckle", "3"}).is_error("--despeckle"));
  CHECK(scene.render({"run", "--despeckle", "3"}).is_error("--despeckle"));
  CHECK(scene.render({"run", "--against", "test", "--despeckle", "95"}).code == 2);
}

TEST_CASE("speckle on views has the looks and the seed that were asked for") {
  const LearnedScene scene;
  // Few of the scene's pixels are bright, so the looks are those of many views together: mean² over variance of the ratio to the mean.
  REQUIRE(scene.render({"run", "--azimuth", "0:350:10", "-o", "mean"}).code == 0);
  const auto views = [&](const std::string& folder, const std::string& looks, const std::string& seed) {
    const Outcome o = scene.render({"run", "--azimuth", "0:350:10", "--looks", looks, "--seed", seed, "-o", folder});
    INFO(o.err);
    REQUIRE(o.code == 0);
  };
  const auto pixels = [&](const std::string& folder) {
    std::vector<double> all;
    for (int n = 0; n < 36; ++n) {
      const auto image = sarnerf::read_image(scene / (folder + sarnerf::format("/images/view_%03d.tif", n)));
      all.insert(all.end(), image.pixels().begin(), image.pixels().end());
    }
    return all;
  };
  const std::vector<double> mean = pixels("mean");
  for (const double looks : {1.0, 4.0}) {
    const std::string folder = looks == 1.0 ? "one" : "four";
    views(folder, looks == 1.0 ? "1" : "4", "3");
    const std::vector<double> speckled = pixels(folder);
    double n = 0.0, sum = 0.0, squares = 0.0;
    for (std::size_t k = 0; k < mean.size(); ++k) {
      if (!(mean[k] > 0.0)) continue;
      const double ratio = speckled[k] / mean[k];
      n += 1.0, sum += ratio, squares += ratio * ratio;
    }
    REQUIRE(n > 1000.0);
    CHECK(sum / n == Approx(1.0).epsilon(0.1));
    CHECK(sum * sum / (n * squares - sum * sum) == Approx(looks).epsilon(0.15));
  }
  views("again", "1", "3");
  views("other", "1", "4");
  CHECK(pixels("again") == pixels("one"));
  CHECK(pixels("other") != pixels("one"));
  // These images are points on nothing: there is no clutter to take looks from.
  CHECK(scene.render({"run", "--azimuth", "3", "--looks", "training", "-o", "x"}).is_error("no clutter around the target"));
  CHECK(scene.render({"run", "--azimuth", "3", "--looks", "0.5"}).code == 2);
  CHECK(scene.render({"run", "--against", "data", "--looks", "1"}).code == 2);
}

TEST_CASE("options of rendering are checked") {
  const LearnedScene scene;
  CHECK(scene.render({"run", "--pitch", "45", "--depression", "40"}).code == 2);
  CHECK(scene.render({"run", "--pitch", "95"}).code == 2);
  CHECK(scene.render({"run", "--altitude", "100", "--slant-range", "200"}).code == 2);
  CHECK(scene.render({"run", "--slant-range", "1"}).code == 2);
  CHECK(scene.render({"run", "--lpips", "weights"}).code == 2);
  CHECK(scene.render({}).code == 2);
  CHECK(scene.render({"--help"}).code == 0);
}

TEST_CASE("range bins too narrow for memory are refused, and threads that cannot work are told of") {
  const LearnedScene scene;
  const Outcome narrow = scene.render({"run", "--spacing", "1e-30", "-o", "view"});
  CHECK(narrow.code == 2);
  CHECK(narrow.is_error("too narrow"));
  const Outcome many = scene.render({"run", "--threads", "100000", "-o", "view"});
  CHECK(many.code == 0);
  CHECK(has(many.err, "100000 threads cannot be used here"));
}

TEST_CASE("looking left, a model's view has its rows reversed") {
  const LearnedScene scene;
  for (const char* look : {"right", "left"}) REQUIRE(scene.render({"run", "--azimuth", "20", "--look", look, "-o", look}).code == 0);
  const auto right = sarnerf::read_image(scene / "right.tif"), left = sarnerf::read_image(scene / "left.tif");
  CHECK(sarnerf::relative_l2_error(left, rows_reversed(right)) < 0.1);  // each row has rays of its own
  CHECK(sarnerf::relative_l2_error(left, right) > 0.3);
}

// SPDX-License-Identifier: Apache-2.0
#include "programs.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "sarnerf/core/files.h"
#include "sarnerf/dataset/image_file.h"

nlohmann::json json_of(const std::filesystem::path& file) { return nlohmann::json::parse(sarnerf::read_whole_file(file)); }

namespace {

/// Points with a brightness each, as bilinear spots in the pixels that project() gives.
sarnerf::Image<float> image_of(const sarnerf::Acquisition& acquisition) {
  sarnerf::Image<float> image(acquisition.n_azimuth, acquisition.n_range);
  const sarnerf::RadarFrame frame = sarnerf::radar_frame(acquisition);
  for (int corner = 0; corner < 8; ++corner) {
    const glm::dvec3 p{corner & 1 ? 1.5 : -1.5, corner & 2 ? 2.0 : 0.3, corner & 4 ? 1.0 : -1.0};
    const sarnerf::RadarPoint seen = sarnerf::project(acquisition, frame, acquisition.aim_m + p);
    const double row =
        seen.along_track_m / acquisition.azimuth_spacing_m + 0.5 * (acquisition.n_azimuth - 1);
    const double bin =
        seen.range_offset_m / acquisition.range_spacing_m + 0.5 * (acquisition.n_range - 1);
    const int i = static_cast<int>(std::floor(row)), j = static_cast<int>(std::floor(bin));
    for (int n = 0; n < 4; ++n) {
      const int a = i + (n & 1), b = j + (n >> 1);
      if (a < 0 || b < 0 || a >= image.n_azimuth() || b >= image.n_range()) continue;
      image(a, b) += static_cast<float>((1.0 - std::abs(row - a)) * (1.0 - std::abs(bin - b)) *
                                        (1.0 + 0.1 * corner));
    }
  }
  return image;
}

}  // namespace

SmallScene::SmallScene(int n_views) { write_dataset("data", n_views, 0.0); }

void SmallScene::write_dataset(const std::string& name, int n_views, double first_azimuth_deg,
                               int n_pixels) const {
  sarnerf::Dataset dataset;
  for (int n = 0; n < n_views; ++n) {
    sarnerf::DatasetView view;
    view.image = "images/" + std::to_string(n) + ".tif";
    view.azimuth_deg = first_azimuth_deg + 360.0 * n / n_views;
    view.incidence_deg = 45.0;
    view.slant_range_m = 10000.0;
    view.n_azimuth = view.n_range = n_pixels;
    view.azimuth_spacing_m = view.range_spacing_m = 0.3;
    dataset.views.push_back(view);
    const auto path = *this / name / view.image;
    std::filesystem::create_directories(path.parent_path());
    sarnerf::AtomicFiles files(sarnerf::Durability::process);
    files.add(path, sarnerf::encode_tiff(image_of(acquisition_of(view, dataset.aim_m))));
    files.commit();
  }
  dataset.scene_box_m = sarnerf::scene_box_of_swath(dataset.aim_m, dataset.views);
  write_text(*this / name / "dataset.json", manifest_text(dataset));
}

void SmallScene::edit(const std::string& file, const std::string& piece,
                      const std::string& instead) const {
  std::string text = read_text(*this / file);
  const auto place = text.find(piece);
  if (place == std::string::npos) throw std::runtime_error(file + " does not hold " + piece);
  text.replace(place, piece.size(), instead);
  write_text(*this / file, text);
}

Outcome SmallScene::train(const std::vector<std::string>& arguments, const Signal& signal) const {
  std::vector<std::string> all = arguments;
  const auto given = [&](const char* option) {
    return std::ranges::any_of(arguments, [&](const std::string& a) { return a.starts_with(option); });
  };
  if (!given("--field") && !given("--resume") && !given("--config")) all.insert(all.end(), {"--field", "grid"});
  return run_program(SAR_NERF_TRAIN, all, {path(), signal});
}

Outcome SmallScene::render(const std::vector<std::string>& arguments, const Signal& signal) const {
  return run_program(SAR_NERF_RENDER, arguments, {path(), signal});
}

Outcome SmallScene::bench(const std::vector<std::string>& arguments) const {
  return run(SAR_NERF_BENCH, arguments);
}

Outcome SmallScene::run(const std::string& program,
                        const std::vector<std::string>& arguments) const {
  return run_program(program, arguments, {path()});
}

namespace {

struct LearnedOnce : SmallScene {
  LearnedOnce() {
    const Outcome learned = train({"data", "-o", "run", "--steps", "40", "-q"});
    if (learned.code != 0) throw std::runtime_error(learned.err);
  }
};

}  // namespace

LearnedScene::LearnedScene() : SmallScene(filled_once<LearnedOnce>().path()) {}

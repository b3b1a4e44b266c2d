// SPDX-License-Identifier: Apache-2.0
#include "example_report.h"

#include <cmath>

using namespace sarnerf;

namespace {

Image<float> blob(float gain) {
  Image<float> image(64, 48);
  for (int i = 0; i < 64; ++i) {
    for (int j = 0; j < 48; ++j) {
      const float distance2 = float((i - 30) * (i - 30) + (j - 20) * (j - 20));
      image(i, j) = gain * std::exp(-distance2 / 80.0f);
    }
  }
  return image;
}

ReportMethod method(const std::string& name, double psnr_db, std::size_t n_views) {
  ReportMethod m{
      name, {psnr_db, psnr_db - 9.0, psnr_db - 6.0, 1.0 - 0.1 * std::exp(-0.05 * psnr_db), {}}, {}};
  for (std::size_t v = 0; v < n_views; ++v) {
    const double off = 2.0 * std::sin(1.7 * double(v));
    m.per_view.push_back({psnr_db + off, psnr_db - 9.0 + off, psnr_db - 6.0 + off, 0.99, {}});
  }
  return m;
}

}  // namespace

TrainingReport example_report() {
  TrainingReport report;
  report.title = "Training report: cuboid, 36 views";
  report.summary = "A grid field learned from 36 images; scored on 24 views between them.";
  report.figures = {{"0.42 ms", "a novel view"}};
  report.trained = {{"dataset", "cuboid-36/"},
                    {"training views", "36, incidence 45°"},
                    {"field", "grid, 64 × 64 × 64, spherical harmonics of degree 2"}};
  report.warnings = {"image view_007.tif: 3 % of the pixels are saturated"};
  for (int v = 0; v < 24; ++v) {
    report.held_out.push_back({"test_" + std::to_string(v) + ".tif", 15.0 * v + 5.0, 45.0});
  }
  for (int v = 0; v < 36; ++v) report.training_azimuths_deg.push_back(10.0 * v);
  report.model = method("grid", 48.2, 24);
  report.baselines = {method("nearest view", 34.8, 24), method("linear between views", 36.5, 24),
                      method("rotate, then linear", 39.9, 24)};
  report.peak_power = 1.25;
  report.mask = "pixels above 1 % of the peak, grown by 2 pixels";
  report.lpips_missing = "no weights were given";
  ReportCurve curve{"grid", {}};
  for (int n = 0; n < 30; ++n) {
    const double seconds = 0.4 * std::pow(1.15, n);
    curve.points.push_back({seconds, 48.2 - 30.0 * std::exp(-seconds / 2.0)});
  }
  report.curves = {curve};
  report.curve_views = "the 8 validation views";
  report.levels = {{"linear between views", 36.5}, {"rotate, then linear", 39.9}};
  for (const std::size_t v : {std::size_t{3}, std::size_t{12}}) {
    report.pictures.push_back(
        {report.held_out[v], report.model->per_view[v], blob(1.0f), blob(1.01f), true});
  }
  report.stages = {{"start-up", 0.6}, {"reading", 0.2}, {"training", 11.4}, {"scoring", 0.9}};
  report.left_out = {{"κ⁺ ≠ κ⁻", "the data do not tell them apart"},
                     {"ground", "none in the scene"}};
  report.configuration = {{"steps", "2000"}, {"learning rate", "0.02"}, {"seed", "0"}};
  report.machine = {{"processor", "made up, 2 threads"}, {"sarnerf", "0.1.0"}};
  return report;
}

// SPDX-License-Identifier: Apache-2.0
#include "training_pictures.h"

#include <algorithm>
#include <cmath>

#include "number_text.h"
#include "sarnerf/core/error.h"
#include "sarnerf/dataset/display.h"
#include "signed_colours.h"
#include "training_scores.h"

namespace sarnerf {
namespace {

constexpr int kScaleSteps = 255;       // odd: zero has a step of its own
constexpr double kShownShare = 0.999;  ///< of the differences within their scale

std::string size_text(const Image<float>& image) {
  return std::to_string(image.n_azimuth()) + " × " + std::to_string(image.n_range());
}

void check(const ReportPictures& pictures) {
  const Image<float>&truth = pictures.truth, &prediction = pictures.prediction;
  if (truth.n_azimuth() == prediction.n_azimuth() && truth.n_range() == prediction.n_range())
    return;
  throw UsageError("report: view '" + pictures.view.name +
                   "': expected a prediction of the truth's size, " + size_text(truth) +
                   ", found " + size_text(prediction));
}

/// Scales shared by all pictures.
struct Scales {
  float white = 0.0f;          ///< power shown white
  double peak = 0.0;           ///< what differences are relative to
  double limit_percent = 1.0;  ///< the largest difference shown
  bool peak_of_training = true;
};

/// Prediction minus truth in percent of the peak.
Image<float> difference_percent(const ReportPictures& pictures, double peak) {
  Image<float> difference(pictures.truth.n_azimuth(), pictures.truth.n_range());
  for (std::size_t n = 0; n < difference.pixels().size(); ++n) {
    const double d = double(pictures.prediction.pixels()[n]) - double(pictures.truth.pixels()[n]);
    difference.pixels()[n] = static_cast<float>(100.0 * d / peak);
  }
  return difference;
}

/// The magnitude that `kShownShare` of the pixels do not exceed.
double usual_magnitude(const std::vector<ReportPictures>& all, double peak) {
  std::vector<float> magnitudes;
  for (const ReportPictures& pictures : all) {
    const Image<float> difference = difference_percent(pictures, peak);
    for (const float d : difference.pixels()) {
      if (std::isfinite(d)) magnitudes.push_back(std::abs(d));
    }
  }
  if (magnitudes.empty()) return 0.0;
  const auto nth = magnitudes.begin() + std::ptrdiff_t(kShownShare * double(magnitudes.size() - 1));
  std::ranges::nth_element(magnitudes, nth);
  return *nth;
}

Scales scales_of(const TrainingReport& report) {
  Scales scales;
  scales.peak = report.peak_power;
  float brightest = 0.0f;
  for (const ReportPictures& pictures : report.pictures) {
    scales.white = std::max(scales.white, white_level(pictures.truth));
    for (const float p : pictures.truth.pixels()) {
      if (std::isfinite(p)) brightest = std::max(brightest, p);
    }
  }
  if (!(scales.peak > 0.0)) {
    scales.peak = brightest > 0.0f ? brightest : 1.0;
    scales.peak_of_training = false;
  }
  scales.limit_percent = round_limit(usual_magnitude(report.pictures, scales.peak));
  return scales;
}

PageScale brightness_scale(const Scales& scales, double range_db) {
  PageScale scale;
  scale.name = "Truth and prediction: power (dB)";
  scale.strip = Image<Colour>(1, kScaleSteps);
  for (int n = 0; n < kScaleSteps; ++n) {
    const auto grey = static_cast<std::uint8_t>(std::lround(255.0 * n / (kScaleSteps - 1)));
    scale.strip(0, n) = {grey, grey, grey};
  }
  if (!(scales.white > 0.0f)) {
    scale.labels = {"nothing above zero"};
    return scale;
  }
  const double white_db = level_db(scales.white, Quantity::power);
  for (const double share : {1.0, 0.5, 0.0}) {
    scale.labels.push_back(decimal(white_db - share * range_db, 1));
  }
  scale.labels.front() = "≤ " + scale.labels.front();
  scale.labels.back() = "≥ " + scale.labels.back();
  return scale;
}

PageScale difference_scale(const Scales& scales) {
  PageScale scale;
  scale.name = "Difference: prediction − truth (% of the peak)";
  Image<float> values(1, kScaleSteps);
  for (int n = 0; n < kScaleSteps; ++n)
    values(0, n) = 2.0f * float(n) / float(kScaleSteps - 1) - 1.0f;
  scale.strip = signed_colours(values, 1.0f);
  const std::string limit = significant(scales.limit_percent, 3);
  scale.labels = {"≤ −" + limit, "0", "≥ +" + limit};
  return scale;
}

std::string place_of(const ReportView& view) {
  return "azimuth " + degrees(view.azimuth_deg) + ", incidence " + degrees(view.incidence_deg);
}

PagePictures view_pictures(const ReportPictures& pictures, const Scales& scales, double range_db) {
  const std::string place = place_of(pictures.view);
  DisplayRange range;
  range.range_db = range_db;
  const auto grey = [&](const Image<float>& power) {
    return display_levels(power, Quantity::power, scales.white, range);
  };
  const Image<float> difference = difference_percent(pictures, scales.peak);
  PagePictures block;
  block.pictures = {
      {grey(pictures.truth), "Truth", "Truth at " + place + ", power in decibels"},
      {grey(pictures.prediction), "Prediction", "Prediction at " + place + ", power in decibels"},
      {signed_colours(difference, static_cast<float>(scales.limit_percent)), "Difference",
       "Prediction minus truth at " + place}};
  block.caption = (pictures.held_out ? "Held-out view: " : "Training view: ") + place;
  const std::string scores = scores_in_words(pictures.scores);
  if (!scores.empty()) block.caption += " — " + scores;
  block.caption += '.';
  return block;
}

}  // namespace

double round_limit(double value) {
  if (!(value > 0.0 && std::isfinite(value))) return 1.0;
  const double decade = std::pow(10.0, std::floor(std::log10(value)));
  for (const double step : {1.0, 2.0, 5.0}) {
    if (value <= step * decade * (1.0 + 1e-6)) return step * decade;
  }
  return 10.0 * decade;
}

std::vector<PageBlock> picture_blocks(const TrainingReport& report) {
  if (report.pictures.empty()) return {};
  for (const ReportPictures& pictures : report.pictures) check(pictures);
  const Scales scales = scales_of(report);
  std::vector<PageBlock> blocks;
  blocks.push_back(PageParagraph{
      "Rows run along azimuth, columns along slant range with near range on the left. All pictures "
      "share these two "
      "scales. Decibels are those of the image's power; what is not above zero is black. "
      "Differences are linear in "
      "power, relative to " +
      std::string(scales.peak_of_training ? "the brightest pixel of the training images"
                                          : "the brightest pixel of the truths shown") +
      ": blue where the prediction is too dark, orange where it is too bright."});
  blocks.push_back(
      PageScales{{brightness_scale(scales, report.display_range_db), difference_scale(scales)}});
  for (const ReportPictures& pictures : report.pictures) {
    blocks.push_back(view_pictures(pictures, scales, report.display_range_db));
  }
  return blocks;
}

}  // namespace sarnerf

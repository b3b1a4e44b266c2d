// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "sarnerf/core/image.h"
#include "sarnerf/report/page.h"

namespace sarnerf {

/// How well images of views agree with the truth; what is open was not computed. A PSNR may be infinite (equal
/// images).
struct ReportScores {
  std::optional<double> psnr_power_db{};
  std::optional<double> psnr_amplitude_db{};
  std::optional<double> psnr_mask_db{};  ///< of power, over the dilated target
  std::optional<double> ssim{};
  std::optional<double> lpips{};
  // Of images with a background:
  std::optional<double> log_amplitude_error_db{};
  std::optional<double> psnr_log_amplitude_db{};
  std::optional<double> looks{};
  std::optional<double> target_iou{}, shadow_iou{};
  std::optional<double> scatterer_error_m{};
};

/// A view that was not trained on. Angles as in a dataset's file.
struct ReportView {
  std::string name;  ///< its image in the dataset
  double azimuth_deg = 0.0;
  double incidence_deg = 0.0;
};

/// One way to predict the held-out views, and its scores.
struct ReportMethod {
  std::string name;
  ReportScores mean;                     ///< mean of the views' values, decibels averaged as such
  std::vector<ReportScores> per_view{};  ///< one for each held-out view, or none
};

/// The same methods, and what bounds them, compared with another truth.
struct ReportComparison {
  std::string truth;                   ///< what it is, in a clause
  std::vector<ReportMethod> methods;   ///< the model first
};

struct CurvePoint {
  double seconds = 0.0;  ///< since the program's start
  double psnr_db = 0.0;
};

/// PSNR in power as training goes on.
struct ReportCurve {
  std::string name;
  std::vector<CurvePoint> points;
  bool emphasised = true;  ///< the run that the report is about
};

/// What needs no training: a horizontal line through the curves.
struct ReportLevel {
  std::string name;
  double psnr_db = 0.0;
};

/// A view to look at.
struct ReportPictures {
  ReportView view;
  ReportScores scores;
  Image<float> truth, prediction;  ///< linear power, of one size
  bool held_out = true;
};

/// Something that the run did without, and why.
struct ReportOmission {
  std::string what, why;
};

struct ReportStage {
  std::string name;
  double seconds = 0.0;
};

/// What a training run says about itself. All of it may be empty: a section without content is left out, and where
/// a reader would miss it the report says what is missing.
struct TrainingReport {
  std::string title = "Training report";
  std::string summary;  ///< one or two sentences below the title
  std::vector<PageFigure>
      figures{};  ///< at a glance, after those that follow from the scores and times
  std::vector<PageFact> trained{};  ///< dataset, number of views, field, what was held out …
  std::vector<std::string> warnings{};

  std::vector<ReportView> held_out{};
  std::vector<double> training_azimuths_deg{};  ///< marked in the plot over azimuth
  std::optional<ReportMethod> model{};
  std::vector<ReportMethod> baselines{};
  std::vector<ReportComparison> comparisons{};  ///< beside that with the held-out views themselves
  double peak_power = 0.0;    ///< of all PSNR: the largest pixel of the training images; 0: unknown
  std::string mask;           ///< how the target's mask was made, in a clause
  std::string lpips_missing;  ///< why there is no LPIPS

  std::vector<ReportCurve> curves{};
  std::vector<ReportLevel> levels{};  ///< the baselines on the curves' views
  std::string curve_views;            ///< which views the curves tell of, in a clause

  std::vector<ReportPictures> pictures{};  ///< a few: each takes some 20 kB at 128 × 128
  double display_range_db = 40.0;          ///< from white to black

  std::vector<ReportStage> stages{};  ///< where the time went
  std::vector<ReportOmission> left_out{};
  std::vector<PageFact> configuration{};
  std::vector<PageFact> machine{};  ///< processor, threads, libraries, revision
};

/// The report as a page: figures at a glance, what was trained, warnings, PSNR against time, scores beside those of
/// the baselines, scores over azimuth (and incidence where it varies) and view by view, pictures, times, what was
/// left out, configuration, machine.
///
/// Truth and prediction share one scale in decibels over all pictures, white at the 99.9th percentile of the
/// brightest truth; differences are linear in power and signed, prediction minus truth in percent of the peak,
/// again on one scale. What is infinite is told, not drawn.
///
/// Throws UsageError for pictures of unequal sizes, scores of a method that are not as many as the held-out views,
/// and what page_html() refuses.
Page training_report(const TrainingReport& report);

/// The same as HTML; see page_html().
std::string training_report_html(const TrainingReport& report);

}  // namespace sarnerf

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "sarnerf/core/image.h"
#include "sarnerf/report/page.h"

namespace sarnerf {

/// Scores of images of views against the truth. Empty scores were not computed. A PSNR may be infinite (equal
/// images).
struct ReportScores {
  std::optional<double> psnr_power_db{};
  std::optional<double> psnr_amplitude_db{};
  std::optional<double> psnr_mask_db{};  ///< PSNR of power over the dilated target
  std::optional<double> ssim{};
  std::optional<double> lpips{};
  // Only for images with a background:
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
  ReportScores mean;                     ///< mean over the views, decibels averaged as such
  std::vector<ReportScores> per_view{};  ///< one for each held-out view, or none
};

/// The same methods, and bounds on them, compared with another truth.
struct ReportComparison {
  std::string truth;                   ///< description of the truth, in a clause
  std::vector<ReportMethod> methods;   ///< the model first
};

struct CurvePoint {
  double seconds = 0.0;  ///< since the program's start
  double psnr_db = 0.0;
};

/// PSNR in power during training.
struct ReportCurve {
  std::string name;
  std::vector<CurvePoint> points;
  bool emphasised = true;  ///< the run that the report is about
};

/// PSNR of a method without training, drawn as a horizontal line.
struct ReportLevel {
  std::string name;
  double psnr_db = 0.0;
};

/// A view that the report shows in pictures.
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

/// The results of a training run. Any part may be empty: a section without content is left out. Where a reader would
/// expect it, the report states what is missing.
struct TrainingReport {
  std::string title = "Training report";
  std::string summary;  ///< one or two sentences below the title
  std::vector<PageFigure>
      figures{};  ///< key figures, after those derived from scores and times
  std::vector<PageFact> trained{};  ///< dataset, number of views, field, what was held out …
  std::vector<std::string> warnings{};

  std::vector<ReportView> held_out{};
  std::vector<double> training_azimuths_deg{};  ///< marked in the plot over azimuth
  std::optional<ReportMethod> model{};
  std::vector<ReportMethod> baselines{};
  std::vector<ReportComparison> comparisons{};  ///< beside the comparison with the held-out views themselves
  double peak_power = 0.0;    ///< reference of all PSNR: the largest pixel of the training images; 0: unknown
  std::string mask;           ///< definition of the target's mask, in a clause
  std::string lpips_missing;  ///< reason for missing LPIPS

  std::vector<ReportCurve> curves{};
  std::vector<ReportLevel> levels{};  ///< the baselines on the curves' views
  std::string curve_views;            ///< the views that the curves are computed on, in a clause

  std::vector<ReportPictures> pictures{};  ///< a few: each takes some 20 kB at 128 × 128
  double display_range_db = 40.0;          ///< from white to black

  std::vector<ReportStage> stages{};  ///< wall-clock times
  std::vector<ReportOmission> left_out{};
  std::vector<PageFact> configuration{};
  std::vector<PageFact> machine{};  ///< processor, threads, libraries, revision
};

/// The report as a page, in this order: key figures, warnings, what was trained, scores beside those of the baselines,
/// PSNR against time, scores over azimuth (and incidence where it varies) and view by view, pictures, times, omissions,
/// configuration, machine.
///
/// Truth and prediction share one scale in decibels over all pictures, white at the 99.9th percentile of the
/// brightest truth. Differences are linear in power and signed, prediction minus truth in percent of the peak, also on
/// one scale. Infinite PSNR is reported in text, not drawn.
///
/// Throws UsageError for pictures of unequal sizes, a method whose number of scores is not that of the held-out views,
/// and content that page_html() refuses.
Page training_report(const TrainingReport& report);

/// The same as HTML; see page_html().
std::string training_report_html(const TrainingReport& report);

}  // namespace sarnerf

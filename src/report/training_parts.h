// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "sarnerf/core/image.h"
#include "sarnerf/dataset/image_file.h"
#include "sarnerf/report/page.h"
#include "sarnerf/report/training_report.h"

namespace sarnerf {

/// A number with `digits` after the point: "−3.20", "∞"; "–" for NaN.
std::string decimal(double value, int digits);

/// The same for a value that may be missing; "–" if it is.
std::string decimal(const std::optional<double>& value, int digits);

/// An angle in degrees with up to two digits, no trailing zeros: "12.5°", "45°".
std::string degrees(double angle_deg);

/// Like decimal(), with a sign before positive numbers too: "+5.61".
std::string signed_decimal(double value, int digits);

/// A number with `digits` significant digits, without trailing zeros: "0.05", "12".
std::string significant(double value, int digits);

/// A duration in readable units: "0.83 s", "12.4 s", "3 min 20 s", "1 h 05 min".
std::string duration(double seconds);

/// "1 view", "24 views".
std::string count(std::size_t number, const std::string& thing);

/// Maps signed values to colours: light grey at zero, through sky blue to dark blue at −limit, through orange to dark
/// brown at +limit, clamped beyond. Both sides are equally dark at equal magnitude, and colour-blind readers can
/// distinguish them. Values that are not finite become black; if the limit is not positive, all finite ones become grey.
Image<Colour> signed_colours(const Image<float>& values, float limit);

/// The colour scales with an explanation, and truth, prediction and difference of each shown view. Empty without views.
/// Throws UsageError where a view's images differ in size.
std::vector<PageBlock> picture_blocks(const TrainingReport& report);

/// PSNR against seconds, with the baselines as horizontal lines. Empty when there is no finite point.
std::optional<PagePlot> curve_plot(const TrainingReport& report);

/// PSNR in power of the held-out views over their azimuth or incidence: the mean of the views at each angle, for the
/// model with a bar from lowest to highest. Empty when all views have the same angle or none has a finite score.
std::optional<PagePlot> azimuth_plot(const TrainingReport& report);
std::optional<PagePlot> incidence_plot(const TrainingReport& report);

/// The baseline with the highest mean PSNR in power, and the model's PSNR minus that of this baseline.
struct Margin {
  const ReportMethod* best = nullptr;
  double over_db = 0.0;
};

/// Empty without a model, a baseline or their PSNR in power.
std::optional<Margin> margin_over_baselines(const TrainingReport& report);

/// "PSNR 48.21 dB in power, 39.40 dB in amplitude, SSIM 0.998"; empty without scores.
std::string scores_in_words(const ReportScores& scores);

/// Table of the means of a comparison with another truth.
PageTable comparison_table(const ReportComparison& comparison);

/// The methods' means, one row each, the model first.
PageTable score_table(const TrainingReport& report);

/// The model's scores of every held-out view beside the best baseline's PSNR; a folded table.
PageTable view_table(const TrainingReport& report);

}  // namespace sarnerf

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

/// A number with `digits` after the point: "−3.20", "∞"; "–" for what is no number.
std::string decimal(double value, int digits);

/// The same of what may not have been computed: "–" then.
std::string decimal(const std::optional<double>& value, int digits);

/// An angle in degrees with up to two digits, no trailing zeros: "12.5°", "45°".
std::string degrees(double angle_deg);

/// With the sign in front also of what is positive: "+5.61".
std::string signed_decimal(double value, int digits);

/// A number to `digits` significant ones, without trailing zeros: "0.05", "12".
std::string significant(double value, int digits);

/// A time that people grasp: "0.83 s", "12.4 s", "3 min 20 s", "1 h 05 min".
std::string duration(double seconds);

/// "1 view", "24 views".
std::string count(std::size_t number, const std::string& thing);

/// Values as colours by sign: light grey at zero, over sky blue to dark blue at −limit, over orange to dark brown
/// at +limit, both sides equally dark at equal magnitude and told apart by the colour-blind, too. Clamped beyond.
/// What is not finite is black; a limit that is not positive makes everything finite grey.
Image<Colour> signed_colours(const Image<float>& values, float limit);

/// The scales, what they mean, and truth, prediction and difference of each shown view. Nothing without views.
/// Throws UsageError where a view's images differ in size.
std::vector<PageBlock> picture_blocks(const TrainingReport& report);

/// PSNR against seconds, the baselines as horizontal lines. Nothing when there is no finite point.
std::optional<PagePlot> curve_plot(const TrainingReport& report);

/// PSNR in power of the held-out views over their azimuth or incidence: the mean of the views there, for the model
/// with a bar from the lowest to the highest. Nothing when the views share one angle or have no finite score.
std::optional<PagePlot> azimuth_plot(const TrainingReport& report);
std::optional<PagePlot> incidence_plot(const TrainingReport& report);

/// The baseline of the highest mean PSNR in power, and by how much the model is above it.
struct Margin {
  const ReportMethod* best = nullptr;
  double over_db = 0.0;
};

/// Nothing without a model, a baseline or their PSNR in power.
std::optional<Margin> margin_over_baselines(const TrainingReport& report);

/// "PSNR 48.21 dB in power, 39.40 dB in amplitude, SSIM 0.998"; empty without scores.
std::string scores_in_words(const ReportScores& scores);

/// The means of a comparison with another truth.
PageTable comparison_table(const ReportComparison& comparison);

/// The methods' means, one row each, the model first.
PageTable score_table(const TrainingReport& report);

/// The model's scores of every held-out view beside the best baseline's PSNR, folded.
PageTable view_table(const TrainingReport& report);

}  // namespace sarnerf

// SPDX-License-Identifier: Apache-2.0
#include "training_scores.h"

#include <algorithm>
#include <array>

#include "number_text.h"

namespace sarnerf {
namespace {

/// A score and how tables and captions show it.
struct Column {
  std::optional<double> ReportScores::*score;
  const char* heading;
  int digits;
};

constexpr std::array<Column, 11> kColumns{
    {{&ReportScores::psnr_power_db, "PSNR, power (dB)", 2},
     {&ReportScores::psnr_amplitude_db, "PSNR, amplitude (dB)", 2},
     {&ReportScores::psnr_mask_db, "PSNR, target only (dB)", 2},
     {&ReportScores::ssim, "SSIM", 4},
     {&ReportScores::lpips, "LPIPS", 4},
     {&ReportScores::log_amplitude_error_db, "log-amplitude error (dB)", 2},
     {&ReportScores::psnr_log_amplitude_db, "PSNR, log amplitude (dB)", 2},
     {&ReportScores::looks, "looks", 1},
     {&ReportScores::target_iou, "IoU, target", 3},
     {&ReportScores::shadow_iou, "IoU, shadow", 3},
     {&ReportScores::scatterer_error_m, "scatterers off by (m)", 2}}};

/// The columns of which at least one of the scores has a value.
std::vector<Column> columns_with_values(const std::vector<const ReportScores*>& all) {
  std::vector<Column> columns;
  for (const Column& column : kColumns) {
    const auto has = [&](const ReportScores* scores) {
      return (scores->*column.score).has_value();
    };
    if (std::ranges::any_of(all, has)) columns.push_back(column);
  }
  return columns;
}

std::vector<Column> means_columns(const std::vector<const ReportMethod*>& methods) {
  std::vector<const ReportScores*> means;
  for (const ReportMethod* method : methods) means.push_back(&method->mean);
  return columns_with_values(means);
}

PageTable table_of_means(const std::vector<const ReportMethod*>& methods,
                         const std::vector<Column>& columns) {
  PageTable table;
  table.columns = {{"method"}};
  for (const Column& column : columns) table.columns.push_back({column.heading, Align::right});
  for (const ReportMethod* method : methods) {
    std::vector<std::string>& row = table.rows.emplace_back();
    row.push_back(method->name);
    for (const Column& column : columns)
      row.push_back(decimal(method->mean.*column.score, column.digits));
  }
  return table;
}

std::string caption(const TrainingReport& report, bool has_lpips, bool has_mask) {
  std::string text =
      "Means of " + count(report.held_out.size(), "held-out view") + ", decibels averaged as such";
  if (report.held_out.empty()) text = "Means of the held-out views, decibels averaged as such";
  if (report.peak_power > 0.0) {
    text += "; peak " + significant(report.peak_power, 4) +
            " in power, the brightest pixel of the training images";
  }
  text += '.';
  if (has_mask && !report.mask.empty()) text += " Target: " + report.mask + '.';
  if (!has_lpips) {
    text += report.lpips_missing.empty() ? " LPIPS was not computed."
                                         : " LPIPS was not computed: " + report.lpips_missing + '.';
  } else {
    text += " LPIPS: less is better.";
  }
  return text;
}

}  // namespace

std::optional<Margin> margin_over_baselines(const TrainingReport& report) {
  if (!report.model || !report.model->mean.psnr_power_db) return {};
  Margin margin;
  for (const ReportMethod& baseline : report.baselines) {
    if (!baseline.mean.psnr_power_db) continue;
    if (margin.best != nullptr && *baseline.mean.psnr_power_db <= *margin.best->mean.psnr_power_db)
      continue;
    margin.best = &baseline;
  }
  if (margin.best == nullptr) return {};
  const double ours = *report.model->mean.psnr_power_db, theirs = *margin.best->mean.psnr_power_db;
  margin.over_db = ours == theirs ? 0.0 : ours - theirs;  // both may be infinite
  return margin;
}

std::string scores_in_words(const ReportScores& scores) {
  std::string text;
  const auto add = [&](const std::optional<double>& value, const std::string& before, int digits,
                       const std::string& after) {
    if (!value) return;
    text += (text.empty() ? "" : ", ") + before + decimal(*value, digits) + after;
  };
  add(scores.psnr_power_db, "PSNR ", 2, " dB in power");
  add(scores.psnr_amplitude_db, scores.psnr_power_db ? "" : "PSNR ", 2, " dB in amplitude");
  add(scores.ssim, "SSIM ", 4, "");
  add(scores.lpips, "LPIPS ", 4, "");
  return text;
}

PageTable comparison_table(const ReportComparison& comparison) {
  std::vector<const ReportMethod*> methods;
  for (const ReportMethod& method : comparison.methods) methods.push_back(&method);
  PageTable table = table_of_means(methods, means_columns(methods));
  table.caption = "Means over " + comparison.truth + ".";
  return table;
}

PageTable score_table(const TrainingReport& report) {
  std::vector<const ReportMethod*> methods;
  if (report.model) methods.push_back(&*report.model);
  for (const ReportMethod& baseline : report.baselines) methods.push_back(&baseline);
  const std::vector<Column> columns = means_columns(methods);

  PageTable table = table_of_means(methods, columns);
  const auto shows = [&](auto score) {
    return std::ranges::find(columns, score, &Column::score) != columns.end();
  };
  table.caption = caption(report, shows(&ReportScores::lpips), shows(&ReportScores::psnr_mask_db));
  if (report.model) table.emphasised = {0};
  return table;
}

PageTable view_table(const TrainingReport& report) {
  std::vector<const ReportScores*> scores;
  for (const ReportScores& view : report.model->per_view) scores.push_back(&view);
  const std::vector<Column> columns = columns_with_values(scores);
  const std::optional<Margin> margin = margin_over_baselines(report);
  const bool compared = margin && !margin->best->per_view.empty();

  PageTable table;
  table.caption = "All " + count(report.held_out.size(), "held-out view");
  table.folded = true;
  table.columns = {{"view"}, {"azimuth (°)", Align::right}, {"incidence (°)", Align::right}};
  for (const Column& column : columns) table.columns.push_back({column.heading, Align::right});
  if (compared) table.columns.push_back({margin->best->name + ": PSNR, power (dB)", Align::right});
  for (std::size_t v = 0; v < report.held_out.size(); ++v) {
    const ReportView& view = report.held_out[v];
    std::vector<std::string>& row = table.rows.emplace_back();
    row = {view.name, decimal(view.azimuth_deg, 2), decimal(view.incidence_deg, 2)};
    for (const Column& column : columns)
      row.push_back(decimal(scores[v]->*column.score, column.digits));
    if (compared) row.push_back(decimal(margin->best->per_view[v].psnr_power_db, 2));
  }
  return table;
}

}  // namespace sarnerf

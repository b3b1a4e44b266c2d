// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/report/training_report.h"

#include <algorithm>
#include <array>
#include <utility>

#include "sarnerf/core/error.h"
#include "training_parts.h"

namespace sarnerf {

namespace {

void check(const TrainingReport& report, const ReportMethod& method) {
  if (method.per_view.empty() || method.per_view.size() == report.held_out.size()) return;
  throw UsageError("report: '" + method.name + "': expected scores of " +
                   count(report.held_out.size(), "held-out view") + ", found " +
                   std::to_string(method.per_view.size()));
}

double total_seconds(const TrainingReport& report) {
  double seconds = 0.0;
  for (const ReportStage& stage : report.stages) seconds += stage.seconds;
  return seconds;
}

/// Appends sections to a page.
class Sections {
 public:
  Sections(const TrainingReport& report, Page& page) : report_(report), page_(page) {}

  void at_a_glance() {
    PageFigures block;
    const std::size_t n = report_.held_out.size();
    if (report_.model && report_.model->mean.psnr_power_db) {
      block.figures.push_back(
          {decimal(report_.model->mean.psnr_power_db, 1) + " dB",
           "PSNR in power, mean of " + (n > 0 ? count(n, "held-out view") : "the held-out views")});
    }
    if (const auto margin = margin_over_baselines(report_)) {
      block.figures.push_back({signed_decimal(margin->over_db, 1) + " dB",
                               "against the best baseline (" + margin->best->name + ")"});
    }
    if (report_.model && report_.model->mean.ssim) {
      block.figures.push_back({decimal(report_.model->mean.ssim, 4), "SSIM"});
    }
    if (!report_.stages.empty()) {
      block.figures.push_back({duration(total_seconds(report_)), "from start to end"});
    }
    block.figures.insert(block.figures.end(), report_.figures.begin(), report_.figures.end());
    if (!block.figures.empty()) add(block);
  }

  void warnings() {
    for (const std::string& warning : report_.warnings) {
      add(PageNotice{warning, PageNotice::Kind::warning});
    }
    const auto margin = margin_over_baselines(report_);
    if (margin && !(margin->over_db > 0.0)) {
      add(PageNotice{
          "the model is no better than “" + margin->best->name +
              "”: on these views it has learned nothing that interpolation between the training "
              "images does not know.",
          PageNotice::Kind::warning});
    }
  }

  void trained() { facts("What was trained", report_.trained); }

  void accuracy() {
    const auto plot = curve_plot(report_);
    const bool scored = report_.model || !report_.baselines.empty();
    add(PageHeading{"Accuracy on held-out views"});
    if (scored) {
      add(score_table(report_));
      if (!report_.model) note("The model was not scored.");
      if (report_.baselines.empty()) {
        note(
            "No baselines were scored: whether the model is better than interpolation between the "
            "training "
            "images is not known.");
      }
    } else if (!report_.held_out.empty()) {
      note("The " + count(report_.held_out.size(), "held-out view") + " were not scored.");
    } else {
      note(
          "No views were held out, so this report cannot say how good the model is on views that "
          "it has not seen.");
    }
    for (const ReportComparison& comparison : report_.comparisons)
      add(comparison_table(comparison));
    if (plot) add(*plot);
  }

  void view_by_view() {
    if (!report_.model || report_.model->per_view.empty()) return;
    add(PageHeading{"View by view"});
    if (auto plot = azimuth_plot(report_)) add(*plot);
    if (auto plot = incidence_plot(report_)) add(*plot);
    add(view_table(report_));
  }

  void pictures() {
    std::vector<PageBlock> blocks = picture_blocks(report_);
    if (blocks.empty()) return;
    add(PageHeading{"Truth, prediction, difference"});
    for (PageBlock& block : blocks) add(std::move(block));
  }

  void times() {
    if (report_.stages.empty()) return;
    add(PageHeading{"Where the time went"});
    const double total = total_seconds(report_);
    PageTable table;
    table.caption = "Wall-clock time by stage.";
    table.columns = {{"stage"}, {"time", Align::right}, {"share", Align::right}};
    for (const ReportStage& stage : report_.stages) {
      const std::string share =
          total > 0.0 ? decimal(100.0 * stage.seconds / total, 1) + " %" : "–";
      table.rows.push_back({stage.name, duration(stage.seconds), share});
    }
    table.emphasised = {table.rows.size()};
    table.rows.push_back({"total", duration(total), ""});
    add(table);
  }

  void left_out() {
    if (report_.left_out.empty()) return;
    add(PageHeading{"What was left out"});
    PageFacts block;
    for (const ReportOmission& omission : report_.left_out) {
      block.facts.push_back({omission.what, omission.why});
    }
    add(block);
  }

  void configuration() { facts("Configuration", report_.configuration); }
  void machine() { facts("Machine and version", report_.machine); }

 private:
  void add(PageBlock block) { page_.blocks.push_back(std::move(block)); }
  void note(const std::string& text) { add(PageNotice{text, PageNotice::Kind::note}); }
  void facts(const std::string& heading, const std::vector<PageFact>& facts) {
    if (facts.empty()) return;
    add(PageHeading{heading});
    add(PageFacts{"", facts});
  }

  const TrainingReport& report_;
  Page& page_;
};

}  // namespace

Page training_report(const TrainingReport& report) {
  if (report.model) check(report, *report.model);
  for (const ReportMethod& baseline : report.baselines) check(report, baseline);
  Page page;
  page.title = report.title;
  page.subtitle = report.summary;
  Sections sections(report, page);
  sections.at_a_glance();
  sections.warnings();
  sections.trained();
  sections.accuracy();
  sections.view_by_view();
  sections.pictures();
  sections.times();
  sections.left_out();
  sections.configuration();
  sections.machine();
  return page;
}

std::string training_report_html(const TrainingReport& report) {
  return page_html(training_report(report));
}

namespace {

/// A score, with its heading and its number of digits in tables.
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
     {&ReportScores::scatterer_error_m, "scatterer position error (m)", 2}}};

/// The columns for which at least one element of `all` has a value.
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

// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/report/training_report.h"

#include <utility>

#include "number_text.h"
#include "sarnerf/core/error.h"
#include "training_pictures.h"
#include "training_plots.h"
#include "training_scores.h"

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

}  // namespace sarnerf

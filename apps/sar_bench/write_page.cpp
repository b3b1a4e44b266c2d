// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <optional>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "app_main.h"
#include "values.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/files.h"
#include "sarnerf/core/text.h"
#include "sarnerf/dataset/image_file.h"
#include "sarnerf/report/page.h"
#include "sarnerf/report/plot.h"
#include "studies.h"

namespace sarnerf::bench {

namespace {

namespace fs = std::filesystem;

/// Held-out PSNR of one run: (seconds or steps, dB), ascending.
using Curve = std::vector<std::pair<double, double>>;

Curve read_curve(const fs::path& run, const std::string& against) {
  const fs::path file = run / "metrics.jsonl";
  std::istringstream lines(read_whole_file(file));
  Curve curve;
  std::size_t number = 0;
  for (std::string line; std::getline(lines, line);) {
    ++number;
    const nlohmann::json j = nlohmann::json::parse(line, nullptr, false);
    // An interrupted program may leave half a line at the end.
    if (!j.is_object() || !j.contains("psnr_power_db")) continue;
    if (!j.at("psnr_power_db").is_number() || !j.contains(against) || !j.at(against).is_number())
      throw InputError(format("%s: line %zu: expected numbers '%s' and 'psnr_power_db'", file.string().c_str(), number, against.c_str()));
    const double x = j.at(against).get<double>();
    while (!curve.empty() && curve.back().first >= x) curve.pop_back();  // a resumed run repeats steps
    if (x > 0.0) curve.emplace_back(x, j.at("psnr_power_db").get<double>());
  }
  if (curve.empty())
    throw InputError(file.string() + ": expected held-out PSNR, found none; learn with --against or --holdout");
  return curve;
}

/// Linear in the logarithm of x; nothing beyond the curve's ends.
std::optional<double> value_at(const Curve& curve, double x) {
  if (x < curve.front().first || x > curve.back().first * (1.0 + 1e-9)) return std::nullopt;
  const auto behind = std::lower_bound(curve.begin(), curve.end(), std::pair(x, -1e300));
  if (behind == curve.end()) return curve.back().second;
  if (behind == curve.begin()) return behind->second;
  const auto before = behind - 1;
  const double part = std::log(x / before->first) / std::log(behind->first / before->first);
  return before->second + part * (behind->second - before->second);
}

/// One method: several runs that differ in their seeds.
struct Method {
  std::string name;
  std::vector<Curve> runs;

  /// Mean, least and most at x over the runs, where all of them reach it.
  std::optional<PlotPoint> at(double x) const {
    PlotPoint point{x, 0.0, {}, {}};
    for (const Curve& run : runs) {
      const std::optional<double> y = value_at(run, x);
      if (!y) return std::nullopt;
      point.y += *y / static_cast<double>(runs.size());
      point.y_low = std::min(point.y_low.value_or(*y), *y);
      point.y_high = std::max(point.y_high.value_or(*y), *y);
    }
    if (runs.size() == 1) point.y_low = point.y_high = std::nullopt;
    return point;
  }
};

Method read_method(const std::string& text, const std::string& against) {
  const std::size_t equals = text.find('=');
  if (equals == std::string::npos || equals == 0 || equals + 1 == text.size())
    throw UsageError("expected NAME=RUN[,RUN...], found " + in_quotes(text));
  Method method{text.substr(0, equals), {}};
  for (const std::string& run : app::parts_of(text.substr(equals + 1))) method.runs.push_back(read_curve(run, against));
  return method;
}

constexpr int kPointsOfCurve = 24, kColumns = 5;

}  // namespace

void run_curves_command(const CurvesOptions& o, app::Console& console) {
  if (o.quiet) console.set_verbosity(-1);
  const std::string against = o.by_steps ? "step" : "seconds";
  std::vector<Method> methods;
  for (const std::string& text : o.methods) methods.push_back(read_method(text, against));
  double low = 1e300, high = 0.0;
  for (const Method& method : methods)
    for (const Curve& run : method.runs) {
      low = std::min(low, run.front().first);
      high = std::max(high, run.back().first);
    }

  Plot plot;
  plot.title = o.title;
  plot.x = {o.by_steps ? "steps" : "seconds", AxisScale::log};
  plot.y = {"PSNR of unseen views (dB)"};
  std::vector<TableColumn> columns{{"method"}, {"runs", Align::right}};
  std::vector<double> at;
  for (int n = 0; n < kColumns; ++n) {
    at.push_back(high * std::pow(0.5, kColumns - 1 - n));
    columns.push_back({format(o.by_steps ? "%.0f steps" : "%.3g s", at.back()), Align::right});
  }
  columns.push_back({"at the end", Align::right});
  std::vector<std::vector<std::string>> rows;
  for (const Method& method : methods) {
    PlotSeries series;
    series.name = method.name;
    for (int n = 0; n < kPointsOfCurve; ++n) {
      const double x = low * std::pow(high / low, n / (kPointsOfCurve - 1.0));
      if (const auto point = method.at(x)) series.points.push_back(*point);
    }
    plot.series.push_back(series);
    std::vector<std::string> row{method.name, std::to_string(method.runs.size())};
    const auto cell = [&](const std::optional<PlotPoint>& p) {
      if (!p) return std::string("–");
      return p->y_low ? format("%.2f (%.2f to %.2f)", p->y, *p->y_low, *p->y_high) : format("%.2f", p->y);
    };
    for (const double x : at) row.push_back(cell(method.at(x)));
    double end = 1e300;
    for (const Curve& run : method.runs) end = std::min(end, run.back().first);
    row.push_back(cell(method.at(end)));
    rows.push_back(row);
  }
  const std::string table = markdown_table(columns, rows);
  if (!o.picture.empty()) {
    AtomicFiles files;
    files.add(o.picture, png_of_svg(svg(plot)));
    files.commit();
  }
  app::print_result(table);
}

namespace {

Pixels pixels_of(const fs::path& file) {
  if (file.extension() == ".tif" || file.extension() == ".tiff") return display_levels(read_image(file), Quantity::power);
  return read_picture(file);
}

}  // namespace

void run_page_command(const PageOptions& o, app::Console& console) {
  if (o.quiet) console.set_verbosity(-1);
  fs::path output = o.output;
  if (output.empty()) output = fs::path(o.input).replace_extension(".html");
  std::error_code ignored;
  if (fs::equivalent(output, o.input, ignored))
    throw UsageError("the page " + output.string() + " would replace its Markdown; choose another name (-o)");
  const std::string text = read_whole_file(o.input);
  Page page;
  try {
    page = page_of_markdown(text, [&](const std::string& file) { return pixels_of(o.input.parent_path() / file); });
  } catch (const UsageError& error) {
    throw InputError(o.input.string() + ": " + error.what());
  }
  if (page.title.empty()) page.title = o.input.stem().string();
  write_file_atomically(output, page_html(page));
  app::print_result(output.string() + "\n");
}

}  // namespace sarnerf::bench

// SPDX-License-Identifier: Apache-2.0
#include <fstream>
#include <span>

#include <nlohmann/json.hpp>

#include "extraction.h"
#include "output_lock.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/files.h"
#include "sarnerf/core/text.h"
#include "sarnerf/report/plot.h"
#include "studies.h"
#include "values.h"

namespace sarnerf::bench {

namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

constexpr double kFirstPitch_deg = 35.0, kLastPitch_deg = 55.0;

/// "0,10,…,350".
std::string azimuths_of(const ViewSet& views) {
  std::string list;
  for (int n = 0; n < views.n_azimuth; ++n) list += (n > 0 ? "," : "") + format("%.10g", 360.0 * n / views.n_azimuth);
  return list;
}

std::string pitches_of(const ViewSet& views) {
  if (views.n_pitch == 1) return format("%g", 0.5 * (kFirstPitch_deg + kLastPitch_deg));
  std::string list;
  for (int n = 0; n < views.n_pitch; ++n)
    list += (n > 0 ? "," : "") + format("%.10g", kFirstPitch_deg + (kLastPitch_deg - kFirstPitch_deg) * n / (views.n_pitch - 1));
  return list;
}

Json json_file(const fs::path& path) {
  std::ifstream file(path);
  return Json::parse(file);
}

/// A number of a report; it is null there if it was not measured.
double number(const Json& j) { return j.is_number() ? j.get<double>() : ExtractionRun::kUnknown; }

void render(const std::string& scene, const ExtractionOptions& o, const ViewSet& views, const fs::path& data) {
  // Four times as many rays as the automatic sampling, so that truth and learner have different discretisations.
  const int code = run_beside(
      "sar_render", {scene, "--scale", format("%.17g", o.scale), "--pitch", pitches_of(views), "--azimuth", azimuths_of(views),
                     "--size", "128x128", "--spacing", "0.3", "--engine", "surface", "--elevations", "768", "--sub-rows",
                     "27", "-o", data.string(), "--overwrite", "-q"});
  if (code != 0) throw Error(scene + " could not be rendered; sar_render says above why");
}

std::size_t n_runs_of(const ExtractionOptions& o) {
  return o.scene_files.size() * o.views.size() * o.fields.size() * o.times.size() * static_cast<std::size_t>(o.n_seeds);
}

/// Learns and extracts; fills in what was measured.
void close_loop(const std::string& scene, const ExtractionOptions& o, const fs::path& data, ExtractionRun& run) {
  const fs::path model = format("%s.%s.%gs.%d", data.c_str(), run.method.c_str(), run.planned_s, static_cast<int>(run.seed));
  fs::path volume = model;
  volume += ".vdb";
  int code = run_beside("sar_nerf_train", {data.string(), "--field", run.method, "--holdout", "0", "--time",
                                           format("%.17gs", run.planned_s), "--seed", std::to_string(run.seed), "-o",
                                           model.string(), "--overwrite", "-q"});
  if (code != 0) {
    run.failed = "sar_nerf_train ended with exit code " + std::to_string(code);
    return;
  }
  code = run_beside("sar_extract", {model.string(), volume.string(), "--ground-height", o.ground_height, "--truth", scene,
                                    "--truth-scale", format("%.17g", o.scale), "--images", data.string(), "--overwrite", "-q"});
  if (code != 0) {
    run.failed = "sar_extract ended with exit code " + std::to_string(code);
    return;
  }
  const Json training = json_file(model / "report.json"), extraction = json_file(model.string() + ".report.json");
  run.training_s = training.at("seconds").at("all programs of the run");
  run.extraction_s = extraction.at("seconds").at("total").get<double>() - extraction.at("seconds").at("score").get<double>();
  const Json& body = extraction.at("scores").at("extracted");
  run.iou = number(body.at("iou"));
  run.difference_m = number(body.at("symmetric_difference_m"));
  run.chamfer_m = number(body.at("visible").at("chamfer_m"));
  run.hausdorff_m = number(body.at("visible").at("hausdorff_m"));
  const Json& carving = extraction.at("scores").at("carving");
  run.carving_iou = number(carving.at("iou"));
  run.carving_difference_m = number(carving.at("symmetric_difference_m"));
  run.carving_chamfer_m = number(carving.at("visible").at("chamfer_m"));
}

}  // namespace

std::string ViewSet::text() const {
  return std::to_string(n_azimuth) + (n_pitch > 1 ? "x" + std::to_string(n_pitch) : "");
}

ViewSet parse_view_set(const std::string& text) {
  const auto cross = text.find('x');
  ViewSet views;
  views.n_azimuth = static_cast<int>(app::parse_whole("--views", text.substr(0, cross), 2, 3600));
  if (cross != std::string::npos)
    views.n_pitch = static_cast<int>(app::parse_whole("--views", text.substr(cross + 1), 1, 100));
  return views;
}

void study_extraction(const ExtractionOptions& o, app::Console& console,
                      const std::function<void(const std::vector<ExtractionRun>&)>& finished) {
  std::vector<ViewSet> sets;
  for (const std::string& text : o.views) sets.push_back(parse_view_set(text));
  std::vector<double> times_s;
  for (const std::string& text : o.times) times_s.push_back(app::parse_seconds("--time", text));
  for (const char* program : {"sar_render", "sar_nerf_train", "sar_extract"}) program_beside(program);
  fs::create_directories(o.output);
  std::vector<ExtractionRun> runs;
  for (const fs::path& study : o.beside)
    for (ExtractionRun& run : read_extraction_runs(study)) runs.push_back(std::move(run));
  const std::size_t n_beside = runs.size(), n_runs = n_runs_of(o);
  for (const std::string& scene : o.scene_files) {
    const std::string name = fs::path(scene).stem().string();
    for (const ViewSet& views : sets) {
      const fs::path data = o.output / (name + "." + views.text());
      render(scene, o, views, data);
      for (const std::string& field : o.fields)
        for (const double planned_s : times_s)
          for (int seed = 1; seed <= o.n_seeds; ++seed) {
            ExtractionRun run;
            run.scene = name;
            run.method = field;
            run.views = views;
            run.planned_s = planned_s;
            run.seed = static_cast<std::uint64_t>(seed);
            close_loop(scene, o, data, run);
            const std::string title =
                format("%s, %s, %d views, %g s, seed %d: ", name.c_str(), field.c_str(), views.count(), planned_s, seed);
            if (run.failed.empty()) {
              console.note(title + format("IoU %.3f, difference %.3f m, visible Chamfer %.3f m", run.iou, run.difference_m, run.chamfer_m));
            } else {
              console.warning(title + run.failed);
            }
            runs.push_back(std::move(run));
            console.progress("extraction", runs.size() - n_beside, n_runs);
            finished(runs);
          }
    }
  }
}

namespace {

void write(const std::filesystem::path& folder, const std::vector<ExtractionRun>& runs) {
  nlohmann::json json{{"environment", environment()}};
  json.update(extraction_json(runs));
  AtomicFiles files;
  const auto add = [&](const std::string& name, const std::string& text) {
    files.add(folder / name, std::as_bytes(std::span(text)));
  };
  add("extraction.json", json.dump(1, ' ', false, nlohmann::json::error_handler_t::replace) + "\n");
  add("extraction.md", extraction_table(runs));
  for (const auto& [name, plot] : extraction_diagrams(runs)) {
    const std::string drawn = svg(plot);
    add(name + ".svg", drawn);
    files.add(folder / (name + ".png"), png_of_svg(drawn));
  }
  files.commit();
}

std::string plan_text(const ExtractionOptions& o) {
  std::string text = "plan\n  study      extraction\n";
  for (const std::string& scene : o.scene_files) text += "  scene      " + scene + "\n";
  std::string views;
  for (const std::string& set : o.views) views += (views.empty() ? "" : ", ") + parse_view_set(set).text();
  std::string times;
  for (const std::string& time : o.times) {
    times += (times.empty() ? "" : ", ") + format("%g s", app::parse_seconds("--time", time));
  }
  std::string fields;
  for (const std::string& field : o.fields) fields += (fields.empty() ? "" : ", ") + field;
  return text + "  views      " + views + "\n  training   " + times + ", " + counted(static_cast<std::uint64_t>(o.n_seeds), "seed") +
         ", field " + fields + "\n  runs       " + counted(n_runs_of(o), "run") + "\n  output     " + o.output.string() + "/\n";
}

}  // namespace

void run_extraction_command(const ExtractionOptions& o, app::Console& console) {
  std::error_code ignored;
  if (std::filesystem::exists(o.output, ignored) && !std::filesystem::is_directory(o.output, ignored))
    throw UsageError(o.output.string() + ": expected a place for a folder, found a file; choose another -o");
  if (!o.overwrite && std::filesystem::exists(o.output / "extraction.json", ignored))
    throw UsageError(o.output.string() + ": holds a study; choose another folder (-o) or allow --overwrite");
  if (o.quiet) console.set_verbosity(-1);
  if (o.dry_run) {
    app::print_result(plan_text(o));
    return;
  }
  make_folder(o.output);
  const app::FolderLock lock(o.output);
  std::string table;
  study_extraction(o, console, [&](const std::vector<ExtractionRun>& runs) {
    write(o.output, runs);
    table = extraction_table(runs);
  });
  app::print_result(o.quiet ? (o.output / "extraction.md").string() + "\n" : table);
}

}  // namespace sarnerf::bench

// SPDX-License-Identifier: Apache-2.0
#include "extraction_command.h"

#include <span>

#include "extraction_output.h"
#include "folder_lock.h"
#include "sarnerf/core/atomic_file.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/format.h"
#include "sarnerf/report/raster.h"
#include "studies.h"
#include "values.h"

namespace sarnerf::bench {
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
  const std::size_t n_runs = o.scene_files.size() * o.views.size() * o.times.size() * static_cast<std::size_t>(o.n_seeds);
  return text + "  views      " + views + "\n  training   " + times + ", " + counted(static_cast<std::uint64_t>(o.n_seeds), "seed") +
         ", field " + o.field + "\n  runs       " + counted(n_runs, "run") + "\n  output     " + o.output.string() + "/\n";
}

}  // namespace

CLI::App& add_extraction_command(CLI::App& app, ExtractionOptions& o) {
  CLI::App& command = *app.add_subcommand(
      "extraction", "IoU and distance of extracted bodies against seconds of training and against the number of views; "
                    "prints a table (Markdown) and writes diagrams");
  command.add_option("scenes", o.scene_files, "Meshes or scenes with a closed body")->type_name("FILE")->required();
  command.add_option("--views", o.views,
                     "Sets of training views: azimuths, evenly around at 45 deg; x11: at each of 11 pitches, 35 to 55 deg")
      ->type_name("N[xP],...")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->capture_default_str();
  command.add_option("--time", o.times, "Planned times of training; each is a run of its own")
      ->type_name("TIME,...")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->capture_default_str();
  command.add_option("--seeds", o.n_seeds, "Runs of each, seeds 1 to N")
      ->type_name("N")
      ->check(CLI::Range(1, 1000).description(""))
      ->capture_default_str();
  command.add_option("--field", o.field, "grid or mlp")
      ->type_name("NAME")
      ->check(CLI::IsMember({"grid", "mlp"}).description(""))
      ->capture_default_str();
  command.add_option("--surfaces", o.surfaces, "Of sar_nerf_train: auto, on or off")
      ->type_name("NAME")
      ->check(CLI::IsMember({"auto", "on", "off"}).description(""))
      ->capture_default_str();
  command.add_option("--scale", o.scale, "Factor on the scenes' coordinates")->type_name("FACTOR")->capture_default_str();
  command.add_option("--ground-height", o.ground_height, "Where bodies end below (m); auto: where returns end")
      ->type_name("M|auto")
      ->capture_default_str();
  command.add_option("-o,--output", o.output, "Folder of the result, and of data, models and volumes")
      ->type_name("FOLDER")
      ->default_val("extraction_study");
  command.add_flag("--overwrite", o.overwrite, "Replace the study that is there");
  command.add_flag("-q,--quiet", o.quiet, "Print the path of the table, warnings and errors only");
  command.add_flag("--dry-run", o.dry_run, "Print what would be measured and stop");
  return command;
}

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

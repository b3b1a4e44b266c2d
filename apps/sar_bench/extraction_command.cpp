// SPDX-License-Identifier: Apache-2.0
#include "extraction_command.h"

#include <span>

#include "extraction_output.h"
#include "sarnerf/core/atomic_file.h"
#include "sarnerf/core/error.h"
#include "sarnerf/report/raster.h"
#include "studies.h"

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
  return command;
}

void run_extraction_command(const ExtractionOptions& o, app::Console& console) {
  std::error_code ignored;
  if (std::filesystem::exists(o.output, ignored) && !std::filesystem::is_directory(o.output, ignored))
    throw UsageError(o.output.string() + ": expected a place for a folder, found a file; choose another -o");
  if (!o.overwrite && std::filesystem::exists(o.output / "extraction.json", ignored))
    throw UsageError(o.output.string() + ": holds a study; choose another folder (-o) or allow --overwrite");
  std::string table;
  study_extraction(o, console, [&](const std::vector<ExtractionRun>& runs) {
    write(o.output, runs);
    table = extraction_table(runs);
  });
  app::print_result(table);
}

}  // namespace sarnerf::bench

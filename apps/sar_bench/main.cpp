// SPDX-License-Identifier: Apache-2.0
// sar_bench: the cost of a render beside its lower bound, and the accuracy that this cost buys.
#include <CLI/CLI.hpp>

#include "console.h"
#include "app_main.h"
#include "sarnerf/core/files.h"
#include "sarnerf/core/text.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/parallel.h"
#include "studies.h"
#include "extraction.h"
#include "random_scenes.h"
#include "output_lock.h"
#include "sarnerf/report/plot.h"

namespace {

using sarnerf::bench::StudyOptions;

struct Options {
  StudyOptions study;
  std::string up = "y";
  std::string json_file;
  std::string diagrams, table_file;
  int threads = sarnerf::default_thread_count();
  bool quiet = false, dry_run = false;

  /// Files that the study writes beside stdout.
  std::vector<std::string> result_files() const {
    std::vector<std::string> files;
    for (const std::string& file : {json_file, table_file}) {
      if (!file.empty()) files.push_back(file);
    }
    return files;
  }
};

void add_common(CLI::App& command, Options& o) {
  command.add_option("scenes", o.study.scene_files,
                     "Scene files; without any, generated spheres of 1 and 100 thousand triangles")
      ->type_name("FILE");
  command.add_option("--scale", o.study.load.scale, "Factor on the scenes' coordinates")
      ->type_name("FACTOR")
      ->capture_default_str();
  command.add_option("--up", o.up, "Axis that points up in the files")
      ->type_name("y|z")
      ->check(CLI::IsMember({"y", "z"}).description(""))
      ->capture_default_str();
  command.add_option("--materials", o.study.load.materials_file, "Materials JSON file")->type_name("FILE");
  command.add_option("--rounds", o.study.rounds, "Counted runs of each contender")
      ->type_name("N")
      ->check(CLI::Range(3, 1000).description(""))
      ->capture_default_str();
  command.add_option("--threads", o.threads, "Threads of the studies that use several")
      ->type_name("N")
      ->check(CLI::Range(1, 4096).description(""))
      ->capture_default_str();
  command.add_option("--json", o.json_file, "Write the result to this file, too")->type_name("FILE");
  command.add_flag("-q,--quiet", o.quiet, "Print paths of results that are written to files, warnings and errors only");
  command.add_flag("--dry-run", o.dry_run, "Print what would be measured and stop");
}

/// The sub-command `extraction`, which fills the options in.
CLI::App& add_extraction_command(CLI::App& app, sarnerf::bench::ExtractionOptions& o) {
  CLI::App& command = *app.add_subcommand(
      "extraction", "Errors of extracted bodies against seconds of training and against the number of views; "
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
  command.add_option("--field", o.fields, "Of grid, surface and mlp, one or several")
      ->type_name("NAME,...")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->check(CLI::IsMember({"grid", "surface", "mlp"}).description(""))
      ->capture_default_str();
  command.add_option("--beside", o.beside, "extraction.json of another study, to be drawn in the same diagrams")
      ->type_name("FILE")
      ->check(CLI::ExistingFile.description(""));
  command.add_option("--scale", o.scale, "Factor on the scenes' coordinates")->type_name("FACTOR")->capture_default_str();
  command.add_option("--ground-height", o.ground_height, "Where bodies end below (m); auto: not known")
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

/// The sub-command `scenes`, which fills the options in.
CLI::App& add_scenes_command(CLI::App& app, sarnerf::bench::ScenesOptions& o) {
  CLI::App& command = *app.add_subcommand(
      "scenes", "Writes generated scenes, FOLDER/101_solid/scene.obj and .json, to test learning on objects that none of its "
                "constants was chosen on. A seed makes the same bytes everywhere. By the seed's remainder modulo 4: 1 convex "
                "solids, 2 a building, 3 a vehicle, 0 free forms; 7 to 12 m long, 2 to 8 m high, on y = 0, Y up");
  command.add_option("--seed", o.seeds, "Seeds, a scene each: numbers and ranges first:last, as 111, 101,105 or 101:109")
      ->type_name("SEEDS")
      ->required();
  command.add_option("-o,--output", o.output, "Folder that the scenes' folders are made in")
      ->type_name("FOLDER")
      ->required();
  command.add_flag("--overwrite", o.overwrite, "Replace other scenes of these names; the same ones are left alone anyway");
  command.add_flag("-q,--quiet", o.quiet, "Print the paths of the scene files, warnings and errors only");
  command.add_flag("--dry-run", o.dry_run, "Print what would be written, with sizes (m), and stop");
  return command;
}

/// The sub-command `page`.
CLI::App& add_page_command(CLI::App& app, sarnerf::bench::PageOptions& o) {
  CLI::App& command = *app.add_subcommand(
      "page", "Turns a result in Markdown, with its pictures, into one HTML file, for which nothing else is needed");
  command.add_option("file", o.input, "Markdown with headings, paragraphs, tables and pictures")->type_name("FILE.md")->required();
  command.add_option("-o,--output", o.output, "Default: beside it, FILE.html")->type_name("FILE");
  command.add_flag("-q,--quiet", o.quiet, "Print the path, warnings and errors only");
  return command;
}

/// The sub-command `strip`.
CLI::App& add_strip_command(CLI::App& app, sarnerf::bench::StripOptions& o) {
  CLI::App& command = *app.add_subcommand(
      "strip", "One picture of the same views in several datasets: a column for each view of the first, a row for each dataset. "
               "All share one scale in decibels");
  command.add_option("dataset", o.datasets, "Folders with dataset.json, the truth first")->type_name("DATASET")->required();
  command.add_option("--trained", o.trained, "Dataset whose views are framed: those that were learned from")->type_name("DATASET");
  command.add_flag("--difference", o.with_difference, "A last row with the magnitude of the difference of the first two datasets");
  command.add_option("--zoom", o.zoom, "Pixels of the picture along each pixel of an image")->type_name("N")->capture_default_str()
      ->check(CLI::Range(1, 16).description(""));
  command.add_option("-o,--output", o.output, "The picture")->type_name("FILE.png")->required();
  command.add_flag("-q,--quiet", o.quiet, "Print the path, warnings and errors only");
  return command;
}

/// The sub-command `extents`.
CLI::App& add_extents_command(CLI::App& app, sarnerf::bench::ExtentsOptions& o) {
  CLI::App& command = *app.add_subcommand(
      "extents", "Lengths in slant range of wall, roof and shadow along the middle row of each view, of datasets by sar_render --layers "
                 "wall,roof,mask; and how far the image is from the first dataset's");
  command.add_option("dataset", o.datasets, "Folders with dataset.json")->type_name("DATASET")->required();
  command.add_flag("-q,--quiet", o.quiet, "Print the table, warnings and errors only");
  return command;
}

/// The sub-command `curves`.
CLI::App& add_curves_command(CLI::App& app, sarnerf::bench::CurvesOptions& o) {
  CLI::App& command = *app.add_subcommand(
      "curves", "Held-out PSNR against seconds or steps of runs of sar_nerf_train: a table, and a diagram");
  command.add_option("method", o.methods, "Runs that differ in their seeds alone, under one name")->type_name("NAME=RUN[,RUN...]")->required();
  command.add_option("-o,--output", o.picture, "The diagram")->type_name("FILE.png");
  command.add_option("--title", o.title, "Of the diagram")->type_name("TEXT");
  command.add_flag("--steps", o.by_steps, "Against steps of the optimiser");
  command.add_flag("-q,--quiet", o.quiet, "Print the table, warnings and errors only");
  return command;
}

/// The parts that a study with these options measures, a line each, for --dry-run.
std::string plan_text(const std::string& study, const Options& o) {
  const bool generated = o.study.scene_files.empty();
  std::string text = "plan\n  study      " + study + (o.study.quick ? ", quick" : "") + "\n";
  if (generated) text += "  scene      generated spheres of 1 and 100 thousand triangles\n";
  for (const std::string& file : o.study.scene_files) text += "  scene      " + file + "\n";
  text += sarnerf::format("  view       %d x %d pixels of %g m, incidence %g deg, azimuth %g deg\n", o.study.size, o.study.size,
                          o.study.spacing_m, o.study.pitch_deg, o.study.azimuth_deg);
  text += sarnerf::format("  rounds     %d of each contender, %s\n", o.study.rounds,
                          sarnerf::counted(static_cast<std::uint64_t>(o.threads), "thread").c_str());
  if (study == "speed") {
    text += "  parts      engine against bare Embree; threads and engines; integrators";
    if (!generated) text += "; 360-view sweeps";
    if (!o.study.quick) text += "; 12 thousand and 1.2 million triangles; 1024 x 1024 image of a million triangles";
    text += "\n";
  }
  if (study == "accuracy") text += std::string("  parts      elevation rays by slices") + (o.study.quick ? "" : "; voxel sizes") + "\n";
  if (study == "voxel") text += "  parts      voxel sizes against the surface engine; the dense march; twice the empty space\n";
  for (const std::string& file : o.result_files()) text += "  output     " + file + "\n";
  if (!o.diagrams.empty()) text += "  output     " + o.diagrams + "-SCENE.svg, .png\n";
  return text;
}

nlohmann::json run_speed(const Options& o, sarnerf::app::Console& console) {
  using namespace sarnerf::bench;
  const auto announce = [&](const std::string& what) { console.note(what + "..."); };
  nlohmann::json result{{"environment", environment()}};
  announce("engine against bare Embree");
  result["engine"] = study_engine(o.study);
  announce("threads and engines");
  result["threads"] = study_threads(o.study, o.threads);
  announce("integrators of each instruction set");
  result["integrators"] = study_integrators(o.study);
  if (!o.study.scene_files.empty()) {
    announce("360-view sweeps");
    result["sweep"] = study_sweep(o.study);
  }
  if (o.study.quick) return result;
  announce("12 thousand and 1.2 million triangles");
  result["triangles"] = study_triangles(o.study);
  const sarnerf::ThreadLimit limit(o.threads);
  announce("1024 x 1024 image of a million triangles");
  result["large_image"] = study_large_image(o.study);
  return result;
}

nlohmann::json run_accuracy(const Options& o) {
  using namespace sarnerf::bench;
  const std::vector<SceneAccuracy> scenes = study_accuracy(o.study);
  if (!o.table_file.empty()) sarnerf::write_file_atomically(o.table_file, accuracy_table(scenes));
  if (!o.diagrams.empty()) {
    for (const SceneAccuracy& scene : scenes) {
      const std::string name = o.diagrams + "-" + scene.scene, svg = sarnerf::svg(accuracy_diagram(scene));
      sarnerf::AtomicFiles files;
      files.add(name + ".svg", std::as_bytes(std::span(svg)));
      files.add(name + ".png", sarnerf::png_of_svg(svg));
      files.commit();
    }
  }
  return {{"environment", environment()}, {"accuracy", accuracy_json(scenes)}};
}

/// Throws UsageError with the study that was requested and those that exist.
[[noreturn]] void throw_unknown_study(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::App* study : app.get_subcommands({})) names.push_back(study->get_name());
  const std::string expected = "expected a study (" + CLI::detail::join(names, ", ") + ")";
  const std::vector<std::string> found = app.remaining();
  if (found.empty()) throw sarnerf::UsageError(expected + ", found none (see --help)");
  const std::string close = sarnerf::closest_name(found.back(), names);
  throw sarnerf::UsageError(expected + ", found '" + found.back() + "'" + (close.empty() ? "" : " (" + close + "?)"));
}

/// Throws UsageError if the result would be written over an input.
void refuse_to_replace(const std::filesystem::path& result, const std::filesystem::path& input) {
  std::error_code ignored;
  if (!result.empty() && std::filesystem::equivalent(result, input, ignored)) {
    throw sarnerf::UsageError("the result " + result.string() + " would replace an input; choose another name");
  }
}

void run(int argc, char** argv, sarnerf::app::Console& console) {
  CLI::App app("Measures sarnerf: error and time, as ratios in one run, with their spread. The result "
               "is JSON on standard output.");
  Options o;
  CLI::App* speed = app.add_subcommand(
      "speed", "Cost of tracing and deposit beside bare Embree, of sweeps, of meshes' sizes, of memory");
  add_common(*speed, o);
  speed->add_flag("--quick", o.study.quick, "Leave out the studies that take minutes");
  speed->add_option("--render-flags", o.study.render_flags,
                    "More flags for the sweeps' sar_render, as one string")
      ->type_name("TEXT");
  CLI::App* accuracy = app.add_subcommand(
      "accuracy", "Error against time over elevation rays and sub-rows, each scene");
  add_common(*accuracy, o);
  accuracy->add_option("--pitch", o.study.pitch_deg, "Incidence of the view, degrees")
      ->type_name("DEG")
      ->check(CLI::Range(1.0, 89.0).description(""))
      ->capture_default_str();
  accuracy->add_option("--azimuth", o.study.azimuth_deg, "Where the radar of the view stands, degrees")
      ->type_name("DEG")
      ->check(CLI::Range(-360.0, 360.0).description(""))
      ->capture_default_str();
  accuracy->add_option("--diagrams", o.diagrams, "Write PREFIX-SCENE.svg and .png, a work-precision diagram a scene")
      ->type_name("PREFIX");
  accuracy->add_option("--table", o.table_file, "Write scenes by settings as Markdown")->type_name("FILE");
  accuracy->add_flag("--quick", o.study.quick, "Leave out voxels, which take most of the time");
  CLI::App* voxel = app.add_subcommand(
      "voxel", "Voxel engine beside the surface engine: time, error and memory over voxel sizes");
  add_common(*voxel, o);
  sarnerf::bench::ExtractionOptions extraction_options;
  const CLI::App& extraction = add_extraction_command(app, extraction_options);
  app.add_subcommand("learning", "Held-out PSNR against seconds, each field (sar_nerf_bench)");
  sarnerf::bench::ScenesOptions scenes_options;
  const CLI::App& scenes = add_scenes_command(app, scenes_options);
  sarnerf::bench::PageOptions page_options;
  const CLI::App& page = add_page_command(app, page_options);
  sarnerf::bench::CurvesOptions curves_options;
  const CLI::App& curves = add_curves_command(app, curves_options);
  sarnerf::bench::StripOptions strip_options;
  const CLI::App& strip = add_strip_command(app, strip_options);
  sarnerf::bench::ExtentsOptions extents_options;
  const CLI::App& extents = add_extents_command(app, extents_options);
  app.add_subcommand("ablation", "What each rule and prior of learning adds, on scenes that it was not made on (sar_nerf_bench)");
  if (argc > 1 && std::string(argv[1]) == "learning") sarnerf::bench::become_nerf_bench(argc, argv, argv + 2);
  if (argc > 1 && std::string(argv[1]) == "ablation") sarnerf::bench::become_nerf_bench(argc, argv, argv + 1);
  try {
    app.parse(argc, argv);
  } catch (const CLI::CallForHelp&) {
    sarnerf::app::print_result(app.help());
    return;
  } catch (const CLI::ParseError& error) {
    if (app.get_subcommands().empty()) throw_unknown_study(app);
    throw sarnerf::UsageError(std::string(error.what()) + " (see --help)");
  }
  if (app.get_subcommands().empty()) throw_unknown_study(app);
  if (extraction.parsed()) {
    sarnerf::bench::run_extraction_command(extraction_options, console);
    return;
  }
  if (scenes.parsed()) {
    sarnerf::bench::run_scenes_command(scenes_options, console);
    return;
  }
  if (page.parsed()) return sarnerf::bench::run_page_command(page_options, console);
  if (curves.parsed()) return sarnerf::bench::run_curves_command(curves_options, console);
  if (strip.parsed()) return sarnerf::bench::run_strip_command(strip_options, console);
  if (extents.parsed()) return sarnerf::bench::run_extents_command(extents_options, console);
  o.study.load.up = o.up == "z" ? sarnerf::UpAxis::z : sarnerf::UpAxis::y;
  for (const std::filesystem::path input : o.study.scene_files) {
    refuse_to_replace(o.json_file, input);
    refuse_to_replace(o.table_file, input);
  }
  refuse_to_replace(o.json_file, o.study.load.materials_file);
  // Checked here, not after minutes of measuring.
  for (const std::filesystem::path result_file : {o.json_file, o.table_file, o.diagrams}) {
    if (result_file.empty()) continue;
    const auto folder = result_file.parent_path();
    sarnerf::require_writable(folder.empty() ? "." : folder);
  }
  if (o.study.quick) o.study.rounds = std::min(o.study.rounds, 5);
  if (o.quiet) console.set_verbosity(-1);
  if (o.dry_run) {
    for (const std::filesystem::path scene : o.study.scene_files) sarnerf::require_scene_file(scene);
    sarnerf::app::print_result(plan_text(speed->parsed() ? "speed" : voxel->parsed() ? "voxel" : "accuracy", o));
    return;
  }
  std::vector<std::filesystem::path> results;
  for (const std::string& file : o.result_files()) results.emplace_back(file);
  const sarnerf::app::OutputLock lock(results);
  nlohmann::json result;
  if (speed->parsed()) {
    result = run_speed(o, console);
  } else if (voxel->parsed()) {
    result = {{"environment", sarnerf::bench::environment()}, {"voxel", sarnerf::bench::study_voxel(o.study)}};
  } else {
    result = run_accuracy(o);
  }
  const std::string text = result.dump(1, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
  if (!o.json_file.empty()) sarnerf::write_file_atomically(o.json_file, text);
  std::string paths;
  for (const std::string& file : o.result_files()) paths += file + "\n";
  sarnerf::app::print_result(o.quiet && !paths.empty() ? paths : text);
}

}  // namespace

int main(int argc, char** argv) {
  using namespace sarnerf::app;
  Console console("sar_bench");
  return run_program(console, [&] { run(argc, argv, console); });
}

// SPDX-License-Identifier: Apache-2.0
// sar_fewshot: few-shot recognition of SAR chips with generated views.
#include <algorithm>

#include <nlohmann/json.hpp>

#include "app_main.h"
#include "output_files.h"
#include "output_lock.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/files.h"
#include "sarnerf/core/text.h"
#include "sarnerf/report/page.h"
#include "study.h"
#include "values.h"
#include "version.h"

namespace sarnerf::app {
namespace {

/// Takes a folder that is empty or holds the results of the same request, and refuses others.
void take_folder(const std::filesystem::path& folder, const Json& request, const Options& o, const char* option) {
  std::error_code code;
  if (std::filesystem::exists(folder, code) && !std::filesystem::is_directory(folder, code))
    throw UsageError(folder.string() + ": expected a place for a folder, found a file; choose another one (" + option + ")");
  refuse_inside(folder, std::vector{o.chips});
  require_possible(folder);
  const auto file = folder / "recipe.json";
  if (const auto recipe = read_recipe(file)) {
    const std::string differs = difference(recipe->value("request", Json()), request);
    if (!differs.empty())
      throw UsageError(folder.string() + ": holds a study with other chips or options (" + differs + "); choose another folder (" + option + ")");
    return;
  }
  if (std::filesystem::exists(folder, code) && !std::filesystem::is_empty(folder, code))
    throw UsageError(folder.string() + ": expected a study or an empty folder, found other files; choose another folder (" + option + ")");
  make_folder(folder);
  write_file_atomically(file, recipe_text(make_recipe(kProgram, request, Json::object())));
}

/// report.md, report.html, report.json and the diagrams.
std::string write_report(const Options& o, const std::vector<ClassChips>& chips, const std::vector<Cell>& cells) {
  const std::string tables = study_text(o, chips, cells);
  std::string text = tables;
  AtomicFiles files;
  for (const Classifier classifier : o.classifiers)
    if (const auto plot = accuracy_plot(o, cells, classifier)) {
      const std::string file = std::string(name(classifier)) + ".png";
      files.add(o.output / file, png_of_svg(svg(*plot)));
      text += "\n![" + plot->title + "](" + file + ")\n";
    }
  files.commit();
  std::string pictures;
  for (const ClassChips& c : chips)
    if (const std::string file = "pictures/" + c.name + ".png"; std::filesystem::exists(o.output / file))
      pictures += "![" + c.name + "](" + file + ")\n";
  if (!pictures.empty())
    text += "\n## Generated chips\n\n" + pictures +
            "*From above: measured chips, and the arms' views, each row evenly spread in azimuth; decibels on one scale.*\n";
  if (std::filesystem::exists(o.output / kExchangePicture))
    text += std::string("\n## Exchanged background\n\n![test chips](") + kExchangePicture +
            ")\n*Test chips of several classes; below them with the background of a chip of the same class, and of another one.*\n";
  text += "\n## Answers by class\n" + confusion_text(o, chips, cells);
  write_file_atomically(o.output / "report.md", text);
  write_file_atomically(o.output / "report.json", valid_text(study_json(o, chips, cells)).dump(1) + "\n");
  write_file_atomically(o.output / "report.html",
                        page_html(page_of_markdown(text, [&](const std::string& file) { return read_picture(o.output / file); })));
  return tables;
}

/// Throws UsageError if a study of these chips needs more memory than it may take. The numbers of a program and of its networks were measured.
void refuse_beyond_memory(const Options& o, const MemoryLimit& limit, const std::vector<ClassChips>& chips) {
  constexpr std::uint64_t kProgram = 500'000'000, kBatchChip = 2'000'000, kBatchChipOfResnet = 14'000'000;
  constexpr std::uint64_t kStoredChip = sizeof(float) * kStoredSide * kStoredSide;
  std::uint64_t pixels = 0, n_tested = 0;
  for (const ClassChips& c : chips) {
    n_tested += tested_chips(c, o.validate).size();
    for (const auto* list : {&c.training, &c.test})
      for (const PosedImage& chip : *list) pixels += chip.power.pixels().size();
  }
  const bool resnet = std::ranges::find(o.classifiers, Classifier::resnet50) != o.classifiers.end();
  const std::uint64_t needed = kProgram + static_cast<std::uint64_t>(o.training.batch) * (resnet ? kBatchChipOfResnet : kBatchChip) +
                               sizeof(float) * pixels + 2 * (o.exchange ? 3 : 1) * n_tested * kStoredChip;
  if (limit.allows(needed)) return;
  throw UsageError("the study of " + counted(n_tested, "test chip") + " needs about " + bytes_text(needed) + ", and " + limit.text() +
                   "; use fewer --classes or a smaller --batch" + (o.exchange ? ", or leave out --exchange-clutter" : ""));
}

void run(const Options& options, Console& console) {
  const MemoryLimit limit = memory_limit(options.shared);
  const Monitor monitor{[&](std::string_view stage, std::uint64_t done, std::uint64_t total) { console.progress(stage, done, total); },
                        &stop_requested()};
  const std::vector<ClassChips> chips = read_chips(options, console, monitor);
  require_draws(options, chips);
  refuse_beyond_memory(options, limit, chips);
  if (options.dry_run) {
    print_result(plan_text(options, chips));
    return;
  }
  const Json request = request_of(options, chips);
  take_folder(options.output, request, options, "-o");
  if (!options.chips_folder.empty()) take_folder(options.chips_folder, request, options, "--export");
  if (!options.draws_folder.empty()) take_folder(options.draws_folder, request, options, "--export-draws");
  const FolderLock lock(options.output);
  try {
    if (!options.chips_folder.empty() || !options.draws_folder.empty()) {
      const std::size_t n = export_chips(options, chips, monitor);
      for (const auto& folder : {options.chips_folder, options.draws_folder})
        if (!folder.empty()) print_result(folder.string() + ": " + counted(n, "chip") + "\n");
      return;
    }
    if (options.check_clutter) {
      const std::string text = clutter_text(options, chips, monitor);
      write_file_atomically(options.output / "clutter.md", text);
      print_result(text);
      return;
    }
    if (options.check_ground) {
      const std::string text = ground_text(chips, monitor);
      write_file_atomically(options.output / "ground.md", text);
      print_result(text);
      return;
    }
    const std::vector<Cell> cells = run_study(options, chips, console, monitor);
    write_pictures(options, chips, monitor);
    print_result(write_report(options, chips, cells));
  } catch (const Interrupted&) {
    throw Interrupted("interrupted; the same command continues, from " + options.output.string());
  }
}

}  // namespace
}  // namespace sarnerf::app

int main(int argc, char** argv) {
  using namespace sarnerf::app;
  return app_main<Options>(kProgram, argc, argv, parse_options, run);
}

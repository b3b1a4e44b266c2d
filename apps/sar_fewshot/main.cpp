// SPDX-License-Identifier: Apache-2.0
// sar_fewshot: few-shot recognition of SAR chips with generated views.
#include <algorithm>
#include <functional>
#include <map>

#include <nlohmann/json.hpp>

#include "app_main.h"
#include "clutter.h"
#include "generation.h"
#include "output_files.h"
#include "output_lock.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/files.h"
#include "sarnerf/core/text.h"
#include "sarnerf/report/page.h"
#include "study.h"
#include "torch_setup.h"
#include "values.h"
#include "version.h"

namespace sarnerf::app {
namespace {

/// A folder that is empty or holds the results of the same request; others are refused. While it exists, no other program takes it. One with cells
/// alone, of sar_recognise or of a published study, is taken if `admit_cells` is there and does not throw.
class TakenFolder {
 public:
  TakenFolder(const std::filesystem::path& folder, const Json& request, const Options& o, const char* option, const std::function<void()>& admit_cells)
      : lock_(made(folder, o, option)) {
    require_same_request(folder, request, option, admit_cells);
  }

 private:
  static const std::filesystem::path& made(const std::filesystem::path& folder, const Options& o, const char* option);
  static void require_same_request(const std::filesystem::path& folder, const Json& request, const char* option, const std::function<void()>& admit_cells);

  FolderLock lock_;
};

const std::filesystem::path& TakenFolder::made(const std::filesystem::path& folder, const Options& o, const char* option) {
  std::error_code code;
  if (std::filesystem::exists(folder, code) && !std::filesystem::is_directory(folder, code))
    throw UsageError(folder.string() + ": expected a place for a folder, found a file; choose another one (" + option + ")");
  refuse_inside(folder, std::vector{o.chips});
  require_possible(folder);
  make_folder(folder);
  return folder;
}

/// Writes the request into a folder that has none.
void TakenFolder::require_same_request(const std::filesystem::path& folder, const Json& request, const char* option,
                                       const std::function<void()>& admit_cells) {
  const auto file = folder / "recipe.json";
  if (const auto recipe = read_recipe(file)) {
    const std::string differs = difference(recipe->value("request", Json()), request);
    if (!differs.empty())
      throw UsageError(folder.string() + ": holds a study with other chips or options (" + differs + "); choose another folder (" + option + ")");
    return;
  }
  if (!std::filesystem::is_empty(folder)) {
    const bool cells_alone = std::ranges::all_of(std::filesystem::directory_iterator(folder), [](const auto& entry) {
      return entry.path().filename() == kCellsFolder && entry.is_directory();
    });
    if (!admit_cells || !cells_alone)
      throw UsageError(folder.string() + ": expected a study or an empty folder, found other files; choose another folder (" + option + ")");
    admit_cells();
  }
  write_file_atomically(file, recipe_text(make_recipe(kProgram, request, Json::object())));
}

/// report.md, report.html, report.json and the diagrams.
std::string write_report(const Options& o, const std::vector<ClassChips>& chips, const std::vector<Cell>& cells, const Pictures& pictures) {
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
  if (!pictures.rows.empty()) {
    text += "\n## Generated chips\n\n";
    for (const ClassChips& c : chips) text += "![" + c.name + "](" + picture_file(c) + ")\n";
    text += "*From above: measured chips";
    for (const Arm arm : pictures.rows) text += ", " + std::string(name(arm));
    text += "; each row evenly spread in azimuth; decibels on one scale.*\n";
  }
  if (pictures.exchanged)
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
  constexpr std::uint64_t kBatchChip = 2'000'000, kBatchChipOfResnet = 14'000'000;
  constexpr std::uint64_t kStoredChip = sizeof(float) * kStoredSide * kStoredSide;
  const std::uint64_t chip = sizeof(float) * chips.front().training.front().power.pixels().size();
  std::uint64_t n_chips = 0, n_tested = 0, n_generated = 0, n_kept = 0;  // kept: of all arms together, for files of draws and for pictures
  for (const ClassChips& c : chips) n_chips += c.training.size() + c.test.size();
  for (const int n_shots : o.shots) {
    const Draw draw = draw_shots(chips, n_shots, 0, o);
    std::uint64_t n_test = 0;
    for (const auto& of_class : draw.test) n_test += of_class.size();
    n_tested = std::max(n_tested, n_test);
    std::uint64_t n_of_draw = 0;
    for (const Arm arm : o.arms) {
      const std::uint64_t n = most_generated(arm, draw, o.generation);
      n_generated = std::max(n_generated, n);
      n_of_draw += n;
    }
    n_kept = std::max(n_kept, n_of_draw);
  }
  const bool resnet = std::ranges::find(o.classifiers, Classifier::resnet50) != o.classifiers.end();
  const std::uint64_t needed = kBaseMemory_bytes + static_cast<std::uint64_t>(o.training.batch) * (resnet ? kBatchChipOfResnet : kBatchChip) +
                               n_chips * chip + 2 * (o.exchange ? 3 : 1) * n_tested * kStoredChip + n_generated * (chip + 2 * kStoredChip) +
                               (o.draws_folder.empty() ? 1 : 2) * n_kept * kStoredChip;  // a file is made of a copy
  if (limit.allows(needed)) return;
  throw UsageError("the study of " + counted(n_tested, "test chip") + " and up to " + counted(n_generated, "generated one") + " needs about " +
                   bytes_text(needed) + ", and " + limit.text() + "; use fewer --classes, fewer --shots or a smaller --batch" + (o.exchange ? ", or leave out --exchange-clutter" : ""));
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
  const bool has_cells = !options.check_ground && !options.check_clutter && options.chips_folder.empty() && options.draws_folder.empty();
  std::function<void()> admit_cells;
  if (has_cells) admit_cells = [&] { missing_cells(options, chips); };
  std::map<std::filesystem::path, TakenFolder> taken;  // two options may name one folder
  for (const auto& [folder, option] : {std::pair(options.output, "-o"), {options.chips_folder, "--export"}, {options.draws_folder, "--export-draws"}})
    if (!folder.empty()) taken.try_emplace(full_path(folder), folder, request, options, option, admit_cells);
  if (options.check_ground) {
    const std::string text = ground_text(chips, monitor);
    write_file_atomically(options.output / "ground.md", text);
    print_result(text);
    return;
  }
  try {
    if (!options.chips_folder.empty() || !options.draws_folder.empty()) {
      const std::size_t n = export_chips(options, chips, monitor);
      if (!options.chips_folder.empty()) print_result(options.chips_folder.string() + ": " + counted(n, "chip") + "\n");
      if (!options.draws_folder.empty())
        print_result(options.draws_folder.string() + ": " + counted(options.shots.size() * static_cast<std::size_t>(options.n_draws), "draw") + "\n");
      return;
    }
    if (options.check_clutter) {
      const std::string text = clutter_text(options, chips, monitor);
      write_file_atomically(options.output / "clutter.md", text);
      print_result(text);
      return;
    }
    const std::vector<Cell> cells = run_study(options, chips, console, monitor);
    const Pictures pictures = write_pictures(options, chips, monitor);
    print_result(write_report(options, chips, cells, pictures));
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

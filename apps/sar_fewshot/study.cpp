// SPDX-License-Identifier: Apache-2.0
#include "study.h"

#include <algorithm>
#include <map>
#include <optional>
#include <span>

#include "clutter.h"
#include "generation.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/files.h"
#include "sarnerf/core/text.h"
#include "sarnerf/dataset/image_file.h"
#include "sarnerf/dataset/image_index.h"
#include "torch_setup.h"

namespace sarnerf::app {

namespace {

/// Raised whenever the same chips and options would give other draws, other test chips, or other generated chips without a field. Clutter of
/// shots (relative_background(), random_background()) counts: Arm::turned_clutter has it. kTrainingMethod is that of networks.
constexpr int kMethod = 12;

/// Raised whenever the same chips and options would give other learned views, and all else would stay.
constexpr int kFieldMethod = 3;

std::string fingerprint_of(const std::vector<ClassChips>& chips, std::string ClassChips::*digest) {
  std::string text;
  for (const ClassChips& c : chips) text += c.name + " " + c.*digest + "\n";
  return sha256_hex(std::as_bytes(std::span(text)));
}

}  // namespace

Json request_of(const Options& o, const std::vector<ClassChips>& chips) {
  const GenerationOptions& g = o.generation;
  const ClassifierOptions& c = o.training;
  Json request = {{"method", kMethod},
          {"chips", {{"sha256", fingerprint_of(chips, &ClassChips::sha256)},
                     {"geometry", fingerprint_of(chips, &ClassChips::geometry)},
                     {"classes", !o.classes.empty() ? Json(o.classes) : o.most_classes > 0 ? Json(o.most_classes) : Json("all")},
                     {"table", o.table.filename().string()},
                     {"scale", o.scale},
                     {"spacing_m", o.spacing_m ? Json{o.spacing_m->first, o.spacing_m->second} : Json("that of the table")},
                     {"training_depression_deg", o.training_depression_deg},
                     {"test_depression_deg", o.validate ? Json("none: a validation") : Json(o.test_depression_deg)},
                     {"test_rest", o.test_rest},
                     {"exchange_clutter", o.exchange}}},
          {"classifiers", {{"method", kTrainingMethod}, {"steps", c.n_steps}, {"batch", c.batch}, {"rate", c.rate}, {"weight_decay", c.weight_decay},
                           {"label_smoothing", c.label_smoothing}, {"shift_pixels", c.shift_pixels}, {"gain_jitter", c.gain_jitter}, {"shot_fraction", c.shot_fraction}}},
          {"generated", {{"step_deg", g.step_deg}, {"reach_deg", g.reach_deg},
                         {"depression_deg", g.depression_deg ? Json(*g.depression_deg) : Json("that of the shots")}, {"interpolation", name(g.interpolation)},
                         {"learned", {{"method", kFieldMethod}, {"field", g.field}, {"steps", g.field_steps},
                                      {"speckle", g.speckle == Speckle::none ? "none" : g.speckle == Speckle::shots ? "of shots" : "of the nearest shot"}}}}}};
  // Named only where it is asked for, so that studies from before there was a choice continue.
  if (o.same_azimuths) request["chips"]["same_azimuths"] = true;
  return valid_text(request);
}

std::string study_of(const Options& o, const std::vector<ClassChips>& chips, Arm arm) {
  Json request = request_of(o, chips);
  // A folder is of one geometry, but cells from before it was looked at stay valid. The next kMethod takes it in.
  request["chips"].erase("geometry");
  if (arm == Arm::none) request.erase("generated");
  else if (!needs_field(arm)) request["generated"].erase("learned");
  const std::string text = request.dump();
  return sha256_hex(std::as_bytes(std::span(text))).substr(0, 16);
}

namespace {

ClassifierOptions options_of_draw(const Options& o, int number) {
  ClassifierOptions options = o.training;
  options.seed = static_cast<std::uint64_t>(1 + number);
  return options;
}

/// Writes chips as FOLDER/CLASS/PREFIX_000.tif, and adds a line for each to a table of all chips of the folder.
void write_tiffs(const std::filesystem::path& folder, const char* prefix, const std::vector<ClassChips>& chips, const LabelledChips& set,
                 std::string& table) {
  std::vector<int> n_of_class(chips.size(), 0);
  const Acquisition& a = chips.front().training.front().acquisition;
  for (std::int64_t n = 0; n < set.size(); ++n) {
    const auto c = static_cast<std::size_t>(set.label[n].item<std::int64_t>());
    make_folder(folder / chips[c].name);
    Image<float> image(kStoredSide, kStoredSide);
    std::copy_n(set.amplitude[n].contiguous().data_ptr<float>(), image.pixels().size(), image.pixels().begin());
    const std::filesystem::path file = std::filesystem::path(chips[c].name) / format("%s_%03d.tif", prefix, n_of_class[c]++);
    AtomicFiles files(Durability::process);
    files.add(folder / file, encode_tiff(image));
    files.commit();
    table += format("%s,%s,%.4f,%.4f,%.6g,%.6g\n", csv_field(file.string()).c_str(), csv_field(chips[c].name).c_str(), set.pose_deg[n][0].item<double>(),
                    set.pose_deg[n][1].item<double>(), a.azimuth_spacing_m, a.range_spacing_m);
  }
}

}  // namespace

std::size_t export_chips(const Options& o, const std::vector<ClassChips>& chips, const Monitor& monitor) {
  const auto cache = o.output / "generated";
  make_folder(cache);
  if (!o.draws_folder.empty()) make_folder(o.draws_folder);
  std::size_t n_chips = 0, n_done = 0;
  const std::size_t n_sets = o.shots.size() * static_cast<std::size_t>(o.n_draws) * o.arms.size();
  for (const int n_shots : o.shots)
    for (int number = 0; number < o.n_draws; ++number) {
      const Draw draw = draw_shots(chips, n_shots, number, o);
      DrawFile file{{}, n_shots, number, options_of_draw(o, number), shots_of_classes(chips, draw), {}, {}};
      for (const Arm arm : o.arms) {
        monitor.check();
        const LabelledChips generated = generated_chips(arm, chips, draw, o, cache, monitor);
        file.generated[std::string(name(arm))] = {generated, study_of(o, chips, arm)};
        n_chips += static_cast<std::size_t>(file.shots.size() + generated.size());
        if (!o.chips_folder.empty()) {
          const auto folder = o.chips_folder / format("%02d_%02d", n_shots, number) / std::string(name(arm));
          std::string table = "file,class,azimuth_deg,depression_deg,azimuth_spacing_m,range_spacing_m\n";
          write_tiffs(folder, "shot", chips, file.shots, table);
          write_tiffs(folder, "generated", chips, generated, table);
          write_file_atomically(folder / "chips.csv", table, Durability::process);
        }
        monitor.report("sets of chips", ++n_done, n_sets);
      }
      if (o.draws_folder.empty()) continue;
      for (const ClassChips& c : chips) file.classes.push_back(c.name);
      file.test = test_of_classes(chips, draw, o);
      write_draw_file(o.draws_folder / format("%02d_%02d.pt", n_shots, number), file);
    }
  return n_chips;
}

namespace {

/// Calls visit(cell) for each cell of a study.
template <class Visit>
void each_cell(const Options& o, const Visit& visit) {
  for (const int n_shots : o.shots)
    for (int number = 0; number < o.n_draws; ++number)
      for (const Arm arm : o.arms)
        for (const Classifier classifier : o.classifiers)
          if (has_cell(classifier, name(arm))) visit(Cell{classifier, std::string(name(arm)), n_shots, number, {}, {}, {}, {}, {}, 0.0});
}

std::size_t number_of_cells(const Options& o) {
  std::size_t n = 0;
  each_cell(o, [&](const Cell&) { ++n; });
  return n;
}

/// Where a cell is kept.
std::filesystem::path file_of(const Options& o, const Cell& cell) { return o.output / kCellsFolder / cell_file_name(cell); }

/// What a cell takes, in steps of a network. Classifiers without one take next to nothing.
std::uint64_t steps_of(Classifier classifier, const Options& o) {
  return is_network(classifier) ? static_cast<std::uint64_t>(o.training.n_steps) : 1;
}

}  // namespace

std::string plan_text(const Options& o, const std::vector<ClassChips>& chips) {
  std::string text = "plan\n";
  for (const ClassChips& c : chips) {
    text += format("  %-16s %4zu chips at %g deg", c.name.c_str(), c.training.size(), o.training_depression_deg);
    text += o.validate ? "\n" : format(", %4zu at %g deg\n", c.test.size(), o.test_depression_deg);
  }
  const bool learned = std::ranges::any_of(o.arms, needs_field);
  text += format("  cells            %zu: classifiers, arms, shots and %d draws\n", number_of_cells(o), o.n_draws);
  if (learned)
    text += format("  fields           %zu of %lld steps, %s\n", chips.size() * o.shots.size() * static_cast<std::size_t>(o.n_draws),
                   static_cast<long long>(o.generation.field_steps), o.generation.field.c_str());
  return text + format("  tested on        %s\n  output           %s/\n",
                       o.validate    ? "sectors of the training depression that hold no shots"
                       : o.test_rest ? "all chips of the test depression; of classes that have none, the others of the training depression"
                                     : "all chips of the test depression",
                       o.output.c_str());
}

namespace {

/// Fills a cell from its file. Throws InputError for a file that is not this study's.
void read_cell(Cell& cell, const std::filesystem::path& file, bool exchanged, std::size_t n_classes) {
  bool same = false;
  try {
    const Json json = Json::parse(read_whole_file(file));
    same = json.at("classifier") == std::string(name(cell.classifier)) && json.at("arm") == cell.arm && json.at("shots") == cell.n_shots &&
           json.at("draw") == cell.draw && json.value("study", "") == cell.study;
    cell.confusion = json.at("confusion").get<Confusion>();
    cell.within = json.value("confusion_within", Confusion());
    cell.across = json.value("confusion_across", Confusion());
    cell.device = json.value("device", "");
    cell.seconds = json.at("seconds");
  } catch (const Json::exception&) {
    throw InputError(file.string() + ": expected a cell of a study, found something else; remove the file");
  }
  const auto fits = [&](const Confusion& confusion) {
    return confusion.size() == n_classes && std::ranges::all_of(confusion, [&](const auto& row) { return row.size() == n_classes; });
  };
  if (!same || !fits(cell.confusion) || (exchanged && (!fits(cell.within) || !fits(cell.across))))
    throw InputError(file.string() + ": expected a cell of this study's chips and options, found one of others; remove the file");
}

/// study_of() each arm.
std::map<std::string_view, std::string> studies_of_arms(const Options& o, const std::vector<ClassChips>& chips) {
  std::map<std::string_view, std::string> studies;
  for (const Arm arm : o.arms) studies[name(arm)] = study_of(o, chips, arm);
  return studies;
}

}  // namespace

std::map<std::filesystem::path, std::uint64_t> missing_cells(const Options& o, const std::vector<ClassChips>& chips) {
  const auto studies = studies_of_arms(o, chips);
  std::map<std::filesystem::path, std::uint64_t> missing;
  each_cell(o, [&](Cell cell) {
    cell.study = studies.at(cell.arm);
    const auto file = file_of(o, cell);
    if (std::filesystem::exists(file)) read_cell(cell, file, o.exchange, chips.size());
    else missing[file] = steps_of(cell.classifier, o);
  });
  return missing;
}

std::vector<Cell> run_study(const Options& o, const std::vector<ClassChips>& chips, Console& console, const Monitor& monitor) {
  const auto cache = o.output / "generated";
  make_folder(o.output / kCellsFolder);
  make_folder(cache);
  const auto studies = studies_of_arms(o, chips);
  const auto missing = missing_cells(o, chips);  // a cell of another study is refused before anything is trained
  std::uint64_t n_steps = 0, n_done = 0;
  for (const auto& [file, steps] : missing) n_steps += steps;
  const int n_classes = static_cast<int>(chips.size());
  std::vector<Cell> cells;
  for (const int n_shots : o.shots)
    for (int number = 0; number < o.n_draws; ++number) {
      const Draw draw = draw_shots(chips, n_shots, number, o);
      std::optional<TestChips> test;
      for (const Arm arm : o.arms) {
        std::optional<TrainingChips> training;
        for (const Classifier classifier : o.classifiers) {
          if (!has_cell(classifier, name(arm))) continue;
          monitor.check();
          Cell& cell = cells.emplace_back(Cell{classifier, std::string(name(arm)), n_shots, number, studies.at(name(arm)), {}, {}, {}, {}, 0.0});
          const auto file = file_of(o, cell);
          if (std::filesystem::exists(file)) {
            read_cell(cell, file, o.exchange, chips.size());
            if (missing.contains(file)) n_steps -= steps_of(classifier, o);  // made by another program meanwhile
          } else {
            if (!test) test = test_of_classes(chips, draw, o);
            if (!training)
              training.emplace(TrainingChips{shots_of_classes(chips, draw), generated_chips(arm, chips, draw, o, cache, monitor)});
            use_torch_threads(thread_count());
            make_cell(cell, *training, *test, n_classes, options_of_draw(o, number), [&](int step, int) {
              monitor.check();
              monitor.report("training steps", n_done + static_cast<std::uint64_t>(step), n_steps);
            });
            n_done += steps_of(classifier, o);
            write_file_atomically(file, cell_json(cell));
            console.note(format("%s, %s, %s shots, draw %d: %.1f %% (%.0f s)", std::string(name(classifier)).c_str(), cell.arm.c_str(),
                                shots_text(n_shots).c_str(), number, 100.0 * accuracy(cell.confusion), cell.seconds));
            monitor.report("training steps", n_done, n_steps);
          }
        }
      }
    }
  return cells;
}

}  // namespace sarnerf::app

// SPDX-License-Identifier: Apache-2.0
#include "study.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "sarnerf/core/error.h"
#include "sarnerf/core/files.h"
#include "sarnerf/core/text.h"
#include "sarnerf/dataset/image_file.h"
#include "torch_setup.h"

namespace sarnerf::app {

int Cell::n_test() const {
  int n = 0;
  for (const auto& row : confusion)
    for (const int count : row) n += count;
  return n;
}

int Cell::n_correct() const {
  int n = 0;
  for (std::size_t c = 0; c < confusion.size(); ++c) n += confusion[c][c];
  return n;
}

Json cell_json(const Cell& cell) {
  return {{"classifier", name(cell.classifier)}, {"arm", name(cell.arm)},   {"shots", cell.n_shots},
          {"draw", cell.draw},                   {"accuracy", cell.accuracy()}, {"confusion", cell.confusion},
          {"seconds", cell.seconds}};
}

Json request_of(const Options& o) {
  const GenerationOptions& g = o.generation;
  const ClassifierOptions& c = o.training;
  return {{"chips", {{"classes", !o.classes.empty() ? Json(o.classes) : o.most_classes > 0 ? Json(o.most_classes) : Json("all")},
                     {"table", o.table.filename().string()},
                     {"scale", o.scale},
                     {"training_depression_deg", o.training_depression_deg},
                     {"test_depression_deg", o.validate ? Json("none: a validation") : Json(o.test_depression_deg)}}},
          {"classifiers", {{"steps", c.n_steps}, {"batch", c.batch}, {"rate", c.rate}, {"weight_decay", c.weight_decay},
                           {"shift_pixels", c.shift_pixels}, {"gain_jitter", c.gain_jitter}, {"shot_fraction", c.shot_fraction}}},
          {"generated", {{"step_deg", g.step_deg}, {"reach_deg", g.reach_deg}, {"interpolation", name(g.interpolation)},
                         {"field", g.field}, {"field_steps", g.field_steps},
                         {"speckle", g.speckle ? Json(text_of(g.window)) : Json("none")}}}};
}

namespace {

std::string cell_name(const Cell& cell) {
  return format("%s_%s_%02d_%02d.json", std::string(name(cell.classifier)).c_str(), std::string(name(cell.arm)).c_str(), cell.n_shots,
                cell.draw);
}

/// The classifiers and arms that need a cell of their own: the background of an arm is that of its shots.
bool is_asked(Classifier classifier, Arm arm) { return classifier != Classifier::background || arm == Arm::none; }

LabelledChips chips_of(const std::vector<ClassChips>& chips, const std::vector<std::vector<std::size_t>>& which, bool of_test) {
  std::vector<const PosedImage*> pointers;
  std::vector<std::int64_t> labels;
  for (std::size_t c = 0; c < chips.size(); ++c)
    for (const std::size_t n : which[c]) {
      pointers.push_back(&(of_test ? chips[c].test : chips[c].training)[n]);
      labels.push_back(static_cast<std::int64_t>(c));
    }
  return labelled(pointers, labels);
}

std::vector<std::vector<int>> confusion_of(const torch::Tensor& scores, const torch::Tensor& label, std::size_t n_classes) {
  std::vector<std::vector<int>> confusion(n_classes, std::vector<int>(n_classes, 0));
  const torch::Tensor answer = scores.argmax(1);
  for (std::int64_t n = 0; n < label.size(0); ++n)
    ++confusion[static_cast<std::size_t>(label[n].item<std::int64_t>())][static_cast<std::size_t>(answer[n].item<std::int64_t>())];
  return confusion;
}

}  // namespace

std::size_t export_chips(const Options& o, const std::vector<ClassChips>& chips, const Monitor& monitor) {
  const auto cache = o.output / "generated";
  make_folder(cache);
  std::size_t n_files = 0, n_done = 0;
  const std::size_t n_sets = o.shots.size() * static_cast<std::size_t>(o.n_draws) * o.arms.size();
  for (const int n_shots : o.shots)
    for (int number = 0; number < o.n_draws; ++number) {
      const Draw draw = draw_shots(chips, n_shots, number, o.validate);
      const LabelledChips shots = chips_of(chips, draw.shots, false);
      for (const Arm arm : o.arms) {
        monitor.check();
        const auto folder = o.chips_folder / format("%02d_%02d", n_shots, number) / std::string(name(arm));
        for (const auto& [prefix, set] : {std::pair("shot", shots), std::pair("generated", generated_chips(arm, chips, draw, o, cache, monitor))}) {
          std::vector<int> n_of_class(chips.size(), 0);
          for (std::int64_t n = 0; n < set.size(); ++n) {
            const auto c = static_cast<std::size_t>(set.label[n].item<std::int64_t>());
            make_folder(folder / chips[c].name);
            Image<float> image(kStoredSide, kStoredSide);
            std::copy_n(set.amplitude[n].contiguous().data_ptr<float>(), image.pixels().size(), image.pixels().begin());
            AtomicFiles files;
            files.add(folder / chips[c].name / format("%s_%03d.tif", prefix, n_of_class[c]++), encode_tiff(image));
            files.commit();
            ++n_files;
          }
        }
        monitor.report("sets of chips", ++n_done, n_sets);
      }
    }
  return n_files;
}

namespace {

std::size_t number_of_cells(const Options& o) {
  std::size_t n = 0;
  for (const Classifier classifier : o.classifiers)
    for (const Arm arm : o.arms) n += is_asked(classifier, arm);
  return n * o.shots.size() * static_cast<std::size_t>(o.n_draws);
}

}  // namespace

std::string plan_text(const Options& o, const std::vector<ClassChips>& chips) {
  std::string text = "plan\n";
  for (const ClassChips& c : chips)
    text += format("  %-16s %4zu chips at %g deg, %4zu at %g deg\n", c.name.c_str(), c.training.size(), o.training_depression_deg,
                   c.test.size(), o.test_depression_deg);
  const bool learned = std::ranges::any_of(o.arms, [](Arm arm) { return arm == Arm::learned || arm == Arm::learned_turned; });
  text += format("  cells            %zu: classifiers, arms, shots and %d draws\n", number_of_cells(o), o.n_draws);
  if (learned)
    text += format("  fields           %zu of %lld steps, %s\n", chips.size() * o.shots.size() * static_cast<std::size_t>(o.n_draws),
                   static_cast<long long>(o.generation.field_steps), o.generation.field.c_str());
  return text + format("  tested on        %s\n  output           %s/\n",
                       o.validate ? "sectors of the training depression that hold no shots" : "all chips of the test depression",
                       o.output.c_str());
}

std::vector<Cell> run_study(const Options& o, const std::vector<ClassChips>& chips, Console& console, const Monitor& monitor) {
  const auto cells_folder = o.output / "cells", cache = o.output / "generated";
  make_folder(cells_folder);
  make_folder(cache);
  std::vector<Cell> cells;
  const std::size_t n_cells = number_of_cells(o);
  const int n_classes = static_cast<int>(chips.size());
  for (const int n_shots : o.shots)
    for (int number = 0; number < o.n_draws; ++number) {
      const Draw draw = draw_shots(chips, n_shots, number, o.validate);
      std::optional<LabelledChips> test;
      for (const Arm arm : o.arms) {
        std::optional<TrainingChips> training;
        for (const Classifier classifier : o.classifiers) {
          if (!is_asked(classifier, arm)) continue;
          Cell cell{classifier, arm, n_shots, number, {}, 0.0};
          const auto file = cells_folder / cell_name(cell);
          if (std::filesystem::exists(file)) {
            const Json json = Json::parse(read_whole_file(file));
            cell.confusion = json.at("confusion").get<std::vector<std::vector<int>>>();
            cell.seconds = json.at("seconds");
          } else {
            monitor.check();
            if (!test) test = chips_of(chips, draw.test, !o.validate);
            if (!training) {
              use_torch_threads(1);
              training.emplace(TrainingChips{chips_of(chips, draw.shots, false), generated_chips(arm, chips, draw, o, cache, monitor)});
            }
            use_torch_threads(thread_count());
            ClassifierOptions options = o.training;
            options.seed = static_cast<std::uint64_t>(1 + number);
            const Stopwatch watch;
            const torch::Tensor scores = classify(classifier, *training, test->amplitude, n_classes, options,
                                                  [&](int, int) { monitor.check(); });
            cell.seconds = watch.seconds();
            cell.confusion = confusion_of(scores, test->label, chips.size());
            write_file_atomically(file, cell_json(cell).dump(1) + "\n");
            console.note(format("%s, %s, %d shots, draw %d: %.1f %% (%.0f s)", std::string(name(classifier)).c_str(),
                                std::string(name(arm)).c_str(), n_shots, number, 100.0 * cell.accuracy(), cell.seconds));
          }
          cells.push_back(std::move(cell));
          monitor.report("cells", cells.size(), n_cells);
        }
      }
    }
  return cells;
}

}  // namespace sarnerf::app

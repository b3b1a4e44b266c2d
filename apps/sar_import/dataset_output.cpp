// SPDX-License-Identifier: Apache-2.0
#include "dataset_output.h"

#include <algorithm>
#include <map>
#include <mutex>
#include <nlohmann/json.hpp>
#include <set>

#include "checksums.h"
#include "display_scale.h"
#include "folder_lock.h"
#include "output_files.h"
#include "recipe.h"
#include "sarnerf/core/atomic_file.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/format.h"
#include "sarnerf/core/input_file.h"
#include "sarnerf/core/parallel.h"
#include "sarnerf/dataset/display.h"
#include "sarnerf/dataset/image_file.h"
#include "summary.h"
#include "sweep_folder.h"
#include "sweep_place.h"

namespace sarnerf::app {
namespace {

/// The views on their way into the folder.
class Import {
 public:
  Import(const Options& options, const std::vector<Source>& sources, const SweepFolder& folder)
      : options_(options),
        sources_(sources),
        folder_(folder),
        checksums_(folder.checksums()),
        finished_(sources.size(), 0) {
    parallel_for(sources.size(), 8, [&](std::size_t begin, std::size_t end, int) {
      for (std::size_t n = begin; n < end; ++n)
        finished_[n] =
            checksums_.whole(folder_.image_name(n)) && checksums_.whole(folder_.png_name(n)) ? 1
                                                                                             : 0;
    });
    n_before_ = n_finished();
  }

  std::size_t n_finished() const {
    return static_cast<std::size_t>(std::count(finished_.begin(), finished_.end(), 1));
  }
  std::size_t n_before() const { return n_before_; }

  /// Writes the images that are not there.
  void write_views(const Monitor& monitor) {
    std::vector<float> whites;
    for (const std::size_t n : DisplayScale::sample_views(sources_.size())) {
      monitor.check();
      whites.push_back(white_level(load(options_, sources_[n]).image));
    }
    const DisplayScale scale(whites);
    display_ = scale.text(options_.quantity);
    std::size_t n_done = 0;
    parallel_for(sources_.size(), 1, [&](std::size_t begin, std::size_t end, int) {
      for (std::size_t n = begin; n < end; ++n) {
        if (finished_[n]) continue;
        monitor.check();
        write_view(n, scale);
        const std::scoped_lock lock(mutex_);
        monitor.report("images", ++n_done, sources_.size() - n_before_);
      }
    });
    checksums_.finish();
  }

  /// Of the views that are finished.
  std::string manifest() const {
    Dataset dataset;
    dataset.quantity = options_.quantity;
    dataset.calibration = Calibration::uncalibrated;
    std::size_t n_assumed = 0, n_nominal = 0;
    for (std::size_t n = 0; n < sources_.size(); ++n) {
      if (!finished_[n]) continue;
      dataset.views.push_back(sources_[n].chip.view);
      dataset.views.back().image = folder_.image_name(n);
      if (!sources_[n].split.empty())
        dataset.splits[sources_[n].split].push_back(folder_.image_name(n));
      n_assumed += sources_[n].chip.range_is_assumed ? 1 : 0;
      n_nominal += sources_[n].chip.depression_is_nominal ? 1 : 0;
    }
    dataset.resolution = common_resolution(sources_);
    dataset.scene_box_m = scene_box_of_swath(dataset.aim_m, dataset.views);
    Json provenance{
        {"program", make_recipe(kProgram, Json::object(), Json::object()).at("program")},
        {"recipe", "recipe.json"},
        {"command", name(options_.command)},
        {"display", display_}};
    if (n_assumed > 0)
      provenance["assumed"]["slant_range_m"] = {{"value", options_.slant_range_m},
                                                {"views", n_assumed}};
    if (n_nominal > 0) provenance["assumed"]["depression_is_nominal"] = {{"views", n_nominal}};
    if (dataset.views.size() < sources_.size()) dataset.n_planned_views = sources_.size();
    dataset.provenance_json = provenance.dump();
    return manifest_text(dataset);
  }

 private:
  void write_view(std::size_t n, const DisplayScale& scale) {
    const Chip chip = load(options_, sources_[n]);
    const auto tiff = encode_tiff(chip.image),
               png = make_picture(chip.image, options_.quantity, scale);
    AtomicFiles files(Durability::process);
    files.add(folder_.path() / folder_.png_name(n), png);
    files.add(folder_.tiff(n), tiff);
    files.commit();
    checksums_.add({{folder_.png_name(n), png}, {folder_.image_name(n), tiff}});
    finished_[n] = 1;
  }

  const Options& options_;
  const std::vector<Source>& sources_;
  const SweepFolder& folder_;
  Checksums checksums_;
  std::vector<char> finished_;
  std::size_t n_before_ = 0;
  Json display_;
  std::mutex mutex_;
};

void warn_of_several_classes(const std::vector<Source>& sources, Console& console) {
  std::set<std::string> classes;
  for (const Source& s : sources) classes.insert(s.chip.view.class_name + " " + s.chip.view.serial);
  if (classes.size() > 1)
    console.warning(std::to_string(classes.size()) +
                    " targets (class and serial) in one dataset: sar_nerf_train learns one scene; "
                    "choose with --class, or "
                    "import the folder of one target");
}

}  // namespace

std::string write_dataset(const Options& o, const Choice& choice, Console& console,
                          const Monitor& monitor) {
  refuse_input(o.output, o.inputs);
  refuse_inside(o.output, o.inputs);
  const SweepFolder folder(o.output, choice.chosen.size());
  const Json recipe = recipe_of(o, choice.chosen, monitor);
  require_sweep_place(folder, recipe.at("request"), o.overwrite);
  warn_of_several_classes(choice.chosen, console);
  make_folder(folder.path());
  const FolderLock lock(folder.path());
  folder.remove_temporary_files();
  take_sweep_place(folder, recipe, o.overwrite);
  folder.create(false);

  Import import(o, choice.chosen, folder);
  const std::string n_all = counted(choice.chosen.size(), "image");
  const std::string result = folder.manifest().string() + "\n" + summary_text(choice);
  if (import.n_before() == choice.chosen.size() && std::filesystem::exists(folder.report())) {
    console.note(import.n_before() == 1 ? "already done: the image of the same recipe is there, nothing was written"
                                         : "already done: all " + n_all + " of the same recipe are there, nothing was written");
    return result;
  }
  if (import.n_before() > 0)
    console.note("continuing: " + std::to_string(import.n_before()) + " of " + n_all +
                 (import.n_before() == 1 ? " is there" : " are there"));
  try {
    import.write_views(monitor);
  } catch (const Interrupted&) {
    if (import.n_finished() > 0) write_file_atomically(folder.manifest(), import.manifest());
    throw Interrupted("interrupted: " + std::to_string(import.n_finished()) + " of " + n_all +
                      (import.n_finished() == 1 ? " is" : " are") + " finished; the same command continues");
  }
  write_file_atomically(folder.manifest(), import.manifest());
  write_file_atomically(folder.report(),
                        report_text(o, choice, choice.chosen.size() - import.n_before()),
                        Durability::process);
  console.note("finished: " + n_all);
  return result;
}

}  // namespace sarnerf::app

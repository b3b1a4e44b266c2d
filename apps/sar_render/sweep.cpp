// SPDX-License-Identifier: Apache-2.0
#include "sweep.h"

#include <algorithm>
#include <fstream>
#include <iterator>
#include <map>
#include <mutex>
#include <nlohmann/json.hpp>

#include "folder_lock.h"
#include "output_place.h"
#include "products.h"
#include "report.h"
#include "sarnerf/core/atomic_file.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/parallel.h"
#include "sarnerf/dataset/image_file.h"
#include "sweep_folder.h"
#include "version.h"

namespace sarnerf::app {
namespace {

[[noreturn]] void refuse(const std::filesystem::path& folder, const std::string& why) {
  throw UsageError(folder.string() + ": other output is in the way (" + why +
                   "); choose another folder (-o) or allow --overwrite");
}

/// Warnings of many views, each text once.
class WarningList {
 public:
  void add(const DatasetView& view, std::size_t index, const std::string& text) {
    const std::scoped_lock lock(mutex_);
    Entry& entry = entries_[text];
    if (entry.n_views++ == 0 || index < entry.first) {
      entry.first = index;
      entry.incidence_deg = view.incidence_deg;
      entry.azimuth_deg = view.azimuth_deg;
    }
  }
  void print(Console& console) const {
    constexpr std::size_t kMostLines = 5;
    std::map<std::size_t, const std::pair<const std::string, Entry>*> by_view;
    for (const auto& entry : entries_) by_view[entry.second.first] = &entry;
    std::size_t n = 0;
    for (const auto& [index, entry] : by_view) {
      char place[120];
      std::snprintf(place, sizeof place, "%zu view%s, first at incidence %.6g, azimuth %.6g deg: ",
                    entry->second.n_views, entry->second.n_views == 1 ? "" : "s",
                    entry->second.incidence_deg, entry->second.azimuth_deg);
      console.warning(place + entry->first);
      if (++n == kMostLines && by_view.size() > kMostLines) {
        console.warning("and " + std::to_string(by_view.size() - kMostLines) + " views more with warnings");
        break;
      }
    }
  }

 private:
  struct Entry {
    std::size_t n_views = 0;
    std::size_t first = 0;
    double incidence_deg = 0.0, azimuth_deg = 0.0;
  };
  std::mutex mutex_;
  std::map<std::string, Entry> entries_;
};

/// One flag per view: written by an earlier run, and whole. Machines lose power; then a file can be
/// there without its content.
std::vector<char> finished_views(const SweepFolder& folder, const Job& job) {
  std::vector<char> finished(job.views.size(), 0);
  const std::vector<std::string> endings = layer_endings(job.options.layers);
  parallel_for(job.views.size(), 8, [&](std::size_t begin, std::size_t end, int) {
    for (std::size_t n = begin; n < end; ++n) {
      if (!std::filesystem::exists(folder.tiff(n)) || !std::filesystem::exists(folder.png(n))) continue;
      if (!std::all_of(endings.begin(), endings.end(), [&](const std::string& ending) {
            return std::filesystem::exists(folder.layer(n, ending));
          })) continue;
      try {
        const Image<float> image = read_image(folder.tiff(n));
        finished[n] = image.n_azimuth() == job.views[n].n_azimuth &&
                      image.n_range() == job.views[n].n_range &&
                      std::filesystem::file_size(folder.png(n)) > 0;
      } catch (const InputError&) {
        // Rendered again, over what is there.
      }
    }
  });
  return finished;
}

std::string manifest_of(const Job& job, const Json& recipe, const std::vector<char>& finished) {
  Dataset dataset;
  dataset.quantity = job.options.quantity;
  dataset.calibration = job.options.calibration;
  dataset.aim_m = job.aim_m;
  for (std::size_t n = 0; n < job.views.size(); ++n) {
    if (finished[n]) dataset.views.push_back(job.views[n]);
  }
  dataset.scene_box_m = scene_box_of_swath(job.aim_m, dataset.views);
  Json provenance;
  provenance["program"] = recipe.at("program");
  provenance["recipe"] = "recipe.json";
  provenance["scene"] = recipe.at("request").at("scene");
  if (job.options.formation.any()) provenance["formation"] = recipe.at("request").at("formation");
  if (!job.options.layers.empty()) {
    provenance["layers"] = {{"folder", "layers"}, {"names", layers_request(job.options.layers)}};
  }
  if (dataset.views.size() < job.views.size()) {
    provenance["unfinished"] = std::to_string(dataset.views.size()) + " of " +
                               std::to_string(job.views.size()) +
                               " views; the command of the recipe continues";
  }
  dataset.provenance_json = provenance.dump();
  return manifest_text(dataset);
}

/// Renders the views that are not finished and writes each one's files. On return or by exception,
/// `finished` says what is there.
RunFigures render_views(const Job& job, const SweepFolder& folder, std::vector<char>& finished,
                        Console& console, const Monitor& monitor) {
  std::vector<std::size_t> open;
  for (std::size_t n = 0; n < finished.size(); ++n) {
    if (!finished[n]) open.push_back(n);
  }
  RunFigures figures;
  figures.n_reused = finished.size() - open.size();
  WarningList warnings;
  std::mutex mutex;
  // Progress is told in views: rows of several at once would be noise.
  const Monitor inside_view{nullptr, monitor.stop};
  const auto render_one = [&](std::size_t n) {
    monitor.check();
    const Products products = make_products(job, n, inside_view);
    const Stopwatch writing;
    AtomicFiles files(Durability::process);
    files.add(folder.png(n), products.png);
    files.add(folder.tiff(n), products.tiff);
    for (const LayerFile& layer : products.layers) files.add(folder.layer(n, layer.ending), layer.bytes);
    files.commit();
    const double write_s = writing.seconds();
    for (const std::string& text : products.warnings) warnings.add(job.views[n], n, text);
    const std::scoped_lock lock(mutex);
    finished[n] = 1;
    ++figures.n_rendered;
    figures.n_hits += products.n_hits;
    figures.trace_and_deposit_s += products.trace_and_deposit_s;
    figures.formation_s += products.formation_s;
    figures.encode_s += products.encode_s;
    figures.write_s += write_s;
    monitor.report("views", figures.n_rendered, open.size());
  };
  if (job.n_views_at_once > 1) {
    parallel_for(open.size(), 1, [&](std::size_t begin, std::size_t end, int) {
      for (std::size_t n = begin; n < end; ++n) render_one(open[n]);
    });
  } else {
    for (const std::size_t n : open) render_one(n);
  }
  warnings.print(console);
  return figures;
}

bool file_holds(const std::filesystem::path& path, const std::string& text) {
  std::ifstream in(path, std::ios::binary);
  return in && std::string{std::istreambuf_iterator<char>(in), {}} == text;
}

std::string progress_text(const std::vector<char>& finished) {
  return std::to_string(std::count(finished.begin(), finished.end(), 1)) + " of " +
         std::to_string(finished.size()) + " views are finished; the same command continues";
}

}  // namespace

void check_sweep(const Options& options, const Json& request) {
  const SweepFolder folder(sweep_folder(options), 2);
  std::error_code code;
  if (std::filesystem::exists(folder.path(), code) && !std::filesystem::is_directory(folder.path())) {
    throw UsageError(folder.path().string() +
                     ": expected a place for a folder, found a file; choose another -o");
  }
  require_possible(folder.path());
  for (const auto& path : {folder.recipe(), folder.manifest(), folder.report()}) {
    refuse_input(path, options);
  }
  if (options.overwrite || !folder.occupied()) return;
  const auto recipe = read_recipe(folder.recipe());
  if (!recipe) refuse(folder.path(), "files without a recipe");
  const std::string differs = difference(recipe->value("request", Json()), request);
  if (!differs.empty()) refuse(folder.path(), differs);
}

std::string write_sweep(Job& job, const Json& request, const Stopwatch& total, Console& console,
                        const Monitor& monitor) {
  const SweepFolder folder(sweep_folder(job.options), job.views.size());
  for (std::size_t n = 0; n < job.views.size(); ++n) job.views[n].image = folder.image_name(n);
  const Json recipe = make_recipe(request, resolved_of(job));
  const std::string result = folder.manifest().string() + "\n";

  make_folder(folder.path());
  const FolderLock lock(folder.path());
  folder.remove_temporary_files();
  std::vector<char> finished(job.views.size(), 0);
  const auto found = read_recipe(folder.recipe());
  if (found && !job.options.overwrite) {
    const std::string differs = difference(*found, recipe);
    if (!differs.empty()) refuse(folder.path(), differs);
    folder.create(!job.options.layers.empty());
    finished = finished_views(folder, job);
  } else {
    folder.clear();
    folder.create(!job.options.layers.empty());
    write_file_atomically(folder.recipe(), recipe_text(recipe));
  }

  const auto n_before = std::count(finished.begin(), finished.end(), 1);
  const bool all_before = static_cast<std::size_t>(n_before) == finished.size();
  const std::string complete = manifest_of(job, recipe, std::vector<char>(finished.size(), 1));
  if (all_before && file_holds(folder.manifest(), complete)) {
    console.note("already done: all " + std::to_string(n_before) +
                 " views of the same recipe are there, nothing was rendered");
    return result;
  }
  if (n_before > 0) console.note("continuing: " + std::to_string(n_before) + " of " +
                                  std::to_string(finished.size()) + " views are there");

  RunFigures figures;
  try {
    figures = render_views(job, folder, finished, console, monitor);
  } catch (const Interrupted&) {
    if (std::count(finished.begin(), finished.end(), 1) > 0) {
      write_file_atomically(folder.manifest(), manifest_of(job, recipe, finished));
    }
    throw Interrupted("interrupted: " + progress_text(finished));
  } catch (const Error&) {
    console.note(progress_text(finished));
    throw;
  }
  figures.total_s = total.seconds();
  console.detail(summary(figures));
  write_file_atomically(folder.report(), report_text(job, figures), Durability::process);
  write_file_atomically(folder.manifest(), complete);
  return result;
}

}  // namespace sarnerf::app

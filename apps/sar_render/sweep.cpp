// SPDX-License-Identifier: Apache-2.0
#include "sweep.h"

#include <algorithm>
#include <cctype>
#include <optional>
#include <vector>

#include <nlohmann/json.hpp>

#include "options.h"
#include "output_files.h"
#include "output_lock.h"
#include "products.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/files.h"
#include "sarnerf/core/parallel.h"
#include "sarnerf/core/text.h"
#include "sarnerf/dataset/image_file.h"

namespace sarnerf::app {

namespace {

/// The text without its figures: warnings that differ in nothing else are of one kind.
std::string without_figures(std::string text) {
  std::erase_if(text, [](unsigned char c) { return std::isdigit(c) || c == '.' || c == '-' || c == '+' || c == 'e'; });
  return text;
}

}  // namespace

void WarningList::add(const ViewAngles& view, std::size_t index, const std::string& text) {
  const std::scoped_lock lock(mutex_);
  Entry& entry = entries_[without_figures(text)];
  if (entry.n_views++ == 0 || index < entry.first) {
    entry.first = index;
    entry.text = text;
    entry.incidence_deg = view.incidence_deg;
    entry.azimuth_deg = view.azimuth_deg;
  }
}

void WarningList::print(Console& console) const {
  constexpr std::size_t kMostLines = 5;
  std::vector<const Entry*> by_view;
  for (const auto& [kind, entry] : entries_) by_view.push_back(&entry);
  std::stable_sort(by_view.begin(), by_view.end(),
                   [](const Entry* a, const Entry* b) { return a->first < b->first; });
  std::size_t n = 0;
  for (const Entry* entry : by_view) {
    char place[120];
    std::snprintf(place, sizeof place, "%s, first at incidence %.6g, azimuth %.6g deg: ",
                  counted(entry->n_views, "view").c_str(), entry->incidence_deg, entry->azimuth_deg);
    console.warning(place + entry->text);
    if (++n == kMostLines && by_view.size() > kMostLines) {
      console.warning("and " + counted(by_view.size() - kMostLines, "kind") + " of warnings more");
      break;
    }
  }
}

namespace {

/// Calls work(n) for n in [0, count): one view per thread if memory suffices for that, else one view at a time with
/// all threads.
template <class Work>
void for_each_view(const Job& job, std::size_t count, const Work& work) {
  if (job.n_views_at_once <= 1) {
    for (std::size_t n = 0; n < count; ++n) work(n);
    return;
  }
  parallel_for(count, 1, [&](std::size_t begin, std::size_t end, int) {
    for (std::size_t n = begin; n < end; ++n) work(n);
  });
}

}  // namespace

SweepRun::SweepRun(const Job& job, const SweepFolder& folder)
    : job_(job), folder_(folder), checksums_(folder.checksums()), finished_(job.views.size(), 0) {
  parallel_for(finished_.size(), 8, [&](std::size_t begin, std::size_t end, int) {
    for (std::size_t n = begin; n < end; ++n) {
      const auto files = files_of(n);
      finished_[n] = std::all_of(files.begin(), files.end(),
                                 [&](const std::string& name) { return checksums_.whole(name); });
    }
  });
  n_open_ = finished_.size() - n_finished();
  figures_.n_reused = n_finished();
  const auto samples = DisplayScale::sample_views(finished_.size());
  if (std::all_of(samples.begin(), samples.end(), [&](std::size_t n) { return finished_[n] != 0; })) {
    find_display({});
  }
}

std::size_t SweepRun::n_finished() const {
  return static_cast<std::size_t>(std::count(finished_.begin(), finished_.end(), 1));
}

std::vector<std::string> SweepRun::files_of(std::size_t view) const {
  std::vector<std::string> names{folder_.image_name(view), folder_.png_name(view)};
  for (const std::string& ending : layer_endings(job_.options.layers)) {
    names.push_back(folder_.layer_name(view, ending));
  }
  return names;
}

void SweepRun::find_display(const Monitor& monitor) {
  const std::vector<std::size_t> samples = DisplayScale::sample_views(finished_.size());
  std::vector<float> whites(samples.size());
  for_each_view(job_, samples.size(), [&](std::size_t s) {
    const std::size_t n = samples[s];
    if (finished_[n]) {
      whites[s] = white_level(read_image(folder_.tiff(n)));
      return;
    }
    Products products = render_view(n, monitor);
    whites[s] = white_level(products.image);
    const std::scoped_lock lock(mutex_);
    held_.emplace(n, std::move(products));
  });
  display_.emplace(whites);
}

Products SweepRun::render_view(std::size_t view, const Monitor& monitor) const {
  monitor.check();
  // Progress is reported in views: rows of several views at once would be confusing.
  return make_products(job_, view, Monitor{nullptr, monitor.stop});
}

void SweepRun::write(std::size_t view, Products products, const Monitor& monitor) {
  const Stopwatch drawing;
  const std::vector<std::byte> picture = make_picture(products.image, job_.options.quantity, *display_);
  const std::vector<LayerFile> layers = layer_files(products, job_.options, *display_);
  products.encode_s += drawing.seconds();

  const Stopwatch writing;
  std::vector<Checksums::File> files{{folder_.png_name(view), picture}, {folder_.image_name(view), products.tiff}};
  for (const LayerFile& layer : layers) files.push_back({folder_.layer_name(view, layer.ending), layer.bytes});
  write_view_files(folder_, files, checksums_);
  const double write_s = writing.seconds();

  for (const std::string& text : products.warnings) warnings_.add(angles_of(job_, view), view, text);
  const std::scoped_lock lock(mutex_);
  finished_[view] = 1;
  sarnerf::app::add(products, figures_);
  figures_.write_s += write_s;
  monitor.report("views", figures_.n_rendered, n_open_);
}

RunFigures SweepRun::render(Console& console, const Monitor& monitor) {
  if (!display_) find_display(monitor);
  std::vector<std::size_t> open;
  for (std::size_t n = 0; n < finished_.size(); ++n) {
    if (!finished_[n]) open.push_back(n);
  }
  for_each_view(job_, open.size(), [&](std::size_t o) {
    const auto held = held_.find(open[o]);
    // Moved out without erasing: other threads read the same map.
    write(open[o], held != held_.end() ? std::move(held->second) : render_view(open[o], monitor), monitor);
  });
  held_.clear();
  checksums_.finish();
  warnings_.print(console);
  return figures_;
}

namespace {

std::string manifest_of(const Job& job, const SweepFolder& folder, const Json& recipe, const std::vector<char>& images,
                        const std::optional<DisplayScale>& display) {
  Dataset dataset;
  dataset.quantity = job.options.quantity;
  dataset.calibration = job.options.calibration;
  dataset.aim_m = job.aim_m;
  for (std::size_t n = 0; n < job.views.size(); ++n) {
    if (images[n]) dataset.views.push_back(manifest_view(job, n, folder.image_name(n)));
  }
  dataset.scene_box_m = scene_box_of_swath(job.aim_m, dataset.views);
  const ImageFormation& formation = job.options.formation;
  if (formation.resolution_m)
    dataset.resolution = Resolution{formation.resolution_m->first, formation.resolution_m->second, formation.window};
  Json provenance;
  provenance["program"] = recipe.at("program");
  provenance["recipe"] = "recipe.json";
  provenance["scene"] = recipe.at("request").at("scene");
  if (job.options.formation.any()) provenance["formation"] = recipe.at("request").at("formation");
  if (!job.options.layers.empty()) {
    provenance["layers"] = {{"folder", "layers"}, {"names", layers_request(job.options.layers)}};
  }
  if (display) provenance["display"] = display->text(job.options.quantity);
  if (dataset.views.size() < job.views.size()) dataset.n_planned_views = job.views.size();
  dataset.exact_poses = true;
  dataset.provenance_json = provenance.dump();
  return manifest_text(dataset);
}

bool file_holds(const std::filesystem::path& path, const std::string& text) {
  try {
    return read_whole_file(path) == text;
  } catch (const InputError&) {
    return false;
  }
}

std::string progress_text(const SweepRun& run) {
  return std::to_string(run.n_finished()) + " of " + counted(run.finished().size(), "view") +
         (run.n_finished() == 1 ? " is" : " are") + " finished; the same command continues";
}

}  // namespace

void check_sweep(const Options& options, const Json& request) {
  const SweepFolder folder(sweep_folder(options), 2, layer_endings(all_layers()));
  for (const auto& path : {folder.recipe(), folder.manifest(), folder.report()}) {
    refuse_input(path, options);
  }
  require_sweep_place(folder, request, options.overwrite);
}

std::string write_sweep(const Job& job, const Json& request, const Stopwatch& total, Console& console,
                        const Monitor& monitor) {
  const SweepFolder folder(sweep_folder(job.options), job.views.size(), layer_endings(all_layers()));
  const Json recipe = make_recipe(kProgram, request, resolved_of(job));
  const std::string result = folder.manifest().string() + "\n";

  make_folder(folder.path());
  const FolderLock lock(folder.path());
  folder.remove_temporary_files();
  take_sweep_place(folder, recipe, job.options.overwrite);
  folder.create(!job.options.layers.empty());

  SweepRun run(job, folder);
  const std::size_t n_views = job.views.size(), n_before = run.n_finished();
  const auto manifest = [&] { return manifest_of(job, folder, recipe, run.finished(), run.display()); };
  if (n_before == n_views && file_holds(folder.manifest(), manifest())) {
    console.note("already done: all " + counted(n_views, "view") +
                 " of the same recipe are there, nothing was rendered");
    return result;
  }
  if (n_before > 0) {
    console.note("continuing: " + std::to_string(n_before) + " of " + counted(n_views, "view") +
                 (n_before == 1 ? " is there" : " are there"));
  }

  RunFigures figures;
  try {
    figures = run.render(console, monitor);
  } catch (const Interrupted&) {
    if (run.n_finished() > 0) write_file_atomically(folder.manifest(), manifest());
    throw Interrupted("interrupted: " + progress_text(run));
  } catch (const Error&) {
    console.note(progress_text(run));
    throw;
  }
  figures.total_s = total.seconds();
  console.detail(summary(figures));
  write_file_atomically(folder.report(), report_text(job, figures), Durability::process);
  write_file_atomically(folder.manifest(), manifest());
  const std::string error = error_line(figures);
  console.note("finished: " + counted(n_views, "view") + (error.empty() ? "" : "; " + error));
  return result;
}

}  // namespace sarnerf::app

// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <mutex>
#include <set>

#include "version.h"
#include <nlohmann/json.hpp>

#include "job.h"
#include "output_files.h"
#include "output_lock.h"
#include "process.h"
#include "recipe_file.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/files.h"
#include "sarnerf/core/parallel.h"
#include "sarnerf/core/text.h"
#include "sarnerf/dataset/image_file.h"
#include "sarnerf/dataset/manifest.h"
#include "sarnerf/dataset/phoenix.h"
#include "sarnerf/dataset/posed_image.h"

namespace sarnerf::app {

namespace {

template <class Value>
Json or_none(const std::optional<Value>& value) {
  return value ? Json(*value) : Json("none");
}

Json request_of(const Options& o) {
  const Selection& s = o.selection;
  Json j{{"command", name(o.command)}};
  j["choice"] = {
      {"class", s.class_name.empty() ? "any" : s.class_name},
      {"depression_deg", s.depression_deg.empty() ? Json("any") : Json(s.depression_deg)},
      {"every_deg", or_none(s.every_deg)},
      {"crop", or_none(s.crop)}};
  j["slant_range_m"] = o.slant_range_m;
  if (o.command == Command::images) {
    j["images"] = {{"scale", o.scale},
                   {"quantity", name(o.quantity)},
                   {"orientation", name(o.orientation)},
                   {"spacing_m", or_none(o.spacing_m)}};
    if (!o.table.empty())
      j["images"]["table"] = {{"file", o.table.filename().string()},
                              {"sha256", sha256_of_file(o.table)}};
  }
  return valid_text(j);
}

}  // namespace

Json recipe_of(const Options& o, const std::vector<Source>& chosen, const Monitor& monitor) {
  std::vector<std::string> digests(chosen.size());
  parallel_for(chosen.size(), 4, [&](std::size_t begin, std::size_t end, int) {
    for (std::size_t n = begin; n < end; ++n) {
      monitor.check();
      digests[n] = sha256_of_file(chosen[n].file);
    }
  });
  Json files = Json::object();
  for (std::size_t n = 0; n < chosen.size(); ++n)
    files[std::to_string(n)] = {{"file", chosen[n].file.filename().string()},
                                {"sha256", digests[n]}};
  return make_recipe(kProgram, request_of(o), {{"files", files}});
}

std::string report_text(const Options& o, const Choice& choice, std::size_t n_written) {
  const Json j{{"format", "sarnerf-report"},
               {"version", 1},
               {"program", std::string(kProgram) + " " + std::string(kVersion)},
               {"threads", o.shared.n_threads},
               {"images", {{"chosen", choice.chosen.size()}, {"written", n_written}}},
               {"left_out", choice.left_out},
               {"seconds", {{"total", seconds_since_start()}}},
               {"machine", {{"processor", processor_name()}}},
               {"memory_bytes", {{"peak", peak_memory_bytes()}}}};
  return j.dump(2) + "\n";
}

namespace {

template <class... Values>
std::string line(const char* format, Values... values) {
  char text[400];
  std::snprintf(text, sizeof text, format, values...);
  return text;
}

/// "least" or "least to most", of a property of the images.
template <class Of>
std::string span_text(const std::vector<Source>& sources, const char* format, Of of) {
  const auto [least, most] =
      std::minmax_element(sources.begin(), sources.end(),
                          [&](const Source& a, const Source& b) { return of(a) < of(b); });
  const std::string from = line(format, of(*least)), to = line(format, of(*most));
  return from == to ? from : from + " to " + to;
}

/// Describes the sources [begin, end): one set, sorted by azimuth.
std::string set_line(const std::vector<Source>& all, std::size_t begin, std::size_t end) {
  const DatasetView& first = all[begin].chip.view;
  const std::vector<Source> set(all.begin() + static_cast<std::ptrdiff_t>(begin),
                                all.begin() + static_cast<std::ptrdiff_t>(end));
  double widest_deg = 0.0, after_deg = 0.0;
  for (std::size_t n = 0; n < set.size(); ++n) {
    const double from = set[n].chip.view.azimuth_deg,
                 to = set[(n + 1) % set.size()].chip.view.azimuth_deg;
    const double gap = n + 1 < set.size() ? to - from : to + 360.0 - from;
    if (gap > widest_deg) widest_deg = gap, after_deg = from;
  }
  const std::string name = (first.class_name.empty() ? "no class" : first.class_name) +
                           (first.serial.empty() ? "" : " " + first.serial);
  return line("  %-16s %zu image%s, depression %g deg (%s), azimuth %s deg", name.c_str(),
              set.size(), set.size() == 1 ? "" : "s", set.front().chip.nominal_depression_deg,
              set.front().chip.depression_is_nominal
                  ? "nominal"
                  : ("measured " +
                     span_text(set, "%.2f",
                               [](const Source& s) { return s.chip.view.depression_deg(); }))
                        .c_str(),
              span_text(set, "%.2f", [](const Source& s) { return s.chip.view.azimuth_deg; })
                  .c_str()) +
         line(", widest gap %.2f deg after %.2f\n", widest_deg, after_deg);
}

}  // namespace

std::string summary_text(const Choice& choice) {
  const std::vector<Source>& all = choice.chosen;
  std::string text;
  for (std::size_t begin = 0, end = 0; begin < all.size(); begin = end) {
    while (end < all.size() && same_set(all[begin], all[end])) ++end;
    text += set_line(all, begin, end);
  }
  const auto of_view = [](auto member) {
    return [member](const Source& s) { return s.chip.view.*member; };
  };
  text += "  size             " + span_text(all, "%d", of_view(&DatasetView::n_azimuth)) + " x " +
          span_text(all, "%d", of_view(&DatasetView::n_range)) + " pixels (azimuth x range)\n";
  text += "  spacing          " + span_text(all, "%.6g", of_view(&DatasetView::azimuth_spacing_m)) +
          " m azimuth, " + span_text(all, "%.6g", of_view(&DatasetView::range_spacing_m)) +
          " m slant range\n";
  if (const auto r = common_resolution(all))
    text += format("  resolution       %.6g m azimuth, %.6g m slant range, window %s\n", r->azimuth_m, r->range_m, text_of(r->window).c_str());
  const auto n_assumed = std::count_if(all.begin(), all.end(),
                                       [](const Source& s) { return s.chip.range_is_assumed; });
  text +=
      "  slant range      " + span_text(all, "%.6g", of_view(&DatasetView::slant_range_m)) + " m";
  if (n_assumed > 0)
    text += ", assumed for " + std::to_string(n_assumed) + " of " + std::to_string(all.size()) +
            " (--slant-range)";
  text += "\n";
  for (const std::string& why : choice.left_out) text += "  left out         " + why + "\n";
  return text;
}

std::string plan_text(const Options& o, const Choice& choice) {
  const char* const reading =
      o.command == Command::images && o.orientation == Orientation::radar
          ? "rows are azimuth, columns slant range, near to far"
          : "rows from far to near range, columns against the rows of azimuth; not mirrored";
  return "plan\n  images           " + std::to_string(choice.chosen.size()) + "\n" +
         summary_text(choice) + "  read as          " + reading + "\n  output           " +
         o.output.string() + "/\n";
}

namespace {

/// Writes the views into the folder.
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

  /// Writes the missing images.
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

  /// The manifest of the finished views.
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
    write_view_files(folder_, {{folder_.png_name(n), png}, {folder_.image_name(n), tiff}}, checksums_);
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

/// An image of an earlier dataset would be replaced before it is read.
void refuse_own_images(const SweepFolder& folder, const std::vector<Source>& chosen) {
  for (const Source& source : chosen)
    for (const std::filesystem::path& own : {folder.images(), folder.pngs(), folder.layers()}) {
      std::error_code none;
      if (std::filesystem::equivalent(source.file.parent_path(), own, none))
        throw UsageError(source.file.string() + " lies in the output " + folder.path().string() + ", which would replace it; choose another -o");
    }
}

}  // namespace

std::string write_dataset(const Options& o, const Choice& choice, Console& console,
                          const Monitor& monitor) {
  refuse_input(o.output, o.inputs);
  refuse_inside(o.output, o.inputs);
  const SweepFolder folder(o.output, choice.chosen.size());
  refuse_own_images(folder, choice.chosen);
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
  if (import.n_before() == choice.chosen.size() && folder.described(choice.chosen.size())) {
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

namespace {

std::string chip_name(std::size_t n) {
  char text[40];
  std::snprintf(text, sizeof text, "chip_%03zu.phoenix", n);
  return text;
}

/// Whether the name is chip_name()'s of some number.
bool is_chip(const std::filesystem::path& path) { return is_numbered(path, "chip_", ".phoenix"); }

std::vector<std::byte> chip_bytes(const Options& o, const Dataset& dataset, std::size_t n,
                                  const Monitor& monitor) {
  Image<float> amplitude =
      std::move(load_images(o.inputs.front(), dataset, {&n, 1}, monitor).front().power);
  take_amplitude(amplitude);
  DatasetView view = dataset.views[n];
  if (view.source.empty()) view.source = view.image;
  PhoenixChip chip = phoenix_of(view, amplitude);
  chip.resolution = dataset.resolution;
  return encode_phoenix(chip);
}

}  // namespace

std::string write_phoenix_chips(const Options& o, Console& console, const Monitor& monitor) {
  const Dataset dataset = read_manifest(o.inputs.front());
  const std::size_t n_views = dataset.views.size();
  if (o.explain) {
    const std::string plan = "plan\n  chips            " + std::to_string(n_views) + " of " +
                             o.inputs.front().string() + "\n  pixels           amplitude, " +
                             std::string(name(dataset.calibration)) +
                             ", phases 0\n  output           " + o.output.string() + "/\n";
    if (o.dry_run) return plan;
    console.asked_for(plan);
  }
  const std::filesystem::path recipe_path = o.output / "recipe.json";
  const Json recipe =
      make_recipe(kProgram,
                  {{"command", name(o.command)},
                   {"dataset_sha256", dataset_fingerprint(o.inputs.front(), dataset, monitor)}},
                  Json::object());
  refuse_input(o.output, o.inputs);
  refuse_inside(o.output, o.inputs);
  require_possible(o.output);
  std::error_code ignored;
  if (std::filesystem::exists(o.output / kManifestName, ignored)) refuse_place(o.output, "a dataset");
  make_folder(o.output);
  const FolderLock lock(o.output);
  const std::filesystem::path list = o.output / "SHA256SUMS";
  if (o.overwrite || !holds_recipe(recipe_path, recipe, list)) {
    for (const std::filesystem::path& file : {o.output / chip_name(0), recipe_path, list})
      if (!o.overwrite && std::filesystem::exists(file, ignored))
        refuse_place(o.output, file.filename().string() + ", which no such command made");
    // By the old list, chips of another recipe would pass as intact.
    std::filesystem::remove(list);
    remove_files(o.output, is_chip);
    write_recipe(recipe_path, recipe, list);
  }

  Checksums checksums(list);
  std::size_t n_written = 0;
  for (std::size_t n = 0; n < n_views; ++n) {
    monitor.check();
    if (!checksums.whole(chip_name(n))) {
      const std::vector<std::byte> bytes = chip_bytes(o, dataset, n, monitor);
      AtomicFiles files(Durability::process);
      files.add(o.output / chip_name(n), bytes);
      files.commit();
      checksums.add({{chip_name(n), bytes}});
      ++n_written;
    }
    monitor.report("chips", n + 1, n_views);
  }
  checksums.finish();
  console.note(n_written > 0   ? "finished: " + counted(n_views, "chip")
               : n_views == 1 ? "already done: the chip is there, nothing was written"
                              : "already done: all " + counted(n_views, "chip") + " are there, nothing was written");
  const std::string names = n_views == 1 ? chip_name(0) : chip_name(0) + " to " + chip_name(n_views - 1);
  return o.output.string() + "/\n  " + counted(n_views, "Phoenix chip") + ", " + names + "\n";
}

}  // namespace sarnerf::app

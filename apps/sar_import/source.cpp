// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <map>
#include <mutex>
#include <set>
#include <tuple>

#include "job.h"
#include "process.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/files.h"
#include "sarnerf/core/parallel.h"
#include "sarnerf/core/text.h"
#include "sarnerf/dataset/image_file.h"
#include "sarnerf/dataset/image_index.h"
#include "sarnerf/dataset/posed_image.h"
#include "values.h"

namespace sarnerf::app {

namespace {

namespace fs = std::filesystem;

/// Recognises Phoenix files by their first bytes: their endings are arbitrary (in MSTAR, a number for each file).
bool is_phoenix(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::string head(kPhoenixHeadBytes, '\0');
  return file.read(head.data(), kPhoenixHeadBytes) && begins_as_phoenix(head);
}

bool is_wanted(Command command, const fs::path& path) {
  return command == Command::sample ? path.extension() == ".mat" : is_phoenix(path);
}

/// The files that are named, and the matching files in the folders that are named.
std::vector<fs::path> chip_files(const Options& o, Console& console, const Monitor& monitor) {
  std::vector<fs::path> files;
  std::size_t n_others = 0;
  for (const fs::path& input : o.inputs) {
    std::error_code code;
    if (!fs::is_directory(input, code)) {
      files.push_back(input);
      continue;
    }
    walk_folder(input, [&](const fs::directory_entry& entry) {
      monitor.check();
      if (entry.is_regular_file(code)) {
        if (is_wanted(o.command, entry.path()))
          files.push_back(entry.path());
        else
          ++n_others;
      }
      return true;
    });
  }
  // A folder may be given twice, by two spellings or by a link.
  std::map<fs::path, fs::path> by_place;
  for (const fs::path& file : files) by_place.emplace(fs::weakly_canonical(file), file);
  files.clear();
  for (const auto& [place, file] : by_place) files.push_back(file);
  std::sort(files.begin(), files.end());
  if (n_others > 0)
    console.note("passed over, of another kind: " + counted(n_others, "file"));
  return files;
}

Chip read_chip(const Options& o, const fs::path& file) {
  return o.command == Command::sample ? read_sample(file, o.slant_range_m)
                                      : chip_of(read_phoenix(file), o.slant_range_m);
}

/// Calls work(n) for n in [0, count), on all threads, with progress.
template <class Work>
void for_each_file(std::size_t count, const char* stage, const Monitor& monitor, const Work& work) {
  std::mutex mutex;
  std::size_t n_done = 0;
  parallel_for(count, 1, [&](std::size_t begin, std::size_t end, int) {
    for (std::size_t n = begin; n < end; ++n) {
      monitor.check();
      work(n);
      const std::scoped_lock lock(mutex);
      monitor.report(stage, ++n_done, count);
    }
  });
}

std::vector<Source> chip_sources(const Options& o, Console& console, const Monitor& monitor) {
  const std::vector<fs::path> files = chip_files(o, console, monitor);
  std::vector<Source> sources(files.size());
  for (std::size_t n = 0; n < files.size(); ++n) sources[n].file = files[n];
  refuse_beyond_memory(o, sources);
  for_each_file(files.size(), "reading", monitor, [&](std::size_t n) {
    Chip chip = read_chip(o, files[n]);
    chip.image = {};
    sources[n] = {files[n], std::move(chip), ""};
  });
  return sources;
}

PictureRule rule_of(const Options& o) {
  PictureRule rule{o.slant_range_m, o.spacing_m, o.scale};
  if (o.orientation == Orientation::radar) rule.axes = {Axis::plus_i, Axis::plus_j};
  return rule;
}

std::vector<Source> picture_sources(const Options& o, Console& console) {
  const fs::path& folder = o.inputs.front();
  const auto pictures = image_files(folder);
  const auto indexed = o.table.empty() ? index_by_names(folder) : read_image_index(o.table, folder);
  if (!o.table.empty() && indexed.size() < pictures.size())
    console.note(std::to_string(pictures.size() - indexed.size()) + " of " + counted(pictures.size(), "image") + " in " +
                 folder.string() + " not in the table: passed over");
  std::vector<Source> sources;
  for (const IndexedImage& image : indexed) sources.push_back({image.file, chip_of(image, rule_of(o)), image.split});
  return sources;
}

Chip load_picture(const Options& o, const Source& source) {
  Chip chip = source.chip;
  read_pixels(chip, source.file, rule_of(o));
  return chip;
}

}  // namespace

std::vector<Source> find_sources(const Options& o, Console& console, const Monitor& monitor) {
  auto sources = o.command == Command::images ? picture_sources(o, console)
                                              : chip_sources(o, console, monitor);
  if (sources.empty())
    throw InputError(o.inputs.front().string() + ": expected " +
                     (o.command == Command::images   ? "images"
                      : o.command == Command::sample ? "SAMPLE files (.mat)"
                                                     : "Phoenix chips") +
                     ", found none");
  return sources;
}

void refuse_beyond_memory(const Options& o, const std::vector<Source>& sources) {
  // Memory of each thread: the file, its decoded data, the image before and after its axes are changed, and the
  // output: a file, its copy, and the picture.
  constexpr std::uint64_t kBase = 64ull << 20, kBytesPerPixel = 24;
  std::uint64_t largest = 0;
  const Source* worst = nullptr;
  for (const Source& s : sources) {
    std::uint64_t bytes = regular_file_size(s.file);
    if (o.command == Command::images) {
      const ImageSize size = read_image_size(s.file);
      bytes += size.decoded_bytes + kBytesPerPixel * size.n_rows * size.n_columns;
    } else {
      bytes *= 8;  // pixels of 8 bytes at worst, and as much again for the image
    }
    if (worst != nullptr && bytes <= largest) continue;
    largest = bytes;
    worst = &s;
  }
  const MemoryLimit limit = memory_limit(o.shared);
  const std::uint64_t n_threads = std::min<std::uint64_t>(static_cast<std::uint64_t>(o.shared.n_threads), sources.size());
  const std::uint64_t needed = kBase + n_threads * largest;
  if (worst == nullptr || limit.allows(needed)) return;
  throw UsageError(worst->file.string() + ": about " + bytes_text(needed) + " are needed for images of this size on " +
                   counted(n_threads, "thread") + ", " + limit.text() +
                   (n_threads > 1 ? "; use fewer --threads or smaller images" : "; use smaller images"));
}

void read_sizes(const Options& o, std::vector<Source>& sources, const Monitor& monitor) {
  for_each_file(sources.size(), "checking", monitor, [&](std::size_t n) {
    const Chip chip = load(o, sources[n]);
    sources[n].chip.view = chip.view;
    try {
      validate(acquisition_of(chip.view, glm::dvec3(0.0)));
    } catch (const GeometryError& e) {
      throw InputError(sources[n].file.string() +
                       ": no radar image can be of this geometry: " + e.what());
    }
  });
}

Chip load(const Options& o, const Source& source) {
  Chip chip = o.command == Command::images ? load_picture(o, source) : read_chip(o, source.file);
  // Keeps what choose() has set, such as a depression from the command line.
  DatasetView view = source.chip.view;
  view.n_azimuth = chip.view.n_azimuth;
  view.n_range = chip.view.n_range;
  chip.view = view;
  if (!o.selection.crop) return chip;
  return cropped(std::move(chip), o.selection.crop->first, o.selection.crop->second,
                 source.file.string());
}

std::optional<Resolution> common_resolution(std::span<const Source> sources) {
  if (sources.empty()) return {};
  for (const Source& source : sources)
    if (source.chip.resolution != sources.front().chip.resolution) return {};
  return sources.front().chip.resolution;
}

namespace {

/// A set of nominal 17° contains images measured at 16.6° and 17.4°.
constexpr double kNominal_deg = 0.5;

/// Headers give six decimals; azimuths closer than this are the same direction.
constexpr double kSameAzimuth_deg = 1e-3;

auto order(const Source& s) {
  const DatasetView& v = s.chip.view;
  return std::tie(v.class_name, v.serial, s.chip.nominal_depression_deg, v.azimuth_deg, s.file);
}

std::string number(double value) {
  char text[40];
  std::snprintf(text, sizeof text, "%.6g", value);
  return text;
}

/// "2S1, T72": the distinct values of a property, for messages.
template <class Of>
std::string names(const std::vector<Source>& sources, Of of) {
  std::set<std::string> all;
  for (const Source& s : sources) all.insert(of(s));
  std::string text;
  for (const std::string& one : all)
    text += (text.empty() ? "" : ", ") + (one.empty() ? "(none)" : one);
  return in_one_line(text, 400);
}

/// Keeps the sources that pass, and records how many did not.
template <class Keep>
void keep_if(Choice& choice, const std::string& why, Keep keep) {
  const auto n = std::erase_if(choice.chosen, [&](const Source& s) { return !keep(s); });
  if (n > 0)
    choice.left_out.push_back(counted(static_cast<std::uint64_t>(n), "image") + ": " + why);
}

void take_class(Choice& choice, const std::string& wanted) {
  if (wanted.empty()) return;
  const std::string there =
      names(choice.chosen, [](const Source& s) { return s.chip.view.class_name; });
  for (Source& s : choice.chosen)
    if (s.chip.view.class_name.empty()) s.chip.view.class_name = wanted;
  keep_if(choice, "of another class than " + wanted,
          [&](const Source& s) { return s.chip.view.class_name == wanted; });
  if (choice.chosen.empty())
    throw UsageError("--class " + wanted + ": there is none; the classes are " + there);
}

void take_depression(Choice& choice, const std::vector<double>& wanted_deg) {
  for (Source& s : choice.chosen) {
    if (s.chip.nominal_depression_deg > 0.0) continue;
    if (wanted_deg.size() != 1)
      throw UsageError(
          s.file.string() +
          ": the depression is not known; give one, such as --depression 17, or a table "
          "with depression_deg");
    s.chip.nominal_depression_deg = wanted_deg.front();
    s.chip.view.incidence_deg = 90.0 - wanted_deg.front();
  }
  if (wanted_deg.empty()) return;
  const std::string there =
      names(choice.chosen, [](const Source& s) { return number(s.chip.nominal_depression_deg); });
  keep_if(choice, "of another nominal depression", [&](const Source& s) {
    return std::any_of(wanted_deg.begin(), wanted_deg.end(), [&](double d) {
      return std::abs(d - s.chip.nominal_depression_deg) <= kNominal_deg;
    });
  });
  if (choice.chosen.empty())
    throw UsageError("--depression: there is no such image; the depressions are " + there);
}

/// Marks the images of one set that are nearest to the grid.
void mark_nearest(const std::vector<Source>& set, std::size_t begin, std::size_t end,
                  double step_deg, std::vector<char>& taken) {
  const auto n_azimuths = static_cast<int>(std::ceil(360.0 / step_deg - 1e-9));
  for (int n = 0; n < n_azimuths; ++n) {
    const double azimuth_deg = n * step_deg;
    std::size_t best = end;
    double best_deg = 0.5 * step_deg;
    for (std::size_t s = begin; s < end; ++s) {
      const double distance_deg = apart_deg(set[s].chip.view.azimuth_deg, azimuth_deg);
      if (taken[s] || distance_deg > best_deg || (best != end && distance_deg == best_deg))
        continue;
      best = s;
      best_deg = distance_deg;
    }
    if (best != end) taken[best] = 1;
  }
}

void take_every(Choice& choice, double step_deg) {
  const std::vector<Source>& all = choice.chosen;
  std::vector<char> taken(all.size(), 0);
  for (std::size_t begin = 0, end = 0; begin < all.size(); begin = end) {
    while (end < all.size() && same_set(all[begin], all[end])) ++end;
    mark_nearest(all, begin, end, step_deg, taken);
  }
  std::vector<Source> kept;
  for (std::size_t n = 0; n < all.size(); ++n)
    if (taken[n]) kept.push_back(all[n]);
  if (kept.size() < all.size())
    choice.left_out.push_back(counted(all.size() - kept.size(), "image") + ": not the nearest to an azimuth of every " +
                              number(step_deg) + " deg");
  choice.chosen = std::move(kept);
}

}  // namespace

bool same_set(const Source& a, const Source& b) {
  return a.chip.view.class_name == b.chip.view.class_name &&
         a.chip.view.serial == b.chip.view.serial &&
         a.chip.nominal_depression_deg == b.chip.nominal_depression_deg;
}

double apart_deg(double a_deg, double b_deg) {
  const double d = std::abs(std::fmod(b_deg - a_deg, 360.0));
  return std::min(d, 360.0 - d);
}

Choice choose(std::vector<Source> sources, const Selection& selection) {
  Choice choice{std::move(sources), {}};
  take_class(choice, selection.class_name);
  take_depression(choice, selection.depression_deg);
  std::sort(choice.chosen.begin(), choice.chosen.end(),
            [](const Source& a, const Source& b) { return order(a) < order(b); });
  if (selection.every_deg) take_every(choice, *selection.every_deg);
  return choice;
}

std::string duplicates_text(const std::vector<Source>& chosen) {
  std::size_t n_pairs = 0;
  std::string example;
  for (std::size_t n = 1; n < chosen.size(); ++n) {
    const Source &a = chosen[n - 1], &b = chosen[n];
    if (!same_set(a, b) ||
        apart_deg(a.chip.view.azimuth_deg, b.chip.view.azimuth_deg) > kSameAzimuth_deg)
      continue;
    if (n_pairs++ == 0)
      example = a.file.filename().string() + " and " + b.file.filename().string() + " at " +
                number(a.chip.view.azimuth_deg) + " deg";
  }
  if (n_pairs == 0) return "";
  return std::to_string(n_pairs) +
         (n_pairs == 1 ? " pair of images has" : " pairs of images have") +
         " the same azimuth, such as " + example + "; all are kept";
}

}  // namespace sarnerf::app

// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <mutex>
#include <optional>
#include <random>
#include <span>
#include <tuple>

#include "chips.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/files.h"
#include "sarnerf/core/text.h"
#include "sarnerf/core/units.h"
#include "sarnerf/dataset/image_index.h"
#include "sarnerf/dataset/manifest.h"
#include "sarnerf/dataset/phoenix.h"

namespace sarnerf::app {

namespace {

/// Nominal depressions differ from measured ones by less than this.
constexpr double kSameDepression_deg = 0.75;

/// Side of the sectors of a validation; one of so many is tested.
constexpr double kSector_deg = 30.0;
constexpr int kFolds = 4;

/// The azimuth of a chip in [0°, 360°).
double circle_deg(const PosedImage& chip) { return within_circle_deg(azimuth_deg(chip)); }

bool is_near(double depression_deg, double wanted_deg) { return std::abs(depression_deg - wanted_deg) < kSameDepression_deg; }

/// A chip and its class.
struct ChipOfClass {
  std::string class_name;
  double depression_deg = 0.0;
  PosedImage image;
};

/// The chips that the options ask for.
struct ChipsFound {
  std::vector<ChipOfClass> chips;
  std::size_t n_other_depressions = 0;  ///< chips of these classes that were left out
};

/// Whether the options ask for chips of this class and depression. Counts those of their classes at other depressions.
bool is_wanted(const Options& o, const std::string& class_name, std::optional<double> depression_deg, ChipsFound& found) {
  if (class_name.empty() || !(o.classes.empty() || std::ranges::find(o.classes, class_name) != o.classes.end())) return false;
  if (depression_deg && is_near(*depression_deg, o.training_depression_deg)) return true;
  if (depression_deg && !o.validate && is_near(*depression_deg, o.test_depression_deg)) return true;
  ++found.n_other_depressions;
  return false;
}

ChipsFound chips_of_table(const Options& o, const Monitor& monitor) {
  const PictureRule rule{.spacing_m = o.spacing_m, .scale = o.scale};
  ChipsFound found;
  std::vector<IndexedImage> wanted;
  for (const IndexedImage& image : read_image_index(o.table, o.chips))
    if (is_wanted(o, image.class_name, image.depression_deg, found)) wanted.push_back(image);
  found.chips.resize(wanted.size());
  std::mutex mutex;
  std::size_t n_read = 0;
  parallel_for(wanted.size(), 8, [&](std::size_t begin, std::size_t end, int) {
    for (std::size_t n = begin; n < end; ++n) {
      monitor.check();
      Chip chip = chip_of(wanted[n], rule);
      read_pixels(chip, wanted[n].file, rule);
      for (float& value : chip.image.pixels()) value *= value;
      found.chips[n] = {wanted[n].class_name, *wanted[n].depression_deg,
                        {wanted[n].file.filename().string(), acquisition_of(chip.view, glm::dvec3(0.0)), std::move(chip.image)}};
      const std::scoped_lock lock(mutex);
      monitor.report("reading", ++n_read, wanted.size());
    }
  });
  return found;
}

/// Views of all datasets in the folder. A view without a class has that of the folder's subfolder that it lies in.
ChipsFound chips_of_datasets(const Options& o, Console& console, const Monitor& monitor) {
  std::vector<std::filesystem::path> folders;
  walk_folder(o.chips, [&](const std::filesystem::directory_entry& entry) {
    monitor.check();
    if (entry.path().filename() == kManifestName) folders.push_back(entry.path().parent_path());
    return true;
  });
  std::ranges::sort(folders);
  ChipsFound found;
  for (std::size_t f = 0; f < folders.size(); ++f) {
    const Dataset dataset = read_manifest(folders[f]);
    if (dataset.unfinished()) console.warning(folders[f].string() + ": " + unfinished_text(dataset));
    const std::string subfolder = std::filesystem::relative(folders[f], o.chips).begin()->string();
    if (subfolder == "." && std::ranges::any_of(dataset.views, [](const DatasetView& v) { return v.class_name.empty(); }))
      throw InputError((folders[f] / kManifestName).string() + ": expected a class of each view, or a place in a subfolder that is named after "
                       "its class, found neither; put the dataset into such a subfolder of FOLDER");
    const auto class_of = [&](const DatasetView& v) { return v.class_name.empty() ? subfolder : v.class_name; };
    std::vector<std::size_t> which;
    for (std::size_t n = 0; n < dataset.views.size(); ++n)
      if (is_wanted(o, class_of(dataset.views[n]), dataset.views[n].depression_deg(), found)) which.push_back(n);
    std::vector<PosedImage> images = load_images(folders[f], dataset, which, monitor);
    for (std::size_t n = 0; n < which.size(); ++n) {
      images[n].acquisition.aim_m = glm::dvec3(0.0);
      const DatasetView& view = dataset.views[which[n]];
      found.chips.push_back({class_of(view), view.depression_deg(), std::move(images[n])});
    }
    monitor.report("reading", f + 1, folders.size());
  }
  return found;
}

/// Cuts all chips to the size of the smallest, about the middle.
void cut_to_one_size(std::vector<ClassChips>& chips) {
  int n_azimuth = std::numeric_limits<int>::max(), n_range = n_azimuth;
  const auto each_chip = [&](const auto& visit) {
    for (ClassChips& c : chips)
      for (auto* list : {&c.training, &c.test})
        for (PosedImage& chip : *list) visit(chip);
  };
  each_chip([&](PosedImage& chip) {
    n_azimuth = std::min(n_azimuth, chip.acquisition.n_azimuth);
    n_range = std::min(n_range, chip.acquisition.n_range);
  });
  each_chip([&](PosedImage& chip) {
    Acquisition& a = chip.acquisition;
    if (a.n_azimuth == n_azimuth && a.n_range == n_range) return;
    chip.power = middle_of(chip.power, n_azimuth, n_range);
    a.n_azimuth = n_azimuth;
    a.n_range = n_range;
  });
}

/// Throws InputError for a class that cannot be the name of a file.
void require_file_name(const std::string& name, const std::filesystem::path& chips) {
  if (name == "." || name == ".." || name.find('/') != std::string::npos)
    throw InputError(format("%s: class %s: expected a name that a file can have, since classes have files of their own", chips.c_str(),
                            in_quotes(name).c_str()));
}

/// Throws InputError unless all chips have room for the largest crop, and one spacing.
void require_one_kind(const std::vector<ClassChips>& chips) {
  constexpr double kSameSpacing = 0.01;
  const Acquisition& first = chips.front().training.front().acquisition;
  for (const ClassChips& c : chips)
    for (const auto* list : {&c.training, &c.test})
      for (const PosedImage& chip : *list) {
        const Acquisition& a = chip.acquisition;
        if (a.n_azimuth < kStoredSide || a.n_range < kStoredSide)
          throw InputError(format("%s: expected a chip of %d x %d pixels or more, found %d x %d", chip.name.c_str(), kStoredSide, kStoredSide,
                                  a.n_azimuth, a.n_range));
        if (std::abs(a.azimuth_spacing_m / first.azimuth_spacing_m - 1.0) > kSameSpacing ||
            std::abs(a.range_spacing_m / first.range_spacing_m - 1.0) > kSameSpacing)
          throw InputError(format("%s: expected the other chips' pixel spacing, %g x %g m, found %g x %g m", chip.name.c_str(),
                                  first.azimuth_spacing_m, first.range_spacing_m, a.azimuth_spacing_m, a.range_spacing_m));
      }
}

/// Fills the digests of a class. Throws InputError if two of its chips are one: in a test of chips that are no shots, a shot would be tested.
void add_digests(ClassChips& chips) {
  std::string text, geometry;
  std::map<std::tuple<double, double, std::string>, std::string> names;
  for (const auto* list : {&chips.training, &chips.test})
    for (const PosedImage& chip : *list) {
      const Acquisition& a = chip.acquisition;
      const std::string pixels = sha256_hex(std::as_bytes(chip.power.pixels()));
      text += format("%s %.9g %.9g %s\n", chip.name.c_str(), a.azimuth_rad, a.incidence_rad, pixels.c_str());
      geometry += format("%.9g %.9g %.9g %d\n", a.azimuth_spacing_m, a.range_spacing_m, a.slant_range_m, static_cast<int>(a.look));
      const auto [other, is_new] = names.try_emplace({a.azimuth_rad, a.incidence_rad, pixels}, chip.name);
      if (!is_new)
        throw InputError(format("class %s: expected each chip once, found %s and %s with the same pixels and angles; leave one out", chips.name.c_str(),
                                in_quotes(other->second).c_str(), in_quotes(chip.name).c_str()));
    }
  chips.sha256 = sha256_hex(std::as_bytes(std::span(text)));
  chips.geometry = sha256_hex(std::as_bytes(std::span(geometry)));
}

}  // namespace

std::vector<ClassChips> read_chips(const Options& o, Console& console, const Monitor& monitor) {
  if (!o.validate && std::abs(o.training_depression_deg - o.test_depression_deg) < 2.0 * kSameDepression_deg)
    throw UsageError(format("--test-depression %g: expected %g degrees or more from that of the shots, %g, since depressions are nominal",
                            o.test_depression_deg, 2.0 * kSameDepression_deg, o.training_depression_deg));
  ChipsFound found = o.table.empty() ? chips_of_datasets(o, console, monitor) : chips_of_table(o, monitor);
  if (found.chips.empty())
    throw InputError(format("%s: expected chips%s at %s deg of depression, found none%s", o.chips.c_str(), o.classes.empty() ? "" : " of these classes",
                            (o.validate ? format("%g", o.training_depression_deg) : format("%g or %g", o.training_depression_deg, o.test_depression_deg)).c_str(),
                            o.table.empty() ? "; datasets are searched (sar_import makes them), or images of a table (--csv)" : ""));
  std::map<std::string, ClassChips> by_name;
  for (ChipOfClass& f : found.chips) {
    ClassChips& chips = by_name[f.class_name];
    (is_near(f.depression_deg, o.training_depression_deg) ? chips.training : chips.test).push_back(std::move(f.image));
  }
  for (const std::string& name : o.classes)
    if (by_name.find(name) == by_name.end())
      throw UsageError("--classes: " + in_quotes(name) + ": no chips of this class in " + o.chips.string() + " at these depressions");
  std::vector<ClassChips> result;
  const int most = *std::ranges::max_element(o.shots);
  for (auto& [name, chips] : by_name) {
    if (o.most_classes > 0 && result.size() == o.most_classes) break;
    require_file_name(name, o.chips);
    chips.name = name;
    for (auto* list : {&chips.training, &chips.test}) std::ranges::sort(*list, {}, circle_deg);
    if (static_cast<int>(chips.training.size()) < std::max(most, 1))
      throw InputError(format("%s: class %s: expected %d chips or more at %g deg, found %zu; ask for fewer (--shots) or leave the class out "
                              "(--classes)", o.chips.c_str(), name.c_str(), std::max(most, 1), o.training_depression_deg, chips.training.size()));
    if (chips.test.empty() && !o.validate && !o.test_rest)
      throw InputError(format("%s: class %s: expected some chips at %g deg, found none; test it on its other chips (--test-rest) or leave it out "
                              "(--classes)", o.chips.c_str(), name.c_str(), o.test_depression_deg));
    result.push_back(std::move(chips));
  }
  if (!o.validate && std::ranges::all_of(result, [](const ClassChips& c) { return c.test.empty(); }))
    throw InputError(format("%s: expected chips at %g deg of one class or more, found none", o.chips.c_str(), o.test_depression_deg));
  if (result.size() < 2)
    throw InputError(o.chips.string() + ": expected chips of two classes or more, found those of " + result.front().name + " alone");
  require_one_kind(result);
  cut_to_one_size(result);
  for (ClassChips& c : result) add_digests(c);
  std::size_t n_chips = 0;
  for (const ClassChips& c : result) n_chips += c.training.size() + c.test.size();
  console.note(counted(n_chips, "chip") + " of " + counted(result.size(), "class", "classes") +
               (found.n_other_depressions > 0 ? "; " + counted(found.n_other_depressions, "chip") + " at other depressions left out" : ""));
  return result;
}

namespace {

/// Whether a chip of the training depression is tested in this draw of a validation.
bool is_in_tested_sector(const PosedImage& chip, int number) {
  return static_cast<int>(std::floor(circle_deg(chip) / kSector_deg)) % kFolds == number % kFolds;
}

/// `n_shots` of the usable chips, the nearest one to each of so many equal steps of azimuth.
std::vector<std::size_t> spread_shots(const ClassChips& c, std::vector<std::size_t> usable, int n_shots, double start_deg) {
  if (usable.size() < static_cast<std::size_t>(n_shots))
    throw UsageError(format("class %s: expected %d shots outside the sectors that are tested, found %zu chips; ask for fewer (--shots)",
                            c.name.c_str(), n_shots, usable.size()));
  std::vector<std::size_t> shots;
  for (int k = 0; k < n_shots; ++k) {
    const double wanted_rad = rad_from_deg(start_deg + 360.0 * k / n_shots);
    const auto nearest = std::ranges::min_element(usable, {}, [&](std::size_t n) { return apart_rad(c.training[n].acquisition.azimuth_rad, wanted_rad); });
    shots.push_back(*nearest);
    usable.erase(nearest);
  }
  std::ranges::sort(shots);
  return shots;
}

}  // namespace

Draw draw_shots(const std::vector<ClassChips>& chips, int n_shots, int number, const Options& o) {
  Draw draw{n_shots, number, {}, {}};
  std::mt19937_64 random(static_cast<std::uint64_t>(1000 * n_shots + number));
  double start_deg = 0.0;
  for (const ClassChips& c : chips) {
    std::vector<std::size_t> usable, test;
    for (std::size_t n = 0; n < c.training.size(); ++n) {
      if (o.validate && is_in_tested_sector(c.training[n], number))
        test.push_back(n);
      else
        usable.push_back(n);
    }
    if (!o.same_azimuths || draw.shots.empty()) start_deg = std::uniform_real_distribution(0.0, 360.0)(random);
    std::vector<std::size_t> shots = n_shots == 0 ? usable : spread_shots(c, usable, n_shots, start_deg);
    if (!o.validate)
      for (std::size_t n = 0; n < list_of_test(c, o.validate).size(); ++n)
        if (!tests_training(c, o.validate) || !std::ranges::binary_search(shots, n)) test.push_back(n);
    if (o.validate && (shots.empty() || test.empty()))
      throw UsageError(format("--validate: class %s, draw %d: expected shots and test chips, found %zu and %zu; its chips lie in too few sectors of "
                              "%g deg", c.name.c_str(), number, shots.size(), test.size(), kSector_deg));
    draw.shots.push_back(std::move(shots));
    draw.test.push_back(std::move(test));
  }
  return draw;
}

void require_draws(const Options& o, const std::vector<ClassChips>& chips) {
  for (const int n_shots : o.shots)
    for (int number = 0; number < o.n_draws; ++number) draw_shots(chips, n_shots, number, o);
}

LabelledChips labelled(std::span<const PosedImage* const> chips, std::span<const std::int64_t> labels) {
  constexpr int side = kStoredSide;
  const auto n_chips = static_cast<std::int64_t>(chips.size());
  LabelledChips result{torch::empty({n_chips, side, side}), torch::empty({n_chips}, torch::kInt64), torch::empty({n_chips, 2}, torch::kFloat64)};
  for (std::size_t n = 0; n < chips.size(); ++n) {
    const auto index = static_cast<std::int64_t>(n);
    const Image<float> middle = middle_of(chips[n]->power, side, side);
    std::ranges::transform(middle.pixels(), result.amplitude[index].data_ptr<float>(),
                           [](float power) { return std::sqrt(std::max(0.0f, power)); });
    result.label[index] = labels[n];
    result.pose_deg[index][0] = circle_deg(*chips[n]);
    result.pose_deg[index][1] = 90.0 - deg_from_rad(chips[n]->acquisition.incidence_rad);
  }
  return result;
}

namespace {

/// These chips of source(class).
template <class Source>
LabelledChips chips_of(const std::vector<ClassChips>& chips, const std::vector<std::vector<std::size_t>>& which, const Source& source) {
  std::vector<const PosedImage*> pointers;
  std::vector<std::int64_t> labels;
  for (std::size_t c = 0; c < chips.size(); ++c)
    for (const std::size_t n : which[c]) {
      pointers.push_back(&source(chips[c])[n]);
      labels.push_back(static_cast<std::int64_t>(c));
    }
  return labelled(pointers, labels);
}

}  // namespace

LabelledChips shots_of_classes(const std::vector<ClassChips>& chips, const Draw& draw) {
  return chips_of(chips, draw.shots, [](const ClassChips& c) -> const auto& { return c.training; });
}

LabelledChips tested_chips(const std::vector<ClassChips>& chips, const Draw& draw, bool validate) {
  return chips_of(chips, draw.test, [&](const ClassChips& c) -> const auto& { return list_of_test(c, validate); });
}

std::vector<Image<float>> powers_of(const LabelledChips& chips) {
  std::vector<Image<float>> powers;
  for (std::int64_t n = 0; n < chips.size(); ++n) {
    Image<float>& power = powers.emplace_back(kStoredSide, kStoredSide);
    const torch::Tensor squares = chips.amplitude[n].square().contiguous();
    std::copy_n(squares.data_ptr<float>(), power.pixels().size(), power.pixels().begin());
  }
  return powers;
}

}  // namespace sarnerf::app

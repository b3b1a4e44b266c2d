// SPDX-License-Identifier: Apache-2.0
#include "options.h"

#include <algorithm>
#include <cstdio>
#include <limits>
#include <numeric>

#include "nerf_common.h"
#include "process.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/text.h"
#include "sarnerf/dataset/manifest.h"
#include "torch_setup.h"
#include "values.h"

namespace sarnerf::app {
namespace {

std::uint64_t image_bytes(const std::vector<DatasetView>& views) {
  std::uint64_t bytes = 0;
  for (const DatasetView& v : views)
    bytes += 4ull * static_cast<std::uint64_t>(v.n_azimuth) * static_cast<std::uint64_t>(v.n_range);
  return bytes;
}

void refuse_beyond_memory(const Options& o, const std::vector<DatasetView>& all) {
  const std::uint64_t needed = kBaseMemory_bytes + image_bytes(all);
  const MemoryLimit limit = memory_limit(o.shared);
  if (limit.allows(needed)) return;
  throw UsageError("the images of " + counted(all.size(), "view") +
                   " and the program need about " + bytes_text(needed) +
                   ", and " + limit.text() +
                   (all.size() > 1 ? "; use fewer or smaller views" : "; use a smaller view, or allow more"));
}

std::vector<DatasetView> chosen(const std::vector<DatasetView>& views,
                                std::span<const std::size_t> which) {
  std::vector<DatasetView> list;
  for (const std::size_t n : which) list.push_back(views[n]);
  return list;
}

/// Indices of the views of --against that can be compared: no training view has their angles.
std::vector<std::size_t> comparable(const Options& o, const Dataset& dataset, const Dataset& other,
                                    const std::vector<DatasetView>& training, Console& console) {
  const std::string name = "--against " + o.against.string();
  if (glm::distance(dataset.aim_m, other.aim_m) > 1e-3)
    throw UsageError(name + ": its aim point is another than that of " + o.dataset.string() +
                     ", so its images do not show the same place; use views of the same scene and "
                     "aim (--aim of sar_render)");
  if (dataset.calibration != other.calibration)
    throw UsageError(name + ": holds " + std::string(sarnerf::name(other.calibration)) + ", and " +
                     o.dataset.string() + " " + std::string(sarnerf::name(dataset.calibration)) +
                     "; compare images of one calibration");
  const auto unseen = unseen_views(other.views, training);
  if (unseen.size() < other.views.size())
    console.note(name + ": " + counted(other.views.size() - unseen.size(), "view") +
                 " with the angles of a training view left out");
  if (unseen.empty())
    console.warning(name + ": all its views are trained on, so none is left to compare with");
  return unseen;
}

void tell_oddities(const Options& o, const Data& data, Console& console) {
  const auto& views = data.training_views;
  if (data.dataset.quantity == Quantity::amplitude)
    console.note(o.dataset.string() +
                 " holds amplitudes: they are squared, power is what is learned");
  if (o.heights.above_ground_m && !data.set.ground) console.warning("--scene-height has no effect: the images show no ground");
  for (const Outlier& outlier : data.set.outliers) console.warning(outlier_text(outlier, data.set.images));
  if (views.size() == 1)
    console.warning(
        "a single view hardly constrains the scene's shape: expect other views to be wrong");
  std::size_t n_repeated = 0;
  for (std::size_t a = 0; a < views.size(); ++a) {
    const auto same = [&](const DatasetView& v) { return same_angles(v, views[a]); };
    n_repeated +=
        std::any_of(views.begin(), views.begin() + static_cast<std::ptrdiff_t>(a), same) ? 1 : 0;
  }
  if (n_repeated > 0)
    console.warning(counted(n_repeated, "training view") +
                    (n_repeated == 1 ? " has" : " have") + " the angles of another one: that direction has twice the weight");
}

/// The images must be at least four widths of the impulse response wide. Throws UsageError.
void require_inside(const Resolution& resolution, const DatasetView& v) {
  constexpr double kLeastWidths = 4.0;
  const double azimuth_m = v.n_azimuth * v.azimuth_spacing_m, range_m = v.n_range * v.range_spacing_m;
  if (resolution.azimuth_m * kLeastWidths <= azimuth_m && resolution.range_m * kLeastWidths <= range_m) return;
  throw UsageError(format("a resolution of %.4g x %.4g m (azimuth x range) is too coarse for images of %.4g x %.4g m, which show "
                          "fewer than four of its widths; give %.4g x %.4g m at most",
                          resolution.azimuth_m, resolution.range_m, azimuth_m, range_m, azimuth_m / kLeastWidths,
                          range_m / kLeastWidths));
}

/// The resolution that the user gave, which must be possible; else that of the dataset, if it is possible.
std::optional<Resolution> usable_resolution(const Options& o, const Dataset& dataset, Console& console) {
  const std::optional<Resolution> resolution = o.resolution.or_else(dataset.resolution);
  if (!resolution) return {};
  try {
    for (const DatasetView& v : dataset.views) {
      impulse_response(*resolution, v.azimuth_spacing_m, v.range_spacing_m);
      require_inside(*resolution, v);
    }
  } catch (const UsageError& error) {
    if (!o.resolution.automatic)
      throw UsageError(std::string("--resolution: ") + error.what() + " (size and spacing are those of the images in " +
                       o.dataset.string() + ", which training cannot change)");
    console.warning(o.dataset.string() + ": its impulse response of " + resolution_text(*resolution) +
                    " is ignored: it is impossible for images of this size and spacing; --resolution gives another one");
    return {};
  }
  return resolution;
}

}  // namespace

Data load_data(const Options& o, Console& console, const Monitor& monitor) {
  Data data;
  data.dataset = read_manifest(o.dataset);
  const auto& views = data.dataset.views;
  if (views.empty())
    throw InputError(o.dataset.string() + ": the dataset has no view to learn from");
  if (data.dataset.unfinished()) console.warning(o.dataset.string() + ": " + unfinished_text(data.dataset));
  // With views of another dataset, no view needs to be held out.
  const bool none = !o.against.empty() && o.holdout.kind == Holdout::Kind::automatic;
  const auto held_out = none ? std::vector<std::size_t>{} : held_out_views(views, o.holdout);
  std::vector<std::size_t> training;
  for (std::size_t n = 0; n < views.size(); ++n) {
    if (!std::binary_search(held_out.begin(), held_out.end(), n)) training.push_back(n);
  }
  data.training_views = chosen(views, training);
  data.validation_views = chosen(views, held_out);
  data.n_held_out = held_out.size();

  Dataset other;
  std::vector<std::size_t> unseen;
  if (!o.against.empty()) {
    other = read_manifest(o.against);
    if (other.unfinished()) console.warning("--against " + o.against.string() + ": " + unfinished_text(other));
    unseen = comparable(o, data.dataset, other, data.training_views, console);
    for (const std::size_t n : unseen) data.validation_views.push_back(other.views[n]);
  }
  std::vector<DatasetView> all = data.training_views;
  all.insert(all.end(), data.validation_views.begin(), data.validation_views.end());
  refuse_beyond_memory(o, all);

  data.fingerprint = dataset_fingerprint(o.dataset, data.dataset, monitor);
  const bool literal = o.field == "paper";
  if (literal && o.registers.value_or(false))
    throw UsageError("--register on: --field paper is the method of the paper, which shifts no views; leave it out, or take another field");
  if (literal && (o.heights.ground_m || o.heights.above_ground_m || o.resolution.resolution))
    throw UsageError("--ground-height, --scene-height, --resolution: --field paper is the method of the paper, which knows neither a ground "
                     "nor an impulse response; leave them out, or take another field");
  const bool registers = !literal && o.registers.value_or(!data.dataset.exact_poses);
  std::vector<PosedImage> images = load_images(o.dataset, data.dataset, training, monitor);
  const std::optional<Resolution> resolution = usable_resolution(o, data.dataset, console);
  if (registers) {
    RegisteredSet registered =
        registered_training_set(std::move(images), data.dataset.scene_box_m, o.heights, resolution, {}, monitor);
    data.set = std::move(registered.set);
    data.registered = std::move(registered.registered);
  } else {
    data.set = training_set(std::move(images), data.dataset.scene_box_m, o.heights, resolution);
  }
  if (literal) data.set = images_alone(std::move(data.set));
  if (!held_out.empty()) data.validation = load_images(o.dataset, data.dataset, held_out, monitor);
  if (!unseen.empty()) {
    auto more = load_images(o.against, other, unseen, monitor);
    std::move(more.begin(), more.end(), std::back_inserter(data.validation));
  }
  for (PosedImage& image : data.validation) image.acquisition.aim_m = glm::dvec3(0.0);
  for (const Outlier& outlier : limit_outliers(data.validation))
    console.warning("of the views to compare with: " + outlier_text(outlier, data.validation));
  const bool exact_poses = (held_out.empty() || data.dataset.exact_poses) && (unseen.empty() || other.exact_poses);
  data.despeckled = despeckled_if_asked(o.despeckle_deg, data.validation, exact_poses, monitor);
  tell_oddities(o, data, console);
  return data;
}

ModelInfo model_info(const Data& data, const TrainingSet& set, const Options& options) {
  ModelInfo info;
  info.reference_bin_m = std::numeric_limits<double>::infinity();
  for (const DatasetView& v : data.training_views)
    info.reference_bin_m = std::min(info.reference_bin_m, v.range_spacing_m);
  info.aim_m = data.dataset.aim_m;
  info.scene_box_m = data.dataset.scene_box_m;
  info.scene_box_m.min.y = set.box_m.min.y + info.aim_m.y;  // the ground, if the images determine it
  info.quantity = data.dataset.quantity;
  info.calibration = data.dataset.calibration;
  info.scale = data.dataset.scale;
  info.peak_power = double{set.peak};
  // The view of median incidence: new views resemble it the most.
  std::vector<DatasetView> sorted = data.training_views;
  std::stable_sort(sorted.begin(), sorted.end(),
                   [](const auto& a, const auto& b) { return a.incidence_deg < b.incidence_deg; });
  info.acquisition = sorted[sorted.size() / 2];
  info.acquisition.image.clear();
  std::error_code ignored;
  info.dataset = std::filesystem::weakly_canonical(options.dataset, ignored).string();
  info.dataset_sha256 = data.fingerprint;
  info.training_views = data.training_views;
  return info;
}

}  // namespace sarnerf::app

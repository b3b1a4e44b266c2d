// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <span>

#include "version.h"
#include <nlohmann/json.hpp>

#include "app_main.h"
#include "job.h"
#include "process.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/files.h"
#include "sarnerf/core/text.h"
#include "sarnerf/core/units.h"
#include "sarnerf/geometry/acquisition.h"
#include "sarnerf/nerf/mlp_field.h"
#include "torch_setup.h"
#include "values.h"

namespace sarnerf::app {

namespace {

/// The views of the dataset --views, without its files.
std::vector<DatasetView> views_of_dataset(const std::filesystem::path& folder, const ModelInfo& info) {
  constexpr double kSameAim_m = 1e-3;
  const Dataset dataset = read_manifest(folder);
  const glm::dvec3 &aim = dataset.aim_m, &own = info.aim_m;
  if (glm::distance(aim, own) > kSameAim_m)
    throw UsageError(format("--views %s: expected views aimed at (%g, %g, %g) m, as the model's, found (%g, %g, %g) m",
                            folder.string().c_str(), own.x, own.y, own.z, aim.x, aim.y, aim.z));
  std::vector<DatasetView> views;
  for (const DatasetView& of_file : dataset.views) {
    DatasetView v = of_file;
    v.image.clear();
    v.axes = {Axis::plus_i, Axis::plus_j};
    v.class_name.clear();
    v.serial.clear();
    v.source.clear();
    validate(acquisition_of(v, own));
    views.push_back(v);
  }
  if (views.empty()) throw UsageError("--views " + folder.string() + ": expected a dataset with views, found none");
  return views;
}

std::vector<DatasetView> views_of(const Options& o, const ModelInfo& info) {
  if (!o.views.empty()) return views_of_dataset(o.views, info);
  const DatasetView& usual = info.acquisition;
  const auto incidences =
      o.incidence_deg.empty() ? std::vector{usual.incidence_deg} : o.incidence_deg;
  std::vector<DatasetView> views;
  for (const double incidence_deg : incidences) {
    for (const double azimuth_deg : o.azimuth_deg) {
      DatasetView v = usual;
      v.image.clear();
      v.azimuth_deg = azimuth_deg;
      v.incidence_deg = incidence_deg;
      const double incidence_rad = rad_from_deg(incidence_deg);
      v.slant_range_m = o.altitude_m ? slant_range_from_altitude_m(*o.altitude_m, incidence_rad)
                                     : o.slant_range_m.value_or(usual.slant_range_m);
      v.altitude_m = o.altitude_m.value_or(v.slant_range_m * std::cos(incidence_rad));
      if (o.size) std::tie(v.n_azimuth, v.n_range) = *o.size;
      if (o.spacing_m) std::tie(v.azimuth_spacing_m, v.range_spacing_m) = *o.spacing_m;
      v.look = o.look.value_or(usual.look);
      validate(acquisition_of(v, info.aim_m));
      views.push_back(v);
    }
  }
  return views;
}

/// The recipe's views: angles, or each view of --views.
Json views_json(const Job& job) {
  const DatasetView& first = job.views.front();
  if (!job.options.views.empty()) {
    Json views = Json::array();
    for (const DatasetView& v : job.views) views.push_back(Json::parse(view_text(v)));
    return views;
  }
  Json incidences = Json::array(), azimuths = Json::array();
  for (const DatasetView& v : job.views) {
    if (incidences.empty() || incidences.back() != Json(v.incidence_deg))
      incidences.push_back(v.incidence_deg);
  }
  for (const double azimuth_deg : job.options.azimuth_deg) azimuths.push_back(azimuth_deg);
  Json j{{"incidence_deg", incidences}, {"azimuth_deg", azimuths}, {"look", first.look == Look::left ? "left" : "right"}};
  if (job.options.altitude_m) {
    j["altitude_m"] = *job.options.altitude_m;
  } else {
    j["slant_range_m"] = first.slant_range_m;
  }
  return j;
}

Json request_of(const Job& job, const std::filesystem::path& file) {
  const DatasetView& first = job.views.front();
  Json j;
  j["model"] = {{"file", file.filename().string()}, {"sha256", sha256_of_file(file)}};
  j["views"] = views_json(job);
  j["image"] = {{"size", {first.n_azimuth, first.n_range}},
                {"spacing_m", {first.azimuth_spacing_m, first.range_spacing_m}},
                {"calibration", name(job.model.info.calibration)},
                {"quantity", name(job.quantity)}};
  if (!job.options.resolution.automatic) {
    const auto& r = job.model.field->resolution;
    j["image"]["resolution_m"] = r ? Json{r->azimuth_m, r->range_m} : Json("none");
    if (r) j["image"]["window"] = text_of(r->window);
  }
  if (job.clutter.radar.speckle()) {
    Json& speckle = j["image"]["speckle"] = {{"looks", job.clutter.radar.looks}, {"seed", job.clutter.radar.seed}};
    if (job.clutter.texture_variance > 0.0) speckle["texture_variance"] = job.clutter.texture_variance;
    if (const auto& r = job.clutter.radar.resolution_m) {
      speckle["resolution_m"] = {r->first, r->second};
      speckle["window"] = text_of(job.clutter.radar.window);
    }
  }
  return valid_text(j);
}

/// A new view is far from training if the angle (rad) between its line of sight and the nearest training view's
/// exceeds this, or the largest such angle between the training views if that is greater. 5 deg beyond the trained
/// pitches cost 10 dB already (docs/results/learning.md, Pitch).
constexpr double kFar_rad = 10.0 * std::numbers::pi / 180.0;

/// Angle (rad) from a line of sight to the nearest of others, without the one at index `but`.
double nearest_rad(const glm::dvec3& k, std::span<const glm::dvec3> others, std::size_t but) {
  double most_cosine = -1.0;
  for (std::size_t n = 0; n < others.size(); ++n) {
    if (n != but) most_cosine = std::max(most_cosine, glm::dot(k, others[n]));
  }
  return std::acos(std::min(1.0, most_cosine));
}

/// Warns of views far from all training views: beyond their pitches, on another side, in a gap of their azimuths.
void warn_of_far_views(const Job& job, Console& console) {
  const auto line_of_sight = [](const DatasetView& v) { return radar_frame(acquisition_of(v, glm::dvec3(0.0))).k; };
  std::vector<glm::dvec3> trained;
  for (const DatasetView& view : job.model.info.training_views) trained.push_back(line_of_sight(view));
  if (trained.empty()) return;
  double far_rad = kFar_rad;
  for (std::size_t n = 0; n < trained.size() && trained.size() > 1; ++n)
    far_rad = std::max(far_rad, nearest_rad(trained[n], trained, n));
  std::size_t n_far = 0, farthest = 0;
  double most_rad = 0.0;
  for (std::size_t n = 0; n < job.views.size(); ++n) {
    const double angle_rad = nearest_rad(line_of_sight(job.views[n]), trained, trained.size());
    if (angle_rad <= far_rad) continue;
    ++n_far;
    if (angle_rad > most_rad) {
      most_rad = angle_rad;
      farthest = n;
    }
  }
  if (n_far == 0) return;
  const DatasetView& v = job.views[farthest];
  console.warning(format("%zu of %zu view%s far from all training views (incidence %.4g, azimuth %.4g deg: %.0f deg from the "
                         "nearest): what shows there was never seen, and may be wrong",
                         n_far, job.views.size(), job.views.size() == 1 ? " is" : n_far == 1 ? "s is" : "s are",
                         v.incidence_deg, v.azimuth_deg, deg_from_rad(most_rad)));
}

/// Sets another impulse response than that of the images. The field must be the scene without the images' response; of others, only
/// the speckle can have a response of its own.
void choose_resolution(const Options& o, LearnedField& field) {
  if (o.resolution.automatic) return;
  if (field.resolution) {
    field.resolution = o.resolution.resolution;
  } else if (o.speckle.kind != SpeckleChoice::Kind::looks) {
    throw UsageError("--resolution: this model's field shows images as they were, with whatever impulse response they had; "
                     "learn it with sar_nerf_train --resolution to take that out");
  }
}

/// The speckle that was asked for. Its response is the field's, or the one that was given, or fits the clutter of the training images.
ClutterModel clutter_of(const Job& job, const Monitor& monitor) {
  const Options& o = job.options;
  ClutterModel clutter;
  ImageFormation& formation = clutter.radar;
  if (o.speckle.kind == SpeckleChoice::Kind::none) return clutter;
  formation.looks = o.speckle.looks;
  if (o.speckle.kind == SpeckleChoice::Kind::training) {
    std::vector<Image<float>> powers;
    for (PosedImage& image : training_images(job, monitor)) powers.push_back(std::move(image.power));
    // MSTAR's window: the shape of the response matters less than its width, which the clutter shows.
    const DatasetView& v = job.model.info.acquisition;
    const auto fitted = fitted_clutter(powers, Window{Window::Kind::taylor}, v.azimuth_spacing_m, v.range_spacing_m);
    if (!fitted)
      throw UsageError("--looks training: the training images have no clutter around the target; give a number of looks, or none");
    clutter = *fitted;
  }
  formation.seed = static_cast<std::uint64_t>(o.seed);
  std::optional<Resolution> known = job.model.field->resolution;
  if (!known && !o.resolution.automatic) known = o.resolution.resolution;
  if (known) {
    formation.resolution_m = {known->azimuth_m, known->range_m};
    formation.window = known->window;
  }
  for (const DatasetView& v : job.views) validate(formation, v.azimuth_spacing_m, v.range_spacing_m);
  return clutter;
}

/// Refuses too many range bins: rays are cut at their borders wherever they meet occupied voxels, inside the image
/// and in front of it.
void refuse_countless_bins(const Job& job) {
  constexpr double kMostBins = 16384.0;
  const Box box_m = job.model.field->occupied_box_m();
  if (box_m.empty()) return;
  const double depth_m = glm::length(box_m.size()),
               bin_m = std::ranges::min(job.views, {}, &DatasetView::range_spacing_m).range_spacing_m;
  if (depth_m <= kMostBins * bin_m) return;
  char text[200];
  std::snprintf(text, sizeof text,
                "--spacing: range bins of %.3g m are too narrow for the occupied part of the field, %.3g m across; "
                "use %.2g m or more",
                bin_m, depth_m, 1.1 * depth_m / kMostBins);
  throw UsageError(text);
}

void refuse_beyond_memory(const Job& job) {
  const MemoryLimit limit = memory_limit(job.options.shared);
  std::uint64_t most_pixels = 0;
  for (const DatasetView& v : job.views)
    most_pixels = std::max(most_pixels, static_cast<std::uint64_t>(v.n_azimuth) * static_cast<std::uint64_t>(v.n_range));
  const std::uint64_t needed = kBaseMemory_bytes + 16ull * most_pixels;
  if (!limit.allows(needed))
    throw UsageError("about " + bytes_text(needed) + " are needed, and " + limit.text() + "; make the image smaller");
}

}  // namespace

Job prepare(const Options& options, Console& console, const Monitor& monitor) {
  Job job;
  job.options = options;
  const auto file = model_file(options.model);
  job.model = open_model(options.model, console);
  choose_resolution(options, *job.model.field);
  job.quantity = options.quantity.value_or(job.model.info.quantity);
  job.views = views_of(options, job.model.info);
  if (const auto& r = job.model.field->resolution)  // refuses an impossible response before anything is written
    for (const DatasetView& v : job.views) impulse_response(*r, v.azimuth_spacing_m, v.range_spacing_m);
  job.clutter = clutter_of(job, monitor);
  job.request = request_of(job, file);
  refuse_beyond_memory(job);
  refuse_countless_bins(job);
  if (options.against.empty()) warn_of_far_views(job, console);
  return job;
}

namespace {

Image<float> formed_view(const Job& job, const Acquisition& acquisition) {
  const LearnedField& field = *job.model.field;
  if (!field.resolution || !job.clutter.radar.speckle()) {
    Image<float> image = render_view(field, acquisition);
    multiply_by_clutter(image, job.clutter, acquisition);
    return image;
  }
  const Border border = border_of(impulse_response(job.clutter.radar, acquisition.azimuth_spacing_m, acquisition.range_spacing_m),
                                  acquisition.n_azimuth, acquisition.n_range);
  const Acquisition wide = widened(acquisition, border);
  Image<float> image = render_sharp_view(field, wide);
  multiply_by_texture(image, job.clutter, wide);
  form_image(image, job.clutter.radar, wide, 0.0);
  return without_border(std::move(image), border);
}

}  // namespace

Image<float> make_image(const Job& job, const DatasetView& view) {
  Image<float> image = formed_view(job, acquisition_of(view, job.model.info.aim_m));
  const auto pixels = image.pixels();
  if (!std::all_of(pixels.begin(), pixels.end(), [](float p) { return std::isfinite(p); }))
    throw NumericsError("the view at azimuth " + std::to_string(view.azimuth_deg) +
                        " deg holds pixels that are not finite; the model's training has diverged");
  if (job.quantity == Quantity::amplitude) take_amplitude(image);
  return image;
}

namespace {

std::string speckle_text(const ClutterModel& clutter) {
  const ImageFormation& speckle = clutter.radar;
  if (!speckle.speckle()) return "";
  std::string text = format("\n  speckle   %.3g looks, seed %llu", speckle.looks, static_cast<unsigned long long>(speckle.seed));
  if (const auto& r = speckle.resolution_m) text += ", " + resolution_text({r->first, r->second, speckle.window});
  if (clutter.texture_variance > 0.0) text += format(", texture of variance %.2f", clutter.texture_variance);
  return text;
}

}  // namespace

std::string explain(const Job& job) {
  const DatasetView& v = job.views.front();
  const ModelInfo& info = job.model.info;
  const bool comparison = !job.options.against.empty();
  const std::string views =
      comparison ? "those of " + job.options.against.string() + " that the model was not trained on, scored beside baselines"
                 : std::to_string(job.views.size()) + " of " + std::to_string(v.n_azimuth) + " x " + std::to_string(v.n_range) +
                       " pixels (azimuth x range)";
  std::string place = job.options.output;
  if (place.empty())
    place = comparison ? "the table, to stdout" : model_name(job.options.model) + (job.views.size() > 1 ? "_views" : "_view");
  return "plan\n  model     " + std::string(job.model.field->kind()) + ", " +
         job.model.field->size_text() + ", of " + counted(info.training_views.size(), "view") +
         " and " + counted(static_cast<std::uint64_t>(info.steps), "step") + "\n  views     " +
         views +
         (job.model.field->resolution ? "\n  impulse response  " + resolution_text(*job.model.field->resolution) : "") +
         speckle_text(job.clutter) +
         (job.model.field->kind() == "paper" ? "\n  left out  rows and rays that miss the scene's box"
                                             : "\n  left out  rows and rays that miss the occupied part of the field; the rest of a ray "
                                               "behind an optical depth of " +
                                                   format("%.3g", end_depth_of_views(*job.model.field))) +
         "\n  output    " + place;
}

std::string report_text(const Job& job, std::size_t n_rendered, double render_s) {
  const Json j{{"format", "sarnerf-report"},
               {"version", 1},
               {"program", std::string(kProgram) + " " + std::string(kVersion)},
               {"threads", job.options.shared.n_threads},
               {"views", {{"planned", job.views.size()}, {"rendered", n_rendered}}},
               {"seconds", {{"render", render_s}, {"total", seconds_since_start()}}},
               {"machine", {{"processor", processor_name()}, {"libraries", torch_text()}}},
               {"memory_bytes", {{"peak", peak_memory_bytes()}}}};
  return j.dump(2) + "\n";
}

namespace {

void run(const Options& options, Console& console) {
  const Monitor monitor{[&](std::string_view stage, std::uint64_t done, std::uint64_t n) {
                          console.progress(stage, done, n);
                        },
                        &stop_requested()};
  const Job job = prepare(options, console, monitor);
  const auto* const mlp = dynamic_cast<const MlpField*>(job.model.field.get());
  use_torch_threads(mlp ? options.shared.n_threads : 1);
  if (mlp) warn_of_slow_blas(mlp->kernel(), console);
  if (options.dry_run) {
    print_result(explain(job) + "\n");
    return;
  }
  if (options.explain) console.asked_for(explain(job));
  print_result(!options.against.empty() ? compare(job, console, monitor)
               : job.views.size() > 1   ? write_sweep(job, console, monitor)
                                        : write_single_view(job, console, monitor));
}

}  // namespace

}  // namespace sarnerf::app

int main(int argc, char** argv) {
  using namespace sarnerf::app;
  return app_main("sar_nerf_render", argc, argv, parse_options, run);
}

// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/nerf/model_file.h"

#include <algorithm>
#include <cmath>

#include "files/archives.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/image.h"
#include "sarnerf/core/impulse_response.h"
#include "sarnerf/mpa/volume_march.h"
#include "sarnerf/nerf/grid_field.h"
#include "sarnerf/nerf/learned_field.h"
#include "sarnerf/nerf/mlp_field.h"
#include "sarnerf/nerf/surface_field.h"

namespace sarnerf {

namespace {

/// The border that an image's response needs, limited to bins in front of the radar.
Border border_in_front(const ImpulseResponse& response, const Acquisition& a) {
  Border border = border_of(response, a.n_azimuth, a.n_range);
  border.range = std::min(border.range, static_cast<int>(a.range_m(0) / a.range_spacing_m - 1.0));
  border.range = std::max(border.range, 0);
  return border;
}

/// Where rays through a network end, which costs as much as it has segments: e^−9 = 0.01 % of a ray's power lies behind, less than the
/// error of its bf16 products.
constexpr double kEndOfNetworkRayDepth = 9.0;

}  // namespace

double end_depth_of_views(const LearnedField& field) { return is_network(field.kind()) ? kEndOfNetworkRayDepth : kEndOfRayDepth; }

Image<float> render_sharp_view(const LearnedField& field, const Acquisition& acquisition) {
  const double voxel_m = field.voxel_size_m();
  RaySampling sampling;
  sampling.ray_spacing_m = 0.5 * voxel_m;
  sampling.sub_rows = 3;
  sampling.longest_m = voxel_m;
  sampling.end_depth = end_depth_of_views(field);
  Acquisition centred = acquisition;
  centred.aim_m = glm::dvec3(0.0);
  std::vector<RowRequest> rows;
  for (int i = 0; i < centred.n_azimuth; ++i) rows.push_back({centred, i});
  Image<float> image(centred.n_azimuth, centred.n_range);
  field.render_rows(rows, sampling, image.pixels());
  for (float& power : image.pixels()) power = std::max(power, 0.0f);
  return image;
}

Image<float> render_view(const LearnedField& field, const Acquisition& acquisition) {
  if (!field.resolution) return render_sharp_view(field, acquisition);
  const ImpulseResponse response =
      impulse_response(*field.resolution, acquisition.azimuth_spacing_m, acquisition.range_spacing_m);
  const Border border = border_in_front(response, acquisition);
  Image<float> image = render_sharp_view(field, widened(acquisition, border));
  convolve_power(image, response);
  return without_border(std::move(image), border);
}

std::unique_ptr<LearnedField> restore_field(const Archive& archive, const std::string& where) {
  const auto kind = member<std::string>(text_of(archive, "field", where), "kind", where);
  if (kind == "grid") return std::make_unique<GridField>(restore_grid_field(archive, where));
  if (is_network(kind)) return std::make_unique<MlpField>(restore_mlp_field(archive, where));
  if (kind == "surface") return std::make_unique<SurfaceField>(restore_surface_field(archive, where));
  throw CheckpointError(where + ": holds a field of kind '" + kind +
                        "', which this version does not have; it has: grid, mlp, paper, surface");
}

namespace {

constexpr const char* kFormat = "sarnerf-model";
constexpr int kVersion = 1;

Json json_of(const glm::dvec3& v) { return {v.x, v.y, v.z}; }

Json json_of(const DatasetView& v) {
  return {{"azimuth_deg", v.azimuth_deg},
          {"incidence_deg", v.incidence_deg},
          {"depression_deg", v.depression_deg()},
          {"slant_range_m", v.slant_range_m},
          {"n_azimuth", v.n_azimuth},
          {"n_range", v.n_range},
          {"azimuth_spacing_m", v.azimuth_spacing_m},
          {"range_spacing_m", v.range_spacing_m},
          {"look", v.look == Look::left ? "left" : "right"}};
}

/// Reads members of a JSON object; error messages name the file.
class Reader {
 public:
  Reader(Json object, const std::string& where) : object_(std::move(object)), where_(where) {}

  template <class T>
  T get(const char* name) const {
    return member<T>(object_, name, where_);
  }
  glm::dvec3 vector(const Json& value) const {
    if (!value.is_array() || value.size() != 3 || !value[0].is_number() || !value[1].is_number() ||
        !value[2].is_number())
      throw CheckpointError(where_ + ": expected three coordinates, found " +
                            value.dump().substr(0, 60));
    return {value[0].get<double>(), value[1].get<double>(), value[2].get<double>()};
  }
  DatasetView view(const Json& value) const {
    const Reader r(value, where_);
    DatasetView v;
    v.azimuth_deg = r.get<double>("azimuth_deg");
    v.incidence_deg = r.get<double>("incidence_deg");
    v.slant_range_m = r.get<double>("slant_range_m");
    v.n_azimuth = r.get<int>("n_azimuth");
    v.n_range = r.get<int>("n_range");
    v.azimuth_spacing_m = r.get<double>("azimuth_spacing_m");
    v.range_spacing_m = r.get<double>("range_spacing_m");
    v.look = r.get<std::string>("look") == "left" ? Look::left : Look::right;
    if (value.contains("image")) v.image = r.get<std::string>("image");
    try {
      validate(acquisition_of(v, glm::dvec3(0.0)));
    } catch (const GeometryError& e) {
      throw CheckpointError(where_ + ": one of its views is impossible: " + e.what());
    }
    return v;
  }

 private:
  Json object_;
  const std::string& where_;
};

ModelInfo info_from(const Json& text, const std::string& where) {
  const Reader r(text, where);
  ModelInfo info;
  info.program = r.get<std::string>("program");
  info.reference_bin_m = r.get<double>("reference_bin_m");
  const Json box = r.get<Json>("scene_box_m");
  if (!box.is_array() || box.size() != 2)
    throw CheckpointError(where + ": 'scene_box_m' is no box");
  info.scene_box_m = {r.vector(box[0]), r.vector(box[1])};
  info.aim_m = r.vector(r.get<Json>("aim_m"));
  try {
    info.quantity = quantity_from_name(r.get<std::string>("quantity"));
    info.calibration = calibration_from_name(r.get<std::string>("calibration"));
  } catch (const UsageError& e) {
    throw CheckpointError(where + ": " + e.what());
  }
  info.scale = r.get<double>("scale");
  info.peak_power = r.get<double>("peak_power");
  info.acquisition = r.view(r.get<Json>("acquisition"));
  const Reader dataset(r.get<Json>("dataset"), where);
  info.dataset = dataset.get<std::string>("folder");
  info.dataset_sha256 = dataset.get<std::string>("sha256");
  for (const Json& view : dataset.get<Json>("training_views"))
    info.training_views.push_back(r.view(view));
  info.steps = r.get<std::int64_t>("steps");
  if (!(info.peak_power > 0.0) || !std::isfinite(info.peak_power))
    throw CheckpointError(where + ": 'peak_power' is not above 0; the file is damaged");
  return info;
}

/// Contents without effect, in words. Older versions added kriged residuals of the training views to the rendered image.
std::string ignored_parts(const Archive& archive) {
  return archive.tensors.contains("amplitude_residuals") ? "residuals of its training views (kriging)" : "";
}

}  // namespace

void write_model(const std::filesystem::path& path, const LearnedField& field,
                 const ModelInfo& info) {
  Archive archive = field.state();
  Json views = Json::array();
  for (const DatasetView& view : info.training_views) {
    views.push_back(json_of(view));
    views.back()["image"] = view.image;
  }
  add_text(
      archive, "model",
      {{"format", kFormat},
       {"version", kVersion},
       {"program", info.program},
       {"integrator", name(field.integrator())},
       {"reference_bin_m", info.reference_bin_m},
       {"scene_box_m", {json_of(info.scene_box_m.min), json_of(info.scene_box_m.max)}},
       {"aim_m", json_of(info.aim_m)},
       {"quantity", name(info.quantity)},
       {"calibration", name(info.calibration)},
       {"scale", info.scale},
       {"peak_power", info.peak_power},
       {"acquisition", json_of(info.acquisition)},
       {"dataset",
        {{"folder", info.dataset}, {"sha256", info.dataset_sha256}, {"training_views", views}}},
       {"steps", info.steps}});
  write_archive(path, archive);
}

Model read_model(const std::filesystem::path& path) {
  const Archive archive = read_archive(path);
  const std::string where = path.string();
  const Json all = Json::parse(archive.json, nullptr, false);
  if (!all.is_object() || !all.contains("model"))
    throw CheckpointError(where +
                          (all.is_object() && all.contains("trainer")
                               ? ": is a checkpoint of a training; expected the model.pt of a run"
                               : ": is not a model; expected the model.pt of a run"));
  const Json text = text_of(archive, "model", where);
  const auto version = member<int>(text, "version", where);
  if (member<std::string>(text, "format", where) != kFormat || version < 1)
    throw CheckpointError(where + ": is not a model; expected the model.pt of a run");
  if (version > kVersion)
    throw CheckpointError(where + ": is of version " + std::to_string(version) +
                          ", and this program knows versions up to " + std::to_string(kVersion) +
                          "; use the program that wrote it");
  return {info_from(text, where), restore_field(archive, where), ignored_parts(archive)};
}

}  // namespace sarnerf

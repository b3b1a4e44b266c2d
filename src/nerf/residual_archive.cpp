// SPDX-License-Identifier: Apache-2.0
#include "residual_archive.h"

#include <algorithm>
#include <cmath>

#include "archive_text.h"

namespace sarnerf {
namespace {

constexpr const char* kPixels = "amplitude_residuals";

Json json_of(const Acquisition& a) {
  return {{"azimuth_rad", a.azimuth_rad},
          {"incidence_rad", a.incidence_rad},
          {"slant_range_m", a.slant_range_m},
          {"n_azimuth", a.n_azimuth},
          {"n_range", a.n_range},
          {"azimuth_spacing_m", a.azimuth_spacing_m},
          {"range_spacing_m", a.range_spacing_m},
          {"look", a.look == Look::left ? "left" : "right"}};
}

Acquisition acquisition_from(const Json& json, const std::string& where) {
  Acquisition a;
  a.azimuth_rad = member<double>(json, "azimuth_rad", where);
  a.incidence_rad = member<double>(json, "incidence_rad", where);
  a.slant_range_m = member<double>(json, "slant_range_m", where);
  a.n_azimuth = member<int>(json, "n_azimuth", where);
  a.n_range = member<int>(json, "n_range", where);
  a.azimuth_spacing_m = member<double>(json, "azimuth_spacing_m", where);
  a.range_spacing_m = member<double>(json, "range_spacing_m", where);
  a.look = member<std::string>(json, "look", where) == "left" ? Look::left : Look::right;
  try {
    validate(a);
  } catch (const GeometryError& e) {
    throw CheckpointError(where + ": one of the residuals' views is impossible: " + e.what());
  }
  return a;
}

}  // namespace

void add_residuals(Archive& archive, const ViewResiduals& residuals) {
  // Views may differ in size: their pixels stand one behind the other.
  std::vector<float> pixels;
  Json views = Json::array();
  for (const PosedImage& view : residuals.views) {
    pixels.insert(pixels.end(), view.power.pixels().begin(), view.power.pixels().end());
    views.push_back(json_of(view.acquisition));
    views.back()["name"] = view.name;
  }
  archive.tensors[kPixels] =
      torch::from_blob(pixels.data(), {static_cast<std::int64_t>(pixels.size())}, torch::kFloat).to(torch::kHalf);
  add_text(archive, kPixels,
           {{"share", residuals.share},
            {"target_share", residuals.target_share},
            {"length_rad", residuals.length_rad},
            {"glints", residuals.glints},
            {"ground_mean", residuals.ground_mean},
            {"ground_power", residuals.ground_power},
            {"plane_height_m", residuals.plane_height_m},
            {"views", views}});
}

std::shared_ptr<const ViewResiduals> residuals_of(const Archive& archive, const std::string& where) {
  if (archive.tensors.find(kPixels) == archive.tensors.end()) return nullptr;
  const auto require = [&](bool holds, const char* what) {
    if (!holds) throw CheckpointError(where + ": " + what + "; the file is damaged");
  };
  const torch::Tensor pixels = archive.tensor(kPixels, torch::kHalf, 1, where).to(torch::kFloat).contiguous();
  const Json text = text_of(archive, kPixels, where);
  auto residuals = std::make_shared<ViewResiduals>();
  residuals->share = member<double>(text, "share", where);
  residuals->length_rad = member<double>(text, "length_rad", where);
  residuals->glints = member<double>(text, "glints", where);
  residuals->ground_mean = member<double>(text, "ground_mean", where);
  residuals->target_share = member<double>(text, "target_share", where);
  residuals->ground_power = member<double>(text, "ground_power", where);
  residuals->plane_height_m = member<double>(text, "plane_height_m", where);
  const auto possible = [](double share) { return share >= 0.0 && share < 1.0; };
  require(possible(residuals->share) && possible(residuals->target_share) && residuals->length_rad > 0.0 &&
              std::isfinite(residuals->length_rad) && residuals->glints >= 0.0 && std::isfinite(residuals->glints) &&
              std::isfinite(residuals->ground_mean) && residuals->ground_power > 0.0 &&
              std::isfinite(residuals->ground_power) && std::isfinite(residuals->plane_height_m),
          "the residuals' covariance is impossible");
  require(pixels.isfinite().all().item<bool>(), "the views' residuals are not finite");
  std::int64_t next = 0;
  for (const Json& json : member<Json>(text, "views", where)) {
    PosedImage view{member<std::string>(json, "name", where), acquisition_from(json, where), {}};
    const std::int64_t n = std::int64_t{view.acquisition.n_azimuth} * view.acquisition.n_range;
    require(n <= pixels.numel() - next, "the views' residuals are fewer than their pixels");
    view.power = Image<float>(view.acquisition.n_azimuth, view.acquisition.n_range);
    std::copy_n(pixels.data_ptr<float>() + next, n, view.power.pixels().begin());
    next += n;
    residuals->views.push_back(std::move(view));
  }
  require(next == pixels.numel() && !residuals->views.empty(), "the views' residuals are more than their pixels");
  return residuals;
}

}  // namespace sarnerf

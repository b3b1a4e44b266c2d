// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/mpa/deposit.h"
#include "sarnerf/render/layers.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "layers/layer_row.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/units.h"

namespace sarnerf {

namespace {

constexpr std::array<std::string_view, kNumberOfLayers> kNames{
    "ground", "wall", "roof", "other", "mask", "incidence", "elevation", "scatterers", "error"};

Layer layer_from_name(std::string_view word) {
  if (word == "all" || word == "none")
    throw UsageError("--layers: '" + std::string(word) + "' stands alone: give it without other names, or leave it out");
  std::string known;
  for (std::size_t n = 0; n < kNumberOfLayers; ++n) {
    if (word == kNames[n]) return static_cast<Layer>(n);
    known += (n > 0 ? ", " : "") + std::string(kNames[n]);
  }
  throw UsageError("--layers: expected all, none, or some of " + known + ", found '" + std::string(word) + "'");
}

}  // namespace

std::string_view name(Layer layer) { return kNames[static_cast<std::size_t>(layer)]; }

LayerSet all_layers() {
  LayerSet all;
  for (std::size_t n = 0; n < kNumberOfLayers; ++n) all.add(static_cast<Layer>(n));
  return all;
}

LayerSet layers_from_text(std::string_view text) {
  if (text == "all") return all_layers();
  LayerSet set;
  if (text == "none") return set;
  for (std::size_t begin = 0;;) {
    const std::size_t end = text.find(',', begin);
    set.add(layer_from_name(text.substr(begin, end - begin)));
    if (end == std::string_view::npos) return set;
    begin = end + 1;
  }
}

Layers::Layers(const LayerSet& layers, int n_azimuth, int n_range) : set(layers) {
  for (std::size_t n = 0; n < kNumberOfLayers; ++n) {
    const auto layer = static_cast<Layer>(n);
    if (layer == Layer::mask || !set.has(layer)) continue;
    const bool unknown = layer == Layer::incidence || layer == Layer::elevation || layer == Layer::error;
    values(layer) = Image<float>(n_azimuth, n_range, unknown ? std::numeric_limits<float>::quiet_NaN() : 0.0f);
  }
  if (set.has(Layer::mask)) mask = Image<std::uint8_t>(n_azimuth, n_range);
}

const Image<float>& Layers::values(Layer layer) const {
  switch (layer) {
    case Layer::incidence:
      return incidence_deg;
    case Layer::elevation:
      return elevation_m;
    case Layer::scatterers:
      return scatterers;
    case Layer::error:
      return error;
    case Layer::mask:
      throw UsageError("the mask is not a layer of float values");
    default:
      return beta0[static_cast<std::size_t>(layer)];
  }
}

Image<float>& Layers::values(Layer layer) {
  return const_cast<Image<float>&>(static_cast<const Layers&>(*this).values(layer));
}

std::uint64_t bytes_per_pixel(const LayerSet& layers) {
  std::uint64_t bytes = 0;
  for (std::size_t n = 0; n < kNumberOfLayers; ++n) {
    const auto layer = static_cast<Layer>(n);
    if (layers.has(layer)) bytes += layer == Layer::mask ? sizeof(std::uint8_t) : sizeof(float);
  }
  return bytes;
}

LayerView::LayerView(const Acquisition& acquisition, const Fan& fan, double reference_height_m)
    : acquisition_(acquisition), fan_(fan), above_plane_m_(acquisition.aim_m.y - reference_height_m) {
  const double height_of_radar_m = acquisition.altitude_m() + above_plane_m_;
  for (int j = 0; j < acquisition.n_range; ++j) {
    const double cosine = height_of_radar_m / acquisition.range_m(j);
    if (cosine > 1.0 || cosine <= 0.0) {
      plane_ray_.push_back(-std::numeric_limits<double>::infinity());
      continue;
    }
    const double delta = std::acos(cosine) - acquisition.incidence_rad;
    plane_ray_.push_back((delta - fan.first_angle_rad) / fan.step_rad - 0.5);
  }
}

double LayerView::height_m(double k, double x) const {
  const double offset_m = (x - 0.5 * acquisition_.n_range) * acquisition_.range_spacing_m;
  return height_over_plane_m(acquisition_, -above_plane_m_, fan_.ray_angle_rad(k), offset_m);
}

double LayerView::plane_bin(double k) const {
  const double offset_m = plane_range_offset_m(acquisition_, -above_plane_m_, fan_.ray_angle_rad(k));
  return offset_m / acquisition_.range_spacing_m + 0.5 * acquisition_.n_range;
}

std::pair<int, int> LayerView::plane_bins(double first_ray, double last_ray) const {
  const auto first = std::lower_bound(plane_ray_.begin(), plane_ray_.end(), first_ray);
  const auto last = std::lower_bound(first, plane_ray_.end(), last_ray);
  return {static_cast<int>(first - plane_ray_.begin()), static_cast<int>(last - plane_ray_.begin())};
}

namespace {

/// A surface within the larger of these distances of the reference plane, in slant range, counts as part of it: it hides the plane and
/// casts no shadow.
constexpr double kCoplanar_m = 1e-3;
constexpr double kBinTolerance = 0.01;  // accuracy of positions in range (bins)
/// Groups of one component that are at most this many rays apart are one group.
constexpr double kLargestGap = 1.0;

std::size_t slot(Component component) { return static_cast<std::size_t>(component) - 1; }

}  // namespace

LayerRow::LayerRow(const LayerView& view, const LayerSet& layers)
    : view_(view),
      layers_(layers),
      groups_(layers.has(Layer::mask) || layers.has(Layer::scatterers)),
      coplanar_bins_(std::max(kBinTolerance, kCoplanar_m / view.range_spacing_m())) {}

void LayerRow::begin_row() {
  const auto n = static_cast<std::size_t>(view_.n_range());
  sums_.assign(n, Sums{});
  votes_.assign(n, {});
  n_scatterers_.assign(n, 0);
  of_slice_.resize(n);
  n_slices_ = 0;
}

void LayerRow::begin_slice() {
  OfSlice fresh;
  fresh.last_ray.fill(kNoRay);
  std::fill(of_slice_.begin(), of_slice_.end(), fresh);
}

void LayerRow::sum(std::size_t j, Component component, double mass, double ray, double bin,
                   double incidence_rad) {
  Sums& s = sums_[j];
  s.mass[slot(component)] += mass;
  s.height += mass * view_.height_m(ray, bin);
  if (std::isnan(incidence_rad)) return;
  s.incidence += mass * incidence_rad;
  s.with_incidence += mass;
}

void LayerRow::group(std::size_t j, const LayerRun& run) {
  // The part of the run's rays that contributes to the bin.
  double first = run.first_ray, last = run.last_ray;
  const double span = run.last_bin - run.first_bin;
  if (span != 0.0) {
    const double half_smear = 0.5 * std::abs(run.smear);
    const double near = (double(j) - half_smear - run.first_bin) / span;
    const double far = (double(j) + 1.0 + half_smear - run.first_bin) / span;
    const double length = run.last_ray - run.first_ray;
    last = run.first_ray + length * std::clamp(std::max(near, far), 0.0, 1.0);
    first = run.first_ray + length * std::clamp(std::min(near, far), 0.0, 1.0);
  }
  OfSlice& s = of_slice_[j];
  double& last_of_group = s.last_ray[slot(run.component)];
  if (!(first <= last_of_group + kLargestGap)) ++(run.component == Component::ground ? s.n_ground_groups : s.n_groups);
  last_of_group = std::max(last_of_group, last);
}

void LayerRow::add(const LayerRun& run) {
  if (!(run.mass > 0.0)) return;
  const double low = std::min(run.first_bin, run.last_bin), high = std::max(run.first_bin, run.last_bin);
  const double rays_per_bin = high > low ? (run.last_ray - run.first_ray) / (run.last_bin - run.first_bin) : 0.0;
  for_each_share(sums_.size(), run.first_bin, run.last_bin, run.smear, [&](std::size_t j, double share) {
    if (!(share > 0.0)) return;
    // Centre of the run's part in this bin.
    const double x = 0.5 * (std::clamp(double(j), low, high) + std::clamp(double(j) + 1.0, low, high));
    const double ray = high > low ? run.first_ray + (x - run.first_bin) * rays_per_bin
                                  : std::midpoint(run.first_ray, run.last_ray);
    sum(j, run.component, run.mass * share, ray, x, run.incidence_rad);
    if (groups_ && run.counts) group(j, run);
  });
}

void LayerRow::add_ground(const LayerRun& run) {
  if (!(run.mass > 0.0)) return;
  for_each_share(sums_.size(), run.first_bin, run.last_bin, run.smear, [&](std::size_t j, double share) {
    if (!(share > 0.0)) return;
    // The height on the plane is 0: nothing to add to the sum of heights.
    Sums& s = sums_[j];
    const double mass = run.mass * share;
    s.mass[slot(Component::ground)] += mass;
    s.incidence += mass * run.incidence_rad;
    s.with_incidence += mass;
    of_slice_[j].ground = true;
  });
}

void LayerRow::add_ground(std::span<const double> mass) {
  for (std::size_t j = 0; j < mass.size(); ++j) {
    if (!(mass[j] > 0.0)) continue;
    Sums& s = sums_[j];
    s.mass[slot(Component::ground)] += mass[j];
    const double ray = view_.plane_ray(static_cast<int>(j));
    // The nadir's bin contains ground although its centre is nearer than the plane.
    s.incidence += mass[j] * (std::isfinite(ray) ? view_.incidence_rad(ray) : 0.0);
    s.with_incidence += mass[j];
    of_slice_[j].ground = true;
  }
}

void LayerRow::hide(Component by, double first_ray, double last_ray, double first_bin, double last_bin) {
  if (!groups_) return;
  const auto [begin, end] = view_.plane_bins(first_ray, last_ray);
  const double bins_per_ray = last_bin != first_bin ? (last_bin - first_bin) / (last_ray - first_ray) : 0.0;
  for (int j = begin; j < end; ++j) {
    const double x = first_bin + (view_.plane_ray(j) - first_ray) * bins_per_ray;
    if (!(x <= j + 0.5 + coplanar_bins_)) continue;
    OfSlice& s = of_slice_[static_cast<std::size_t>(j)];
    s.hidden = true;
    s.hidden_by_object |= by != Component::ground;
  }
}

void LayerRow::hide_behind(int k) {
  constexpr double kNearest = -std::numeric_limits<double>::infinity();
  hide(Component::other, k - 0.5, k + 0.5, kNearest, kNearest);
}

void LayerRow::end_slice() {
  ++n_slices_;
  if (!groups_) return;
  for (std::size_t j = 0; j < of_slice_.size(); ++j) {
    const OfSlice& s = of_slice_[j];
    n_scatterers_[j] += static_cast<std::uint32_t>(s.n_groups + std::max(s.n_ground_groups, s.ground ? 1 : 0));
    const bool plane_exists = std::isfinite(view_.plane_ray(static_cast<int>(j)));
    const bool hidden = plane_exists && s.hidden;
    const int n = s.n_groups + std::max(s.n_ground_groups, plane_exists && !hidden ? 1 : 0);
    const MaskValue value = n >= 2 ? (s.hidden_by_object ? MaskValue::both : MaskValue::layover)
                            : hidden && n == 0 ? MaskValue::shadow
                                               : MaskValue::none;
    ++votes_[j][static_cast<std::size_t>(value)];
  }
}

void LayerRow::end_row(int i, std::span<const double> beta0_per_mass, Layers& layers) const {
  constexpr float kNothing = std::numeric_limits<float>::quiet_NaN();
  for (int j = 0; j < view_.n_range(); ++j) {
    const auto n = static_cast<std::size_t>(j);
    const Sums& s = sums_[n];
    for (std::size_t c = 0; c < kNumberOfComponents; ++c) {
      if (!layers_.has(static_cast<Layer>(c))) continue;
      layers.beta0[c](i, j) = static_cast<float>(s.mass[c] * beta0_per_mass[n]);
    }
    const double mass = std::accumulate(s.mass.begin(), s.mass.end(), 0.0);
    if (layers_.has(Layer::elevation)) {
      layers.elevation_m(i, j) = mass > 0.0 ? static_cast<float>(s.height / mass) : kNothing;
    }
    if (layers_.has(Layer::incidence)) {
      layers.incidence_deg(i, j) =
          s.with_incidence > 0.0 ? static_cast<float>(deg_from_rad(s.incidence / s.with_incidence)) : kNothing;
    }
    if (layers_.has(Layer::scatterers)) {
      layers.scatterers(i, j) = static_cast<float>(double(n_scatterers_[n]) / n_slices_);
    }
    if (layers_.has(Layer::mask)) {
      // Ties go to the greater value, which carries more information.
      const auto& votes = votes_[n];
      std::size_t most = 3;
      for (std::size_t value = 3; value-- > 0;) {
        if (votes[value] > votes[most]) most = value;
      }
      layers.mask(i, j) = static_cast<std::uint8_t>(most);
    }
  }
}

}  // namespace sarnerf

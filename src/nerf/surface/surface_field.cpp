// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/nerf/surface_field.h"

#include <algorithm>
#include <cmath>

#include <torch/csrc/autograd/custom_function.h>

#include "field/rows.h"
#include "field/tensors.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/parallel.h"
#include "sarnerf/core/text.h"
#include "sarnerf/field/field_sampler.h"
#include "sarnerf/mpa/surface_density.h"
#include "sarnerf/nerf/row_renderer.h"

namespace sarnerf {

namespace {

/// −ln of twice the depth that is left out in front of the surface at normal incidence: 0.005.
constexpr double kBandSharpnesses = 4.6;

/// Of the directional brightness.
constexpr int kDegree = 2;
constexpr std::size_t kHarmonics = n_harmonics(kDegree);

/// Two-way depth per voxel of the cache at most: rays end three voxels inside the surface, also where the distance between two
/// voxels is far larger than 1 / s, and the cache cannot locate the surface.
constexpr double kMostCachedDepth = 2.0;

CarvedVoxels all_voxels(BrickTopology topology) {
  const std::size_t n = topology.n_bricks() * kBrickVoxels;
  return {std::move(topology), std::vector<std::uint8_t>(n, 1)};
}

}  // namespace

SurfaceField::SurfaceField(const GridTransform& transform, BrickTopology topology, double albedo_voxel_m, double most_band_m)
    : transform_(transform),
      albedo_transform_{transform.origin_m, albedo_voxel_m},
      cache_(transform, all_voxels(std::move(topology))),
      most_band_m_(most_band_m),
      sharpness_per_m_(kBandSharpnesses / most_band_m) {
  // The coarse voxels that the corners of the fine bricks lie between.
  const BrickTopology& bricks = cache_.topology();
  for (std::uint32_t b = 0; b < bricks.n_bricks(); ++b) {
    const glm::dvec3 first_m = transform_.world_from_index(glm::dvec3(bricks.coordinate(b) * kBrickSide) - 0.5);
    const glm::dvec3 last_m = transform_.world_from_index(glm::dvec3(bricks.coordinate(b) * kBrickSide + kBrickSide) + 0.5);
    const glm::ivec3 first = brick_of_voxel(glm::ivec3(glm::floor(albedo_transform_.index_from_world(first_m))));
    const glm::ivec3 last = brick_of_voxel(glm::ivec3(glm::floor(albedo_transform_.index_from_world(last_m))) + 1);
    for (int x = first.x; x <= last.x; ++x)
      for (int y = first.y; y <= last.y; ++y)
        for (int z = first.z; z <= last.z; ++z) albedo_topology_.insert({x, y, z});
  }
  const auto n_albedo = static_cast<std::int64_t>(albedo_topology_.n_bricks() * kBrickVoxels);
  distance = torch::full({static_cast<std::int64_t>(n_voxels())}, static_cast<float>(most_band_m)).set_requires_grad(true);
  log_albedo = torch::zeros({n_albedo}).set_requires_grad(true);
  exponent = torch::ones({1}).set_requires_grad(true);
  log_bounce = torch::zeros({0}).set_requires_grad(true);
  directional = torch::zeros({0, kHarmonics}).set_requires_grad(true);
  refresh();
}

std::vector<torch::Tensor> SurfaceField::parameters() const {
  if (has_directional()) return {directional};
  if (has_bounce()) return {distance, log_albedo, exponent, log_bounce};
  return {distance, log_albedo, exponent};
}

void SurfaceField::start_bounce() { log_bounce = log_albedo.detach().clone().set_requires_grad(true); }

void SurfaceField::start_directional() {
  directional = torch::zeros({log_albedo.numel(), kHarmonics}).set_requires_grad(true);
}

double SurfaceField::band_m(double sharpness_per_m) { return kBandSharpnesses / sharpness_per_m; }

double SurfaceField::band_m() const { return std::min(most_band_m_ - transform_.voxel_size_m, band_m(sharpness_per_m_)); }

void SurfaceField::refresh() {
  const float* const f = distance.data_ptr<float>();
  const double most_per_m = 0.5 * kMostCachedDepth / transform_.voxel_size_m;
  // Voxels are numbered as in the topology, since all of its voxels belong to the cache.
  std::vector<float> extinction(n_voxels());
  parallel_for(extinction.size(), std::size_t{1} << 14, [&](std::size_t begin, std::size_t end, int) {
    for (std::size_t v = begin; v < end; ++v) {
      const double per_m = 0.5 * sharpness_per_m_ * laplace_below(sharpness_per_m_ * double{f[v]});
      extinction[v] = double{f[v]} < band_m() ? static_cast<float>(std::min(most_per_m, per_m)) : 0.0f;
    }
  });
  cache_.refresh(extinction, 0.0);
}

Box SurfaceField::occupied_box_m() const { return occupied_box(cache_.occupancy(), transform_); }

std::string SurfaceField::size_text() const {
  return format("%zu voxels of %.3g m near the surface", cache_.n_occupied(), transform_.voxel_size_m);
}

namespace {

BrickView<const float> view_of(const SurfaceField& field, std::span<const float> distance) {
  return {&field.topology(), field.transform(), 1, distance};
}

}  // namespace

SurfaceField refined(const SurfaceField& field, double reach_m) {
  const GridTransform transform{field.transform().origin_m, 0.5 * field.voxel_size_m()};
  const double band_m = SurfaceField::band_m(field.sharpness_per_m()) + 2.0 * transform.voxel_size_m;
  const double far_m = std::min(band_m + reach_m + field.voxel_size_m(), field.most_band_m());
  const std::span<const float> f = numbers(field.distance);
  BrickTopology near;
  for (std::size_t v = 0; v < f.size(); ++v) {
    if (double{f[v]} >= far_m) continue;
    const glm::ivec3 voxel = 2 * field.topology().voxel(v);
    const glm::ivec3 first = brick_of_voxel(voxel - 1), last = brick_of_voxel(voxel + 1);
    for (int x = first.x; x <= last.x; ++x)
      for (int y = first.y; y <= last.y; ++y)
        for (int z = first.z; z <= last.z; ++z)
          if (near.find({x, y, z}) == kNoBrick) near.insert({x, y, z});
  }
  SurfaceField fine(transform, std::move(near), field.albedo_transform().voxel_size_m, std::min(band_m, field.most_band_m()));
  const torch::NoGradGuard no_grad;
  fine.distance.copy_(refined_values(field, field.distance, fine, static_cast<float>(field.most_band_m())).clamp_max_(fine.most_band_m()));
  fine.log_albedo.copy_(refined_albedo(field, field.log_albedo, fine));
  fine.exponent.copy_(field.exponent);
  if (field.has_bounce()) {
    fine.start_bounce();
    fine.log_bounce.copy_(refined_albedo(field, field.log_bounce, fine));
  }
  fine.set_sharpness(field.sharpness_per_m());
  fine.refresh();
  fine.ground = field.ground;
  fine.resolution = field.resolution;
  return fine;
}

torch::Tensor refined_values(const SurfaceField& field, const torch::Tensor& values, const SurfaceField& fine, float beyond) {
  // Missing bricks count as 0 in an interpolation.
  const torch::Tensor less = values.detach() - beyond;
  torch::Tensor out = torch::empty({static_cast<std::int64_t>(fine.n_voxels())});
  const std::span<float> to = numbers(out);
  parallel_for(fine.topology().n_bricks(), 16, [&](std::size_t begin, std::size_t end, int) {
    TrilinearSampler sampler(view_of(field, numbers(less)));
    std::vector<glm::vec3> points_m;
    for (std::size_t v = begin * kBrickVoxels; v < end * kBrickVoxels; ++v)
      points_m.emplace_back(fine.transform().world_from_index(glm::dvec3(fine.topology().voxel(v))));
    sampler.sample(points_m, to.subspan(begin * kBrickVoxels, points_m.size()));
  });
  return out + beyond;
}

torch::Tensor refined_albedo(const SurfaceField& field, const torch::Tensor& values, const SurfaceField& fine) {
  torch::Tensor out = torch::zeros_like(fine.log_albedo.detach());
  const std::span<const float> from = numbers(values);
  const std::span<float> to = numbers(out);
  for (std::uint32_t b = 0; b < fine.albedo_topology().n_bricks(); ++b) {
    const std::uint32_t old = field.albedo_topology().find(fine.albedo_topology().coordinate(b));
    if (old != kNoBrick) std::copy_n(&from[std::size_t{old} * kBrickVoxels], kBrickVoxels, &to[std::size_t{b} * kBrickVoxels]);
  }
  return out;
}

namespace {

/// Rows that are rendered at a time without gradients: bounds the memory.
constexpr std::size_t kRowsAtATime = 32;

/// Cosine below which the brightness falls linearly to 0, so that its derivative is bounded for every exponent.
constexpr double kLeastCosine = 0.01;

/// Part of a gradient's length, which is 1 for a distance, below which its direction fades: in the middle of thin members.
constexpr float kLeastSlope = 0.1f;

/// The direction in which f rises at a point.
struct Normal {
  glm::vec3 unit;  ///< ∇f / slope
  float slope;     ///< √(|∇f|² + kLeastSlope²)
};

/// The segments of some rows, the field at them, and the derivatives of it.
struct Pass : torch::CustomClassHolder {
  Pass(std::span<const RowRequest> rows, const RaySampling& sampling, const SurfaceField& of);

  void sample(std::size_t part);
  void scatter_directional(std::size_t part, std::span<const float> d_brightness);
  void sample_normals(std::size_t part);
  void sample_bounce(std::size_t part);
  void scatter(std::size_t part, std::span<const float> d_extinction, std::span<const float> d_brightness, std::span<const float> d_bounce);
  /// Adds the derivatives by ∇f at the part's segments to `d_gradients`.
  void scatter_bounce(std::size_t part, std::span<const float> d_bounce, std::span<glm::vec3> d_gradients);
  template <class Visit>
  void for_each_segment(std::size_t part, Visit&& visit) const {
    for (std::size_t q = first_ray[part]; q < first_ray[part + 1]; ++q)
      for (std::size_t s = segments.ray_begin()[q]; s < segments.ray_begin()[q + 1]; ++s) visit(s, q);
  }

  /// Rays [first, end) of the batch are one thread's.
  std::size_t n_parts() const { return first_ray.size() - 1; }

  const SurfaceField& field;
  const bool bounces;
  RowSegments segments;
  std::vector<float> length_m;
  std::vector<std::uint32_t> near_end;  ///< of each segment; its far end is the next
  std::vector<glm::vec3> end_m;
  std::vector<std::size_t> first_ray, first_end;  ///< of the parts
  std::vector<float> distance_m;                  ///< f at the ends
  std::vector<float> extinction_per_m, albedo, brightness;
  std::vector<Normal> normal;                 ///< at the centres of the segments
  std::vector<float> bounce_albedo, bounce;   ///< of Path::by_ground; empty without
  struct Gradients {
    std::vector<float> distance, log_albedo, log_bounce, directional;
    double exponent = 0.0;
  };
  std::vector<Gradients> gradients;  ///< of the parts
};

Pass::Pass(std::span<const RowRequest> rows, const RaySampling& sampling, const SurfaceField& of)
    : field(of), bounces(of.has_bounce() && of.ground), segments(rows, sampling, of.cache(), of.ground) {
  constexpr double kJoined_bins = 1e-5;  // segments whose ends differ by less than this have one end in common
  const auto places = segments.places();
  const auto begin = segments.ray_begin();
  const std::size_t n_rays = begin.size() - 1;
  length_m.reserve(places.size());
  near_end.reserve(places.size());
  const std::size_t n = std::max<std::size_t>(1, std::min<std::size_t>(static_cast<std::size_t>(thread_count()), n_rays));
  for (std::size_t part = 0; part < n; ++part) {
    first_ray.push_back(n_rays * part / n);
    first_end.push_back(end_m.size());
    for (std::size_t q = n_rays * part / n; q < n_rays * (part + 1) / n; ++q) {
      const glm::vec3 d = segments.ray_direction()[q];
      double last_bin = -1e300;
      for (std::uint32_t s = begin[q]; s < begin[q + 1]; ++s) {
        const auto half = static_cast<float>(0.5 * places[s].length_m);
        const double bin_m = rows[places[s].row].acquisition.range_spacing_m;
        const glm::vec3 centre = segments.point_m()[s];
        if (!(places[s].near_bin < last_bin + kJoined_bins)) end_m.push_back(centre - half * d);
        near_end.push_back(static_cast<std::uint32_t>(end_m.size() - 1));
        end_m.push_back(centre + half * d);
        length_m.push_back(static_cast<float>(places[s].length_m));
        last_bin = places[s].near_bin + places[s].length_m / bin_m;
      }
    }
  }
  first_ray.push_back(n_rays);
  first_end.push_back(end_m.size());
  distance_m.resize(end_m.size());
  extinction_per_m.resize(length_m.size());
  albedo.resize(length_m.size());
  brightness.resize(length_m.size());
  normal.resize(length_m.size());
  if (bounces) {
    bounce_albedo.resize(length_m.size());
    bounce.resize(length_m.size());
  }
  parallel_for(n_parts(), 1, [&](std::size_t part, std::size_t, int) { sample(part); });
}

/// cos^p and its derivatives.
struct Lobe {
  double cos_to_p;       ///< 0 where the surface faces away
  double by_cosine;      ///< ∂cos^p/∂cos
  double by_exponent;    ///< ∂cos^p/∂p
};

Lobe lobe(double cosine, double exponent) {
  if (!(cosine > 0.0)) return {0.0, 0.0, 0.0};
  const double least = std::max(cosine, kLeastCosine), power = std::pow(least, exponent);
  if (cosine < kLeastCosine) {
    const double part = cosine / kLeastCosine;
    return {part * power, power / kLeastCosine, part * power * std::log(least)};
  }
  return {power, exponent * power / cosine, power * std::log(cosine)};
}

BrickView<const float> albedo_of(const SurfaceField& field) {
  return {&field.albedo_topology(), field.albedo_transform(), 1, numbers(field.log_albedo)};
}

BrickView<const float> directional_of(const SurfaceField& field) {
  return {&field.albedo_topology(), field.albedo_transform(), kHarmonics, numbers(field.directional)};
}

/// A ray's horizontal direction: that of the bisector between both directions of a path by the ground, as seen from the body.
glm::vec3 level_direction(const glm::vec3& direction) { return glm::normalize(glm::vec3(direction.x, 0.0f, direction.z)); }

double cosine(const glm::vec3& direction, const Normal& normal) { return -double{glm::dot(direction, normal.unit)}; }

/// ∂/∂∇f of cosine(), which is c.
glm::vec3 cosine_by_gradient(const glm::vec3& direction, const Normal& normal, double c) {
  return -(direction + static_cast<float>(c) * normal.unit) / normal.slope;
}

void Pass::sample_normals(std::size_t part) {
  const std::size_t begin = segments.ray_begin()[first_ray[part]], n = segments.ray_begin()[first_ray[part + 1]] - begin;
  std::vector<glm::vec3> gradient(n);
  sample_gradients(view_of(field, numbers(field.distance)), segments.point_m().subspan(begin, n), gradient);
  for (std::size_t s = 0; s < n; ++s) {
    const float slope = std::sqrt(glm::dot(gradient[s], gradient[s]) + kLeastSlope * kLeastSlope);
    normal[begin + s] = {gradient[s] / slope, slope};
  }
}

void Pass::sample_bounce(std::size_t part) {
  const std::size_t begin = segments.ray_begin()[first_ray[part]], n = segments.ray_begin()[first_ray[part + 1]] - begin;
  TrilinearSampler({&field.albedo_topology(), field.albedo_transform(), 1, numbers(field.log_bounce)})
      .sample(segments.point_m().subspan(begin, n), std::span(bounce_albedo).subspan(begin, n));
  const auto exponent = double{field.exponent.data_ptr<float>()[0]};
  for_each_segment(part, [&](std::size_t s, std::size_t ray) {
    const double level_cosine = cosine(level_direction(segments.ray_direction()[ray]), normal[s]);
    bounce_albedo[s] = std::exp(bounce_albedo[s]);
    bounce[s] = static_cast<float>(double{bounce_albedo[s]} * lobe(level_cosine, exponent).cos_to_p);
  });
}

void Pass::sample(std::size_t part) {
  const std::size_t first = first_end[part], n_ends = first_end[part + 1] - first;
  TrilinearSampler(view_of(field, numbers(field.distance)))
      .sample(std::span(end_m).subspan(first, n_ends), std::span(distance_m).subspan(first, n_ends));
  const std::size_t begin = segments.ray_begin()[first_ray[part]], end = segments.ray_begin()[first_ray[part + 1]];
  const auto of_part = std::span(albedo).subspan(begin, end - begin);
  const auto points_m = segments.point_m().subspan(begin, end - begin);
  TrilinearSampler(albedo_of(field)).sample(points_m, of_part);
  if (field.has_directional()) {
    std::vector<float> coefficients(points_m.size() * kHarmonics);
    TrilinearSampler(directional_of(field)).sample(points_m, coefficients);
    for (std::size_t q = first_ray[part]; q < first_ray[part + 1]; ++q) {
      const auto y = spherical_harmonics(segments.ray_direction()[q], kDegree);
      for (std::size_t s = segments.ray_begin()[q]; s < segments.ray_begin()[q + 1]; ++s)
        for (std::size_t k = 0; k < kHarmonics; ++k) albedo[s] += y[k] * coefficients[(s - begin) * kHarmonics + k];
    }
  }
  const auto exponent = double{field.exponent.data_ptr<float>()[0]};
  for (std::size_t s = begin; s < end; ++s) {
    const double length = double{length_m[s]};
    const SurfaceDepth at = surface_depth(double{distance_m[near_end[s]]}, double{distance_m[near_end[s] + 1]}, length, field.sharpness_per_m());
    extinction_per_m[s] = static_cast<float>(at.depth / (2.0 * length));
  }
  sample_normals(part);
  if (bounces) sample_bounce(part);
  for_each_segment(part, [&](std::size_t s, std::size_t ray) {
    albedo[s] = std::exp(albedo[s]);
    brightness[s] = static_cast<float>(double{albedo[s]} * lobe(cosine(segments.ray_direction()[ray], normal[s]), exponent).cos_to_p);
  });
}

void Pass::scatter_directional(std::size_t part, std::span<const float> d_brightness) {
  const std::size_t begin = segments.ray_begin()[first_ray[part]], end = segments.ray_begin()[first_ray[part + 1]];
  std::vector<float> d_coefficients((end - begin) * kHarmonics);
  for (std::size_t q = first_ray[part]; q < first_ray[part + 1]; ++q) {
    const auto y = spherical_harmonics(segments.ray_direction()[q], kDegree);
    for (std::size_t s = segments.ray_begin()[q]; s < segments.ray_begin()[q + 1]; ++s)
      for (std::size_t k = 0; k < kHarmonics; ++k) d_coefficients[(s - begin) * kHarmonics + k] = d_brightness[s] * brightness[s] * y[k];
  }
  std::vector<float>& sum = gradients[part].directional;
  sum.assign(static_cast<std::size_t>(field.directional.numel()), 0.0f);
  scatter_trilinear({&field.albedo_topology(), field.albedo_transform(), kHarmonics, sum},
                    segments.point_m().subspan(begin, end - begin), d_coefficients);
}

void Pass::scatter_bounce(std::size_t part, std::span<const float> d_bounce, std::span<glm::vec3> d_gradients) {
  Gradients& mine = gradients[part];
  const std::size_t begin = segments.ray_begin()[first_ray[part]], n = segments.ray_begin()[first_ray[part + 1]] - begin;
  std::vector<float> d_albedo(n);
  const auto exponent = double{field.exponent.data_ptr<float>()[0]};
  for_each_segment(part, [&](std::size_t s, std::size_t ray) {
    const glm::vec3 level = level_direction(segments.ray_direction()[ray]);
    const double c = cosine(level, normal[s]), by_bounce = double{d_bounce[s]} * double{bounce_albedo[s]};
    const Lobe at = lobe(c, exponent);
    d_gradients[s - begin] += static_cast<float>(by_bounce * at.by_cosine) * cosine_by_gradient(level, normal[s], c);
    d_albedo[s - begin] = static_cast<float>(by_bounce * at.cos_to_p);
    mine.exponent += by_bounce * at.by_exponent;
  });
  mine.log_bounce.assign(static_cast<std::size_t>(field.log_bounce.numel()), 0.0f);
  scatter_trilinear({&field.albedo_topology(), field.albedo_transform(), 1, mine.log_bounce}, segments.point_m().subspan(begin, n), d_albedo);
}

void Pass::scatter(std::size_t part, std::span<const float> d_extinction, std::span<const float> d_brightness,
                   std::span<const float> d_bounce) {
  Gradients& mine = gradients[part];
  mine.distance.assign(field.n_voxels(), 0.0f);
  mine.log_albedo.assign(static_cast<std::size_t>(field.log_albedo.numel()), 0.0f);
  mine.exponent = 0.0;
  const std::size_t begin = segments.ray_begin()[first_ray[part]], n = segments.ray_begin()[first_ray[part + 1]] - begin;
  const std::size_t first = first_end[part], n_ends = first_end[part + 1] - first;
  std::vector<float> d_ends(n_ends, 0.0f), d_albedo(n);
  std::vector<glm::vec3> d_gradients(n);
  const auto exponent = double{field.exponent.data_ptr<float>()[0]};
  for_each_segment(part, [&](std::size_t s, std::size_t ray) {
    const double length = double{length_m[s]};
    const SurfaceDepth depth = surface_depth(double{distance_m[near_end[s]]}, double{distance_m[near_end[s] + 1]}, length, field.sharpness_per_m());
    const double by_depth = double{d_extinction[s]} / (2.0 * length);
    d_ends[near_end[s] - first] += static_cast<float>(by_depth * depth.by_near);
    d_ends[near_end[s] + 1 - first] += static_cast<float>(by_depth * depth.by_far);
    const glm::vec3& direction = segments.ray_direction()[ray];
    const double c = cosine(direction, normal[s]), by_brightness = double{d_brightness[s]} * double{albedo[s]};
    const Lobe at = lobe(c, exponent);
    d_gradients[s - begin] = static_cast<float>(by_brightness * at.by_cosine) * cosine_by_gradient(direction, normal[s], c);
    d_albedo[s - begin] = static_cast<float>(by_brightness * at.cos_to_p);
    mine.exponent += by_brightness * at.by_exponent;
  });
  if (bounces) scatter_bounce(part, d_bounce, d_gradients);
  const BrickView<float> distance{&field.topology(), field.transform(), 1, mine.distance};
  scatter_trilinear(distance, std::span(end_m).subspan(first, n_ends), d_ends);
  scatter_gradients(distance, segments.point_m().subspan(begin, n), d_gradients);
  scatter_trilinear({&field.albedo_topology(), field.albedo_transform(), 1, mine.log_albedo}, segments.point_m().subspan(begin, n), d_albedo);
}

/// The pass as an autograd function of LibTorch.
struct RenderSurface : torch::autograd::Function<RenderSurface> {
  static torch::autograd::variable_list forward(torch::autograd::AutogradContext* context, const torch::Tensor&,
                                                const torch::Tensor&, const torch::Tensor&, const torch::Tensor&, const torch::Tensor&,
                                                const c10::intrusive_ptr<Pass>& pass) {
    context->saved_data["pass"] = torch::IValue::make_capsule(pass);
    torch::Tensor pixels = torch::empty({static_cast<std::int64_t>(pass->segments.n_pixels())}, torch::kFloat);
    pass->segments.integrate(pass->extinction_per_m, pass->brightness, Integrator::exact, numbers(pixels), pass->bounce);
    return {pixels};
  }

  static torch::autograd::variable_list backward(torch::autograd::AutogradContext* context,
                                                 torch::autograd::variable_list gradients) {
    const auto pass = c10::static_intrusive_pointer_cast<Pass>(context->saved_data["pass"].toCapsule());
    const SurfaceField& field = pass->field;
    std::vector<float> d_extinction(pass->segments.n_segments()), d_brightness(d_extinction.size());
    std::vector<float> d_bounce(pass->bounce.size());
    pass->segments.adjoint(numbers(gradients[0].contiguous()), Integrator::exact, d_extinction, d_brightness, d_bounce);
    pass->gradients.resize(pass->n_parts());
    const bool directional = field.has_directional();
    parallel_for(pass->n_parts(), 1, [&](std::size_t part, std::size_t, int) {
      if (directional)
        pass->scatter_directional(part, d_brightness);
      else
        pass->scatter(part, d_extinction, d_brightness, d_bounce);
    });
    const auto sum = [&](const torch::Tensor& of, auto member) {
      torch::Tensor to = torch::empty_like(of);
      float* const out = to.data_ptr<float>();
      parallel_for(static_cast<std::size_t>(to.numel()), std::size_t{1} << 14, [&](std::size_t begin, std::size_t end, int) {
        for (std::size_t v = begin; v < end; ++v) {
          out[v] = 0.0f;
          for (const Pass::Gradients& g : pass->gradients) out[v] += (g.*member)[v];
        }
      });
      return to;
    };
    if (directional) return {{}, {}, {}, {}, sum(field.directional, &Pass::Gradients::directional), {}};
    double d_exponent = 0.0;
    for (const Pass::Gradients& g : pass->gradients) d_exponent += g.exponent;
    return {sum(field.distance, &Pass::Gradients::distance), sum(field.log_albedo, &Pass::Gradients::log_albedo),
            torch::full({1}, d_exponent, torch::kFloat),
            pass->bounces ? sum(field.log_bounce, &Pass::Gradients::log_bounce) : torch::Tensor(), {}, {}};
  }
};

}  // namespace

torch::Tensor SurfaceField::render_rows(std::span<const RowRequest> rows, const RaySampling& sampling) const {
  return RenderSurface::apply(distance, log_albedo, exponent, log_bounce, directional, c10::make_intrusive<Pass>(rows, sampling, *this)).front();
}

void SurfaceField::render_rows(std::span<const RowRequest> rows, const RaySampling& sampling, std::span<float> pixels) const {
  if (pixels.size() != n_pixels(rows))
    throw UsageError(format("the rows have %zu pixels, not %zu", n_pixels(rows), pixels.size()));
  for (std::size_t first = 0; first < rows.size(); first += kRowsAtATime) {
    const auto some = rows.subspan(first, std::min(kRowsAtATime, rows.size() - first));
    Pass pass(some, sampling, *this);
    pass.segments.integrate(pass.extinction_per_m, pass.brightness, Integrator::exact, pixels.first(pass.segments.n_pixels()), pass.bounce);
    pixels = pixels.subspan(pass.segments.n_pixels());
  }
}

}  // namespace sarnerf

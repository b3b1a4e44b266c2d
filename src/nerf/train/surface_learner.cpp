// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include <torch/csrc/autograd/autograd.h>

#include "field/tensors.h"
#include "files/archives.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/parallel.h"
#include "sarnerf/field/brick_lines.h"
#include "sarnerf/nerf/occupancy_grid.h"
#include "sarnerf/nerf/surface_field.h"
#include "train/field_learner.h"

namespace sarnerf {

namespace {

constexpr std::size_t kGrain = std::size_t{1} << 13;  ///< voxels that a thread takes at a time

/// Adam (Kingma and Ba 2015, algorithm 1) for one tensor of parameters, with the root of the second moment never below a fraction
/// of its largest value: parameters that hardly matter would else move as fast as the others. β₁ = 0.9, β₂ = 0.99.
class FlooredAdam {
 public:
  explicit FlooredAdam(const torch::Tensor& value) : mean_(torch::zeros_like(value.detach())), square_(torch::zeros_like(mean_)) {}

  /// A step along `gradient`, `rate` long. Calls move(parameter, by) for each parameter that is to change.
  template <class Move>
  void step(std::span<const float> gradient, double rate, double least, Move&& move) {
    ++n_steps_;
    float* const mean = mean_.data_ptr<float>();
    float* const square = square_.data_ptr<float>();
    parallel_for(gradient.size(), kGrain, [&](std::size_t begin, std::size_t end, int) {
      for (std::size_t n = begin; n < end; ++n) {
        mean[n] = kBeta1 * mean[n] + (1.0f - kBeta1) * gradient[n];
        square[n] = kBeta2 * square[n] + (1.0f - kBeta2) * gradient[n] * gradient[n];
      }
    });
    const float largest = std::sqrt(square_.max().item<float>());
    if (!(largest > 0.0f)) return;
    const auto t = static_cast<double>(n_steps_);
    const double mean_scale = 1.0 / (1.0 - std::pow(double{kBeta1}, t)), root_scale = 1.0 / std::sqrt(1.0 - std::pow(double{kBeta2}, t));
    const auto scale = static_cast<float>(rate * mean_scale / root_scale);
    const float floor = static_cast<float>(least) * largest;
    parallel_for(gradient.size(), kGrain, [&](std::size_t begin, std::size_t end, int) {
      for (std::size_t n = begin; n < end; ++n) {
        const float size = std::sqrt(square[n]) + floor;  // 0 where squares of tiny gradients vanish, and there is no floor
        if (mean[n] != 0.0f && size > 0.0f) move(n, -scale * mean[n] / size);
      }
    });
  }

  /// For parameters of a refined field: `refine` interpolates values, and gradients become `scale` times as large.
  template <class Refine>
  void refine(Refine&& refine, double scale) {
    mean_ = scale * refine(mean_);
    square_ = scale * scale * refine(square_);
  }

  void save(Archive& archive, const std::string& name) const {
    archive.tensors["adam_mean_" + name] = mean_.clone();
    archive.tensors["adam_square_" + name] = square_.clone();
    archive.tensors["adam_steps_" + name] = torch::tensor({n_steps_}, torch::kInt64);
  }
  void restore(const Archive& archive, const std::string& name, const std::string& where) {
    n_steps_ = archive.tensor("adam_steps_" + name, torch::kInt64, 1, where)[0].item<std::int64_t>();
    for (auto& [key, to] : {std::pair("adam_mean_" + name, &mean_), std::pair("adam_square_" + name, &square_)}) {
      const torch::Tensor t = archive.tensor(key, torch::kFloat, to->dim(), where);
      if (t.sizes() != to->sizes())
        throw CheckpointError(where + ": the field and its optimiser do not belong together; the file is damaged");
      *to = t.clone();
    }
  }

 private:
  static constexpr float kBeta1 = 0.9f, kBeta2 = 0.99f;
  torch::Tensor mean_, square_;
  std::int64_t n_steps_ = 0;
};

/// Learns a SurfaceField. It starts from the carved hull. In each step the gradients by the distance and by the albedo are
/// smoothed, so that a neighbourhood changes as a whole; Adam, which follows, gives each voxel a step of its own length. Voxels
/// that no ray has reached lately keep their distance: tiny gradients would else move them as fast as others. From time to time
/// the distance is measured anew from its level 0, so that its gradient keeps the length 1. Learning goes from coarse to fine: the
/// softness 1 / s and the filters' lengths fall exponentially, and the distance's voxels are halved.
class SurfaceLearner : public FieldLearner {
 public:
  SurfaceLearner(const TrainingSet& set, const SurfaceOptions& options, const CarvedVoxels& hull);

  const LearnedField& field() const override { return field_; }
  bool adapt(double progress, std::int64_t epoch_steps) override;
  void minimise(const torch::Tensor& pixels, const torch::Tensor& gradient, double rate) override;
  void set_ground(std::shared_ptr<const LevelGround> ground) override { field_.ground = std::move(ground); }
  Archive state() const override;
  void restore(const Archive& archive, const std::string& where) override;

 private:
  void start_from(const CarvedVoxels& hull);
  void match_albedo(const TrainingSet& set);
  void measure_distance();
  void refine();
  void blur(const BrickLines& lines, double bins2, double voxel_m, std::span<float> gradient) const;
  void move_surface(double rate);

  SurfaceOptions options_;
  double bin_m_;
  SurfaceField field_;
  BrickLines lines_, albedo_lines_;
  FlooredAdam adam_distance_, adam_albedo_, adam_exponent_, adam_bounce_, adam_directional_;
  int level_ = 0;             ///< halvings so far
  torch::Tensor least_m_;     ///< [n_voxels] the distance from the hull, less what the surface may lie outside of it
  torch::Tensor last_reach_;  ///< [n_voxels] number of the last step in which a ray's gradient reached the voxel; −1: none
  double smoothing_bins2_ = 0.0, albedo_smoothing_bins2_ = 0.0;  ///< at present
  std::int64_t steps_ = 0;
};

/// Bricks with a voxel that is nearer than `margin` voxels to an active one.
BrickTopology bricks_around(const CarvedVoxels& voxels, int margin) {
  BrickTopology near;
  for (std::uint32_t b = 0; b < voxels.topology.n_bricks(); ++b) {
    glm::ivec3 low(kBrickSide), high(-1);
    for (int v = 0; v < kBrickVoxels; ++v) {
      if (voxels.active[std::size_t{b} * kBrickVoxels + static_cast<std::size_t>(v)] == 0) continue;
      low = glm::min(low, voxel_in_brick(v));
      high = glm::max(high, voxel_in_brick(v));
    }
    if (high.x < 0) continue;
    const glm::ivec3 origin = voxels.topology.coordinate(b) * kBrickSide;
    const glm::ivec3 first = brick_of_voxel(origin + low - margin), last = brick_of_voxel(origin + high + margin);
    for (int x = first.x; x <= last.x; ++x)
      for (int y = first.y; y <= last.y; ++y)
        for (int z = first.z; z <= last.z; ++z) near.insert({x, y, z});
  }
  return near;
}

double first_voxel_m(const SurfaceOptions& o) { return o.voxel_size_m * std::exp2(o.n_levels - 1); }

SurfaceField empty_field(const TrainingSet& set, const CarvedVoxels& hull, const SurfaceOptions& o, double bin_m) {
  const double band_m = SurfaceField::band_m(1.0 / (o.initial_softness_bins * bin_m)) + 2.0 * first_voxel_m(o);
  const int margin = static_cast<int>(std::ceil(band_m / first_voxel_m(o))) + 2;
  SurfaceField field(grid_transform(set, first_voxel_m(o)), bricks_around(hull, margin), o.albedo_bins * bin_m, band_m);
  if (set.ground) field.ground = set.ground->plane;
  field.resolution = set.resolution;
  return field;
}

SurfaceLearner::SurfaceLearner(const TrainingSet& set, const SurfaceOptions& options, const CarvedVoxels& hull)
    : options_(options), bin_m_(set.finest_bin_m()), field_(empty_field(set, hull, options, bin_m_)), lines_(field_.topology()),
      albedo_lines_(field_.albedo_topology()), adam_distance_(field_.distance), adam_albedo_(field_.log_albedo), adam_exponent_(field_.exponent), adam_bounce_(field_.log_bounce), adam_directional_(field_.directional),
      last_reach_(torch::full({field_.distance.numel()}, -1, torch::kLong)) {
  start_from(hull);
  least_m_ = field_.distance.detach() - options_.beyond_hull_bins * bin_m_;
  field_.set_sharpness(1.0 / (options_.initial_softness_bins * bin_m_));
  field_.refresh();
  match_albedo(set);
  if (options_.bounce && field_.ground) {
    field_.start_bounce();
    adam_bounce_ = FlooredAdam(field_.log_bounce);
  }
}

/// The distance from the hull. Over a ground the hull goes on below it: the ground hides a body's bottom, which is then no surface.
void SurfaceLearner::start_from(const CarvedVoxels& hull) {
  const auto f = numbers(field_.distance);
  std::fill(f.begin(), f.end(), 0.5f);
  for (std::uint32_t b = 0; b < hull.topology.n_bricks(); ++b) {
    const std::uint32_t to = field_.topology().find(hull.topology.coordinate(b));
    for (std::size_t v = 0; v < kBrickVoxels; ++v)
      if (hull.active[std::size_t{b} * kBrickVoxels + v] != 0) f[std::size_t{to} * kBrickVoxels + v] = -0.5f;
  }
  if (field_.ground) {
    const double above = field_.transform().index_from_world({0.0, field_.ground->height_m, 0.0}).y;
    const int lowest = static_cast<int>(std::floor(above)) + 1;
    const BrickTopology& bricks = field_.topology();
    for (std::size_t n = 0; n < f.size(); ++n) {
      glm::ivec3 voxel = bricks.voxel(n);
      if (voxel.y >= lowest) continue;
      voxel.y = lowest;
      const std::uint32_t brick = bricks.find(brick_of_voxel(voxel));
      if (brick != kNoBrick) f[n] = f[std::size_t{brick} * kBrickVoxels + static_cast<std::size_t>(offset_in_brick(voxel))];
    }
  }
  measure_distance();
}

void SurfaceLearner::measure_distance() {
  const auto f = numbers(field_.distance);
  const auto size_m = static_cast<float>(field_.voxel_size_m());
  redistance(lines_, static_cast<float>(field_.most_band_m()) / size_m, f);
  for (float& v : f) v *= size_m;
}

/// How far (bins) the surface may move outward after a halving: farther bricks are left out.
constexpr double kReach_bins = 2.0;

void SurfaceLearner::refine() {
  const torch::NoGradGuard no_grad;
  SurfaceField fine = refined(field_, kReach_bins * bin_m_);
  const auto far_m = static_cast<float>(field_.most_band_m());
  const auto values = [&](const torch::Tensor& t) { return refined_values(field_, t, fine, 0.0f); };
  const auto albedo = [&](const torch::Tensor& t) { return refined_albedo(field_, t, fine); };
  least_m_ = torch::maximum(refined_values(field_, least_m_, fine, far_m), fine.distance.detach() - kReach_bins * bin_m_);
  adam_distance_.refine(values, 0.125);  // a fine voxel has an eighth of a coarse one's weights
  adam_albedo_.refine(albedo, 1.0);
  if (field_.has_bounce()) adam_bounce_.refine(albedo, 1.0);
  torch::Tensor last_reach = torch::full({fine.distance.numel()}, -1, torch::kLong);
  for (std::size_t v = 0; v < fine.n_voxels(); ++v) {
    const glm::ivec3 voxel = fine.topology().voxel(v);
    const glm::ivec3 nearest(voxel.x >> 1, voxel.y >> 1, voxel.z >> 1);
    const std::uint32_t brick = field_.topology().find(brick_of_voxel(nearest));
    if (brick == kNoBrick) continue;
    const std::size_t from = std::size_t{brick} * kBrickVoxels + static_cast<std::size_t>(offset_in_brick(nearest));
    last_reach.data_ptr<std::int64_t>()[v] = last_reach_.data_ptr<std::int64_t>()[from];
  }
  last_reach_ = last_reach;
  field_ = std::move(fine);
  lines_ = BrickLines(field_.topology());
  albedo_lines_ = BrickLines(field_.albedo_topology());
  measure_distance();
  field_.refresh();
  ++level_;
}

/// Views that the first albedo is taken from.
constexpr std::size_t kViewsToMatch = 6;

/// One albedo for all, by least squares over every other row of some views.
void SurfaceLearner::match_albedo(const TrainingSet& set) {
  double product = 0.0, square = 0.0;
  const std::size_t n_views = set.images.size(), stride = std::max<std::size_t>(1, n_views / kViewsToMatch);
  for (std::size_t v = 0; v < n_views; v += stride) {
    const PosedImage& image = set.training_images()[v];
    std::vector<RowRequest> rows;
    for (int i = 0; i < image.power.n_azimuth(); i += 2) rows.push_back({image.acquisition, i});
    std::vector<float> pixels(n_pixels(rows));
    RaySampling sampling;
    sampling.ray_spacing_m = sampling.longest_m = field_.voxel_size_m();
    // The ground is no part of the body.
    const auto ground = std::exchange(field_.ground, nullptr);
    field_.render_rows(rows, sampling, pixels);
    field_.ground = ground;
    const float* rendered = pixels.data();
    for (const RowRequest& row : rows)
      for (const float seen : image.power.row(row.row)) {
        const double of_body = double{*rendered++};
        product += of_body * double{seen};
        square += of_body * of_body;
      }
  }
  const torch::NoGradGuard no_grad;
  if (product > 0.0 && square > 0.0) field_.log_albedo.fill_(std::log(product / square));
}

bool SurfaceLearner::adapt(double progress, std::int64_t) {
  if (field_.has_directional()) return false;
  const double of_shape = progress / options_.shape_until, part = std::min(1.0, of_shape / options_.anneal_until);
  const auto between = [&](double first, double last) { return first * std::pow(last / first, part); };
  const double softness_bins = between(options_.initial_softness_bins, options_.final_softness_bins);
  smoothing_bins2_ = between(options_.smoothing_bins2, options_.final_smoothing_bins2);
  albedo_smoothing_bins2_ = between(options_.albedo_smoothing_bins2, options_.final_albedo_smoothing_bins2);
  field_.set_sharpness(1.0 / (softness_bins * bin_m_));
  if (steps_ > 0 && steps_ % options_.redistance_steps == 0) {
    const torch::NoGradGuard no_grad;
    measure_distance();
    field_.distance.copy_(torch::maximum(field_.distance, least_m_));
  }
  const Box before = field_.occupied_box_m();
  if (level_ + 1 < options_.n_levels && of_shape >= options_.refined_by * (level_ + 1) / (options_.n_levels - 1)) {
    refine();
    return true;
  }
  if (of_shape >= 1.0) {
    field_.start_directional();
    adam_directional_ = FlooredAdam(field_.directional);
  } else if (steps_ % options_.refresh_steps != 0) {
    return false;
  }
  field_.refresh();
  const Box after = field_.occupied_box_m();
  return before.min != after.min || before.max != after.max;
}

/// The filter (1 − a ∂²)⁻¹ along each axis, twice.
void SurfaceLearner::blur(const BrickLines& lines, double bins2, double voxel_m, std::span<float> gradient) const {
  for (int pass = 0; pass < 2; ++pass) smooth(lines, bins2 * std::pow(bin_m_ / voxel_m, 2), gradient);
}

void SurfaceLearner::move_surface(double rate) {
  const auto f = numbers(field_.distance), gradient = numbers(field_.distance.grad());
  const float* const least_m = least_m_.data_ptr<float>();
  auto* const last_reach = last_reach_.data_ptr<std::int64_t>();
  for (std::size_t v = 0; v < gradient.size(); ++v)
    if (gradient[v] != 0.0f) last_reach[v] = steps_;
  blur(lines_, smoothing_bins2_, field_.voxel_size_m(), gradient);
  const double step_m = rate * options_.step_bins * bin_m_;
  adam_distance_.step(gradient, step_m, options_.least_moment, [&](std::size_t v, float by) {
    if (last_reach[v] >= 0 && steps_ - last_reach[v] <= options_.reached_steps) f[v] = std::max(f[v] + by, least_m[v]);
  });
}

/// Exponents of the cosine that a surface can have.
constexpr double kMostExponent = 8.0;

void SurfaceLearner::minimise(const torch::Tensor& pixels, const torch::Tensor& gradient, double rate) {
  for (torch::Tensor& parameter : field_.parameters()) parameter.mutable_grad() = torch::Tensor();
  torch::autograd::backward({pixels}, {gradient});
  const torch::NoGradGuard no_grad;
  const auto follow = [&](torch::Tensor& of, FlooredAdam& adam, double step) {
    const auto value = numbers(of);
    adam.step(numbers(of.grad()), step, options_.least_moment, [&](std::size_t n, float by) { value[n] += by; });
  };
  ++steps_;
  if (field_.has_directional()) return follow(field_.directional, adam_directional_, rate * options_.directional_rate);
  move_surface(rate);
  const auto follow_albedo = [&](torch::Tensor& of, FlooredAdam& adam) {
    blur(albedo_lines_, albedo_smoothing_bins2_, field_.albedo_transform().voxel_size_m, numbers(of.grad()));
    follow(of, adam, rate * options_.albedo_rate);
  };
  follow_albedo(field_.log_albedo, adam_albedo_);
  if (field_.has_bounce()) follow_albedo(field_.log_bounce, adam_bounce_);
  follow(field_.exponent, adam_exponent_, rate * options_.exponent_rate);
  field_.exponent.clamp_(0.0, kMostExponent);
}

Archive SurfaceLearner::state() const {
  Archive archive = field_.state();
  adam_distance_.save(archive, "distance");
  adam_albedo_.save(archive, "albedo");
  adam_exponent_.save(archive, "exponent");
  if (field_.has_bounce()) adam_bounce_.save(archive, "bounce");
  if (field_.has_directional()) adam_directional_.save(archive, "directional");
  archive.tensors["least_distance"] = least_m_.clone();
  archive.tensors["extinction"] = torch::tensor(field_.cache().extinction_per_m());
  archive.tensors["last_reach"] = last_reach_.clone();
  add_text(archive, "learner", {{"steps", steps_}, {"level", level_}});
  return archive;
}

void SurfaceLearner::restore(const Archive& archive, const std::string& where) {
  field_ = restore_surface_field(archive, where);
  lines_ = BrickLines(field_.topology());
  albedo_lines_ = BrickLines(field_.albedo_topology());
  adam_distance_ = FlooredAdam(field_.distance);
  adam_albedo_ = FlooredAdam(field_.log_albedo);
  adam_distance_.restore(archive, "distance", where);
  adam_albedo_.restore(archive, "albedo", where);
  adam_exponent_.restore(archive, "exponent", where);
  adam_bounce_ = FlooredAdam(field_.log_bounce);
  if (field_.has_bounce()) adam_bounce_.restore(archive, "bounce", where);
  adam_directional_ = FlooredAdam(field_.directional);
  if (field_.has_directional()) adam_directional_.restore(archive, "directional", where);
  const auto take = [&](const char* name, torch::ScalarType type, torch::Tensor& to) {
    const torch::Tensor t = archive.tensor(name, type, 1, where);
    if (t.sizes() != field_.distance.sizes()) throw CheckpointError(where + ": '" + name + "' is of another field; the file is damaged");
    to = t.clone();
  };
  take("least_distance", torch::kFloat, least_m_);
  take("last_reach", torch::kLong, last_reach_);
  // The occupied space is that of an earlier step.
  const torch::Tensor extinction = archive.tensor("extinction", torch::kFloat, 1, where).contiguous();
  if (extinction.numel() != field_.distance.numel()) throw CheckpointError(where + ": 'extinction' is of another field; the file is damaged");
  field_.restore_cache(numbers(extinction));
  const Json text = text_of(archive, "learner", where);
  steps_ = member<std::int64_t>(text, "steps", where);
  level_ = member<int>(text, "level", where);
}

/// The voxels of the first body, in place of the hull's.
CarvedVoxels start_of(const std::string& start, CarvedVoxels hull, const GridTransform& transform, double ground_height_m) {
  if (start == "hull") return hull;
  if (start != "box" && start != "sphere") throw UsageError("start: expected hull, box or sphere, found '" + start + "'");
  glm::ivec3 low(std::numeric_limits<int>::max()), high(std::numeric_limits<int>::min());
  for (std::size_t v = 0; v < hull.active.size(); ++v) {
    if (hull.active[v] == 0) continue;
    low = glm::min(low, hull.topology.voxel(v));
    high = glm::max(high, hull.topology.voxel(v));
  }
  if (low.x > high.x) return hull;
  const glm::dvec3 centre = 0.5 * glm::dvec3(low + high), half = 0.5 * glm::dvec3(high - low) + 0.5;
  const double radius = start == "sphere" ? glm::length(half) : 0.0;
  if (start == "sphere") {
    low = glm::ivec3(glm::floor(centre - radius));
    high = glm::ivec3(glm::ceil(centre + radius));
  }
  CarvedVoxels body;
  for (int x = low.x; x <= high.x; ++x)
    for (int y = low.y; y <= high.y; ++y)
      for (int z = low.z; z <= high.z; ++z) {
        const glm::dvec3 voxel(x, y, z);
        if (start == "sphere" && glm::length(voxel - centre) > radius) continue;
        if (transform.world_from_index(voxel).y <= ground_height_m) continue;
        body.add({x, y, z});
      }
  return body;
}

}  // namespace

std::unique_ptr<FieldLearner> make_surface_learner(const TrainingSet& set, const SurfaceOptions& options, const Monitor& monitor) {
  const GridTransform transform = grid_transform(set, first_voxel_m(options));
  const double ground_height_m = set.ground ? set.ground->plane->height_m : -std::numeric_limits<double>::infinity();
  return std::make_unique<SurfaceLearner>(
      set, options, start_of(options.start, carve(set, transform, monitor), transform, ground_height_m));
}

}  // namespace sarnerf

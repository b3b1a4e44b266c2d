// SPDX-License-Identifier: Apache-2.0
#include "train/grid_learner.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <torch/csrc/autograd/autograd.h>

#include "files/archives.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/parallel.h"
#include "sarnerf/nerf/occupancy_grid.h"

namespace sarnerf {

std::vector<RowReference> rows_that_see(const TrainingSet& set, const Box& box_m) {
  std::vector<RowReference> rows;
  if (box_m.empty()) return rows;
  for (std::uint32_t v = 0; v < set.images.size(); ++v) {
    const Acquisition& a = set.images[v].acquisition;
    const glm::dvec3 h = radar_frame(a).h;
    double low_m = std::numeric_limits<double>::infinity(), high_m = -low_m;
    for (const glm::dvec3& corner : box_m.corners()) {
      low_m = std::min(low_m, glm::dot(corner, h));
      high_m = std::max(high_m, glm::dot(corner, h));
    }
    for (int i = 0; i < a.n_azimuth; ++i) {
      if (a.row_offset_m(i + 0.5) >= low_m && a.row_offset_m(i - 0.5) <= high_m)
        rows.push_back({v, static_cast<std::uint32_t>(i)});
    }
  }
  return rows;
}

GridField initial_grid_field(const TrainingSet& set, const GridOptions& options, const Monitor& monitor) {
  const GridTransform transform =
      grid_transform(set, options.voxel_size_m * std::exp2(options.n_levels - 1));
  CarvedVoxels carved = carve(set, transform, monitor);
  GridField field(transform, options.harmonics_degree, double{set.bright});
  if (set.ground) field.ground = set.ground->plane;
  field.resolution = set.resolution;
  const auto n = std::count(carved.active.begin(), carved.active.end(), std::uint8_t{1});
  auto coefficients = torch::zeros({n, field.channels().n_source()});
  coefficients.select(1, 0).fill_(options.initial_brightness * std::sqrt(4.0 * std::numbers::pi));
  const torch::Tensor log_depth = torch::full({n}, std::log(options.initial_depth));
  field.set_voxels(std::move(carved.topology), carved.active, log_depth, coefficients);
  return field;
}

namespace {

constexpr std::size_t kGrain = 1 << 12;  ///< voxels that a thread takes at a time
constexpr float kBeta1 = 0.9f, kBeta2 = 0.99f, kEpsilon = 1e-15f;

/// Parameters of one kind, their gradients and moments: `n` values for each voxel.
struct Parameters {
  float* value;
  const float* gradient;
  float* mean;
  float* square;
  std::size_t n;
  float rate;  ///< learning rate over 1 − β₁ᵗ, the mean's bias correction

  void move(std::size_t voxel, float square_correction) const {
    for (std::size_t k = voxel * n; k < (voxel + 1) * n; ++k) {
      mean[k] = kBeta1 * mean[k] + (1.0f - kBeta1) * gradient[k];
      square[k] = kBeta2 * square[k] + (1.0f - kBeta2) * gradient[k] * gradient[k];
      value[k] -= rate * mean[k] / (std::sqrt(square[k] * square_correction) + kEpsilon);
    }
  }
};

}  // namespace

VoxelAdam::VoxelAdam(const GridField& field)
    : mean_density_(torch::zeros_like(field.log_depth.detach())),
      square_density_(torch::zeros_like(mean_density_)),
      mean_source_(torch::zeros_like(field.coefficients.detach())),
      square_source_(torch::zeros_like(mean_source_)) {}

void VoxelAdam::step(GridField& field, std::span<const std::uint8_t> moves, const Rates& rates) {
  ++steps_;
  const auto t = static_cast<double>(steps_);
  const double mean_correction = 1.0 / (1.0 - std::pow(double{kBeta1}, t));
  const auto square_correction = static_cast<float>(1.0 / (1.0 - std::pow(double{kBeta2}, t)));
  const auto of = [&](torch::Tensor& value, torch::Tensor& mean, torch::Tensor& square, double rate) {
    return Parameters{value.data_ptr<float>(), value.grad().data_ptr<float>(), mean.data_ptr<float>(),
                      square.data_ptr<float>(),
                      value.dim() == 1 ? std::size_t{1} : static_cast<std::size_t>(value.size(1)),
                      static_cast<float>(rate * mean_correction)};
  };
  const Parameters density = of(field.log_depth, mean_density_, square_density_, rates.density);
  const Parameters source = of(field.coefficients, mean_source_, square_source_, rates.source);
  parallel_for(moves.size(), kGrain, [&](std::size_t begin, std::size_t end, int) {
    for (std::size_t n = begin; n < end; ++n) {
      if (moves[n] == 0) continue;
      density.move(n, square_correction);
      source.move(n, square_correction);
    }
  });
}

void VoxelAdam::keep(const torch::Tensor& places) {
  for (torch::Tensor* t : {&mean_density_, &square_density_, &mean_source_, &square_source_})
    *t = t->index_select(0, places);
}

void VoxelAdam::save(Archive& archive) const {
  archive.tensors["adam_mean_density"] = mean_density_.clone();
  archive.tensors["adam_square_density"] = square_density_.clone();
  archive.tensors["adam_mean_source"] = mean_source_.clone();
  archive.tensors["adam_square_source"] = square_source_.clone();
}

void VoxelAdam::restore(const Archive& archive, std::int64_t steps, const std::string& where) {
  steps_ = steps;
  const auto take = [&](const char* name, torch::Tensor& to) {
    const torch::Tensor t = archive.tensor(name, torch::kFloat, static_cast<int>(to.dim()), where).clone();
    if (t.sizes() != to.sizes())
      throw CheckpointError(where + ": the field and its optimiser do not belong together; the file is damaged");
    to = t;
  };
  take("adam_mean_density", mean_density_);
  take("adam_square_density", square_density_);
  take("adam_mean_source", mean_source_);
  take("adam_square_source", square_source_);
}

namespace {

/// Progress at which the last halving is due; earlier ones are due before, at equal intervals.
constexpr double kRefinedBy = 0.25;

/// After a halving or pruning, the next pruning waits until every row was used once, or for this many steps if that is less: by
/// then rays have met each voxel from many directions.
constexpr std::int64_t kStepsToPrune = 20;

/// Largest two-way depth of a voxel: more would only make it slower to become translucent again.
constexpr double kMostDepth = 40.0;

}  // namespace

GridLearner::GridLearner(const TrainingSet& set, const GridOptions& options, const Monitor& monitor)
    : options_(options), field_(initial_grid_field(set, options, monitor)),
      adam_(field_) {}

bool GridLearner::adapt(double progress, std::int64_t epoch_steps) {
  if (steps_at_level_ == 0) level_progress_ = progress;
  const bool refines = refinement_is_due(progress);
  if (refines) refine(progress);
  const bool prunes = pruning_is_due(progress, epoch_steps);
  if (prunes) {
    n_prunings_ = prunings_by(progress);
    steps_since_change_ = 0;
    prune_voxels();
  }
  return refines || prunes;
}

bool GridLearner::refinement_is_due(double progress) const {
  if (level_ + 1 >= options_.n_levels || steps_at_level_ < std::max(1, options_.level_steps)) return false;
  if (progress / kRefinedBy * (options_.n_levels - 1) < level_ + 1) return false;
  // Progress per step at this level. If the clock measures progress, fewer steps remain: those with finer voxels take longer.
  const double step = (progress - level_progress_) / static_cast<double>(steps_at_level_);
  return 1.0 - progress >= options_.refine_steps_left * step;
}

void GridLearner::refine(double progress) {
  field_ = refined(field_);
  ++level_;
  level_progress_ = progress;
  steps_at_level_ = 0;
  steps_since_change_ = 0;
  adam_ = VoxelAdam(field_);
}

int GridLearner::prunings_by(double progress) const {
  return static_cast<int>(progress * (options_.n_prunings + 1));
}

bool GridLearner::pruning_is_due(double progress, std::int64_t epoch_steps) const {
  return progress >= options_.prune_from && prunings_by(progress) > n_prunings_ &&
         steps_since_change_ >= std::min(epoch_steps, kStepsToPrune);
}

void GridLearner::prune_voxels() {
  const float* a = field_.log_depth.data_ptr<float>();
  const auto least = static_cast<float>(std::log(options_.prune_depth));
  std::vector<std::uint8_t> keep(field_.n_active());
  for (std::size_t n = 0; n < keep.size(); ++n) keep[n] = a[n] >= least ? 1 : 0;
  adam_.keep(prune(field_, keep));
}

std::vector<std::uint8_t> GridLearner::voxels_with_gradient() const {
  const float* d = field_.log_depth.grad().data_ptr<float>();
  const float* c = field_.coefficients.grad().data_ptr<float>();
  const auto n_source = static_cast<std::size_t>(field_.channels().n_source());
  std::vector<std::uint8_t> with(field_.n_active());
  for (std::size_t n = 0; n < with.size(); ++n) with[n] = d[n] != 0.0f || c[n * n_source] != 0.0f ? 1 : 0;
  return with;
}

void GridLearner::minimise(const torch::Tensor& pixels, const torch::Tensor& gradient, double rate) {
  for (torch::Tensor& parameter : field_.parameters()) parameter.mutable_grad() = torch::Tensor();
  torch::autograd::backward({pixels}, {gradient});
  const torch::NoGradGuard no_grad;
  adam_.step(field_, voxels_with_gradient(), {rate * options_.density_rate, rate * options_.source_rate});
  field_.log_depth.clamp_max_(std::log(kMostDepth));
  ++steps_at_level_;
  ++steps_since_change_;
}

Archive GridLearner::state() const {
  Archive archive = field_.state();
  adam_.save(archive);
  add_text(archive, "learner", {{"level", level_},
            {"level_progress", level_progress_},
            {"steps_at_level", steps_at_level_},
            {"steps_since_change", steps_since_change_},
            {"prunings", n_prunings_},
            {"adam_steps", adam_.steps()}});
  return archive;
}

void GridLearner::restore(const Archive& archive, const std::string& where) {
  field_ = restore_grid_field(archive, where);
  const Json text = text_of(archive, "learner", where);
  level_ = member<int>(text, "level", where);
  level_progress_ = member<double>(text, "level_progress", where);
  steps_at_level_ = member<std::int64_t>(text, "steps_at_level", where);
  steps_since_change_ = member<std::int64_t>(text, "steps_since_change", where);
  n_prunings_ = member<int>(text, "prunings", where);
  adam_ = VoxelAdam(field_);
  adam_.restore(archive, member<std::int64_t>(text, "adam_steps", where), where);
}

}  // namespace sarnerf

// SPDX-License-Identifier: Apache-2.0
#include "train/grid_learner.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

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

}  // namespace

Neighbourhood::Neighbourhood(const GridField& field) {
  constexpr std::uint32_t kNone = 0xffffffffu;
  std::vector<std::uint32_t> place(field.n_voxels(), kNone);
  const auto active = field.active_voxels();
  for (std::uint32_t n = 0; n < active.size(); ++n) place[active[n]] = n;
  around_.resize(active.size());
  for (std::uint32_t n = 0; n < active.size(); ++n) around_[n].fill(n);
  const BrickTopology& topology = field.topology();
  for (std::uint32_t n = 0; n < active.size(); ++n) {
    const std::uint32_t brick = active[n] / kBrickVoxels;
    const glm::ivec3 in_brick = voxel_in_brick(active[n]);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      glm::ivec3 next = in_brick;
      const auto along = static_cast<int>(axis);
      ++next[along];
      std::uint32_t other = brick;
      if (next[along] == kBrickSide) {
        next[along] = 0;
        other = topology.neighbours(brick)[std::size_t{1} << (2 - axis)];
      }
      if (other == kNoBrick) continue;
      const std::uint32_t m = place[std::size_t{other} * kBrickVoxels + static_cast<std::size_t>(offset_in_brick(next))];
      if (m == kNone) continue;
      around_[n][2 * axis] = m;
      around_[m][2 * axis + 1] = n;
    }
  }
}

double Neighbourhood::smoothness(const float* parameters, std::span<const float> weight, std::span<const float> share,
                                 float* gradient) const {
  const std::size_t n_weights = weight.size();
  // Blocks are the same whatever the threads: so is the sum.
  std::vector<double> of_block((around_.size() + kGrain - 1) / kGrain);
  parallel_for(of_block.size(), 1, [&](std::size_t first_block, std::size_t end_block, int) {
    for (std::size_t block = first_block; block < end_block; ++block) {
      const std::size_t end = std::min(around_.size(), (block + 1) * kGrain);
      for (std::size_t n = block * kGrain; n < end; ++n) {
        for (std::size_t c = 0; c < n_weights; ++c) {
          const float own = parameters[n * n_weights + c];
          float differences = 0.0f, squares = 0.0f;
          for (const std::uint32_t other : around_[n]) {
            const float difference = own - parameters[other * n_weights + c];
            differences += difference;
            squares += difference * difference;
          }
          of_block[block] += 0.25 * double{weight[c]} * double{squares};  // each pair is met from both sides
          if (share[n] != 0.0f) gradient[n * n_weights + c] += weight[c] * differences;
        }
      }
    }
  });
  return std::accumulate(of_block.begin(), of_block.end(), 0.0);
}

namespace {

constexpr float kBeta1 = 0.9f, kBeta2 = 0.99f, kEpsilon = 1e-15f;

/// Parameters of one kind and what belongs to them, `n` for each voxel.
struct Parameters {
  float* value;
  const float* gradient;
  float* mean;
  float* square;
  std::size_t n;
  float rate;  ///< over the mean's bias correction
  float decay;

  void move(std::size_t voxel, float share, float square_correction) const {
    for (std::size_t k = voxel * n; k < (voxel + 1) * n; ++k) {
      mean[k] = kBeta1 * mean[k] + (1.0f - kBeta1) * gradient[k];
      square[k] = kBeta2 * square[k] + (1.0f - kBeta2) * gradient[k] * gradient[k];
      value[k] -= share * (decay * value[k] + rate * mean[k] / (std::sqrt(square[k] * square_correction) + kEpsilon));
    }
  }
};

}  // namespace

VoxelAdam::VoxelAdam(const GridField& field)
    : mean_density_(torch::zeros_like(field.log_depth.detach())),
      square_density_(torch::zeros_like(mean_density_)),
      mean_source_(torch::zeros_like(field.coefficients.detach())),
      square_source_(torch::zeros_like(mean_source_)) {}

void VoxelAdam::step(GridField& field, std::span<const float> share, const Rates& rates) {
  ++steps_;
  const auto t = static_cast<double>(steps_);
  const double mean_correction = 1.0 / (1.0 - std::pow(double{kBeta1}, t));
  const auto square_correction = static_cast<float>(1.0 / (1.0 - std::pow(double{kBeta2}, t)));
  const auto of = [&](torch::Tensor& value, torch::Tensor& mean, torch::Tensor& square, double rate, double decay) {
    return Parameters{value.data_ptr<float>(), value.grad().data_ptr<float>(), mean.data_ptr<float>(),
                      square.data_ptr<float>(),
                      value.dim() == 1 ? std::size_t{1} : static_cast<std::size_t>(value.size(1)),
                      static_cast<float>(rate * mean_correction),
                      static_cast<float>(decay)};
  };
  const Parameters density = of(field.log_depth, mean_density_, square_density_, rates.density, 0.0);
  const Parameters source = of(field.coefficients, mean_source_, square_source_, rates.source, rates.source_decay);
  parallel_for(share.size(), kGrain, [&](std::size_t begin, std::size_t end, int) {
    for (std::size_t n = begin; n < end; ++n) {
      if (share[n] == 0.0f) continue;
      density.move(n, share[n], square_correction);
      source.move(n, share[n], square_correction);
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

/// Share of the training after which all halvings are done, the first ones sooner.
constexpr double kRefinedBy = 0.25;

/// Voxels are given up no sooner than all rows were learned from since the last change, or those of so many steps: they have met
/// each voxel from many sides.
constexpr std::int64_t kStepsToPrune = 20;

/// Largest two-way depth of a voxel: more only slows down the way back.
constexpr double kMostDepth = 40.0;

}  // namespace

GridLearner::GridLearner(const TrainingSet& set, const GridOptions& options, const Monitor& monitor)
    : options_(options), field_(initial_grid_field(set, options, monitor)),
      adam_(field_) {}

bool GridLearner::adapt(double progress, std::int64_t epoch_steps) {
  progress_ = progress;
  if (steps_at_level_ == 0) level_progress_ = progress;
  const bool refines = refinement_is_due(progress);
  if (refines) refine(progress);
  const bool prunes = pruning_is_due(progress, epoch_steps);
  if (prunes) {
    n_prunings_ = prunings_by(progress);
    steps_since_change_ = 0;
    give_up_empty_voxels();
  }
  return refines || prunes;
}

bool GridLearner::refinement_is_due(double progress) const {
  if (level_ + 1 >= options_.n_levels || steps_at_level_ < std::max(1, options_.level_steps)) return false;
  if (progress / kRefinedBy * (options_.n_levels - 1) < level_ + 1) return false;
  // At the pace of this level; by the clock, finer voxels will have less.
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
  forget_layout();
}

void GridLearner::forget_layout() {
  neighbours_.reset();
}

int GridLearner::prunings_by(double progress) const {
  return static_cast<int>(progress * (options_.n_prunings + 1));
}

bool GridLearner::pruning_is_due(double progress, std::int64_t epoch_steps) const {
  return progress >= options_.prune_from && prunings_by(progress) > n_prunings_ &&
         steps_since_change_ >= std::min(epoch_steps, kStepsToPrune);
}

void GridLearner::give_up_empty_voxels() {
  const float* a = field_.log_depth.data_ptr<float>();
  const auto least = static_cast<float>(std::log(options_.prune_depth));
  std::vector<std::uint8_t> keep(field_.n_active());
  for (std::size_t n = 0; n < keep.size(); ++n) keep[n] = a[n] >= least ? 1 : 0;
  adam_.keep(prune(field_, keep));
  forget_layout();
}

double GridLearner::add_smoothness(std::span<const float> shares) {
  if (options_.smooth_angular == 0.0) return 0.0;
  if (!neighbours_) neighbours_.emplace(field_);
  std::vector<float> weights(static_cast<std::size_t>(field_.channels().n_source()), static_cast<float>(options_.smooth_angular));
  weights[0] = 0.0f;
  return neighbours_->smoothness(field_.coefficients.data_ptr<float>(), weights, shares,
                                 field_.coefficients.mutable_grad().data_ptr<float>());
}

std::vector<float> GridLearner::shares() const {
  const float* d = field_.log_depth.grad().data_ptr<float>();
  const float* c = field_.coefficients.grad().data_ptr<float>();
  const auto n_source = static_cast<std::size_t>(field_.channels().n_source());
  std::vector<float> shares(field_.n_active());
  for (std::size_t n = 0; n < shares.size(); ++n)
    if (d[n] != 0.0f || c[n * n_source] != 0.0f) shares[n] = 1.0f;
  return shares;
}

double GridLearner::minimise(const torch::Tensor& pixels, const torch::Tensor& gradient, double rate) {
  for (torch::Tensor& parameter : field_.parameters()) parameter.mutable_grad() = torch::Tensor();
  torch::autograd::backward({pixels}, {gradient});
  const std::vector<float> shares = this->shares();
  const double priors = add_smoothness(shares);
  const torch::NoGradGuard no_grad;
  const double source_rate = rate * options_.source_rate;
  const double decay = options_.brightness_decay * std::pow(options_.final_brightness_decay, progress_);
  adam_.step(field_, shares, {rate * options_.density_rate, source_rate, source_rate * decay});
  field_.log_depth.clamp_max_(std::log(kMostDepth));
  ++steps_at_level_;
  ++steps_since_change_;
  return priors;
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
  forget_layout();
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

// SPDX-License-Identifier: Apache-2.0
#include "train/grid_learner.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

#include "files/archives.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/image_analysis.h"
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

RowsOfPass rows_of_pass(const TrainingSet& set, const Box& box_m, std::size_t n_wanted) {
  const std::vector<RowReference> all = rows_that_see(set, box_m);
  const std::size_t stride = std::max<std::size_t>(1, all.size() / n_wanted);
  RowsOfPass pass;
  for (std::size_t n = 0; n < all.size(); n += stride) pass.rows.push_back(all[n]);
  if (!all.empty()) pass.share = static_cast<double>(pass.rows.size()) / static_cast<double>(all.size());
  return pass;
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

/// Extinction (1/m) and the isotropic coefficient of brightness 1: [n_voxels × 2].
std::vector<float> grey_values(const GridField& field) {
  constexpr float kOne = 3.5449077f;  // √(4π)
  std::vector<float> values(2 * field.n_voxels(), 0.0f);
  const float* a = field.log_depth.data_ptr<float>();
  const auto density = static_cast<float>(0.5 / field.transform().voxel_size_m);
  for (std::size_t n = 0; n < field.n_active(); ++n) {
    float* const value = &values[2 * std::size_t{field.active_voxels()[n]}];
    value[0] = density * std::exp(a[n]);
    value[1] = kOne;
  }
  return values;
}

}  // namespace

std::vector<std::uint8_t> worth_keeping(const GridField& field, const TrainingSet& set,
                                        const RowsOfPass& pass, const RaySampling& sampling,
                                        const GridOptions& options) {
  const std::span<const RowReference> rows = pass.rows;
  // Derivatives of the sum of all pixels by the isotropic coefficients are what voxels return of their brightness,
  // whatever that is: a field of the same extinction and equally bright everywhere does.
  const FieldChannels grey{false, 0, SourceBasis::harmonics};
  const std::vector<float> values = grey_values(field);
  const BrickView<const float> view{&field.topology(), field.transform(), grey.count(), values};
  RowRenderer renderer(view, grey, field.occupancy(), sampling);
  const auto n_channels = static_cast<std::size_t>(grey.count());
  const auto isotropic = static_cast<std::size_t>(grey.first_source());
  std::vector<float> exposure(field.n_active() * n_channels), pixels, ones;
  std::vector<double> returned(field.n_active(), 0.0);
  constexpr std::size_t kRows = 256;
  for (std::size_t first = 0; first < rows.size(); first += kRows) {
    std::vector<RowRequest> some;
    std::size_t n_pixels = 0;
    for (const RowReference& r : rows.subspan(first, std::min(kRows, rows.size() - first))) {
      some.push_back({set.images[r.view].acquisition, static_cast<int>(r.row)});
      n_pixels += static_cast<std::size_t>(some.back().acquisition.n_range);
    }
    pixels.resize(n_pixels);
    ones.assign(n_pixels, 1.0f);
    renderer.forward(some, pixels);
    renderer.backward(ones, 0.0, field.active_voxels(), exposure);
    for (std::size_t n = 0; n < returned.size(); ++n) returned[n] += double{exposure[n * n_channels + isotropic]};
  }
  const float* a = field.log_depth.data_ptr<float>();
  const auto least = static_cast<float>(std::log(options.prune_depth));
  const double least_returned = options.prune_exposure * pass.share * static_cast<double>(set.images.size());
  std::vector<std::uint8_t> keep(field.n_active());
  for (std::size_t n = 0; n < keep.size(); ++n) keep[n] = a[n] >= least && returned[n] > least_returned ? 1 : 0;
  return keep;
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

constexpr double kLeast = 0.5, kMost = 2.0;

/// Multiples of the ground's brightness between which a pixel's weight rises from 0 to 1.
constexpr float kBrightFrom = 2.0f, kBright = 4.0f;
constexpr double kBlur_pixels = 1.0;

/// Of relative amplitude residuals: their floor over the ground's brightness, their blur, and the bounds beyond which the field
/// has missed a scatterer rather than its brightness.
constexpr double kFloor = 0.2, kResidualBlur_pixels = 0.7;
constexpr float kLeastResidual = -1.0f, kMostResidual = 3.0f;

/// Excess variance from which single glints make up the targets' power. Simulated targets have 0.003 to 0.03, four measured
/// ones 0.16 to 0.27, which one factor for all directions makes 1 dB worse (docs/method/learning.md).
constexpr double kGlints = 0.1;

/// Weights of pixels that are brighter than the ground.
Image<float> bright_target_weight(const Image<float>& power, double ground_power) {
  Image<float> weight = gaussian_blur(power, kBlur_pixels);
  for (float& w : weight.pixels())
    w = std::clamp((w / static_cast<float>(ground_power) - kBrightFrom) / (kBright - kBrightFrom), 0.0f, 1.0f);
  return weight;
}

/// √((I + f) / (μ + f)) − 1, blurred.
Image<float> amplitude_residual(const Image<float>& image, const Image<float>& predicted, float floor) {
  Image<float> residual(image.n_azimuth(), image.n_range());
  for (std::size_t n = 0; n < residual.pixels().size(); ++n) {
    const float ratio = (image.pixels()[n] + floor) / (std::max(predicted.pixels()[n], 0.0f) + floor);
    residual.pixels()[n] = std::clamp(std::sqrt(ratio) - 1.0f, kLeastResidual, kMostResidual);
  }
  return gaussian_blur(residual, kResidualBlur_pixels);
}

/// Weighted sums of residuals.
struct Moments {
  double weight = 0.0, sum = 0.0, squares = 0.0;

  void add(double w, double r) {
    weight += w;
    sum += w * r;
    squares += w * r * r;
  }
  double mean() const { return weight > 0.0 ? sum / weight : 0.0; }
  double variance_about(double centre) const {
    return weight > 0.0 ? (squares - 2.0 * centre * sum) / weight + centre * centre : 0.0;
  }
};

}  // namespace

double returned_share(GridField& field, const TrainingSet& set) {
  if (!set.ground) return 1.0;
  const double ground_power = set.ground->plane->mean_power(), scale = field.source_scale();
  const auto floor = static_cast<float>(kFloor * ground_power);
  double missing = 0.0, returned = 0.0;
  Moments of_targets, of_ground;
  for (const PosedImage& image : set.images) {
    const Image<float> whole = render_view(field, image.acquisition);
    field.set_source_scale(0.0);
    const Image<float> ground = render_view(field, image.acquisition);
    field.set_source_scale(scale);
    const Image<float> weight = bright_target_weight(whole, ground_power);
    const Image<float> residual = amplitude_residual(image.power, whole, floor);
    for (std::size_t n = 0; n < weight.pixels().size(); ++n) {
      const double w = double{weight.pixels()[n]}, predicted = double{whole.pixels()[n]};
      missing += w * (double{image.power.pixels()[n]} - predicted);
      returned += w * (predicted - double{ground.pixels()[n]});
      of_targets.add(w, double{residual.pixels()[n]});
      of_ground.add(1.0 - w, double{residual.pixels()[n]});
    }
  }
  // Under speckle the mean amplitude is below that of steady power: the ground says by how much.
  const double centre = of_ground.mean();
  const double excess_variance = of_targets.variance_about(centre) - of_ground.variance_about(centre);
  if (!(returned > 0.0) || excess_variance >= kGlints) return 1.0;
  return std::clamp(1.0 + missing / returned, kLeast, kMost);
}

namespace {

/// Share of the training after which all halvings are done, the first ones sooner.
constexpr double kRefinedBy = 0.25;

/// Rows that a pass looks at for voxels to give up, or up to twice as many: enough to meet each voxel from many sides.
constexpr std::size_t kRowsOfPass = 1000;

/// How often as many rows must have been learned from before the next pass: it takes half as long as learning from them
/// once, and shows little where little has been learned.
constexpr double kRowsLearned = 3.0;

/// Largest two-way depth of a voxel: more only slows down the way back.
constexpr double kMostDepth = 40.0;

}  // namespace

GridLearner::GridLearner(const TrainingSet& set, const GridOptions& options, int rows_per_step, const Monitor& monitor)
    : options_(options), rows_per_step_(rows_per_step), field_(initial_grid_field(set, options, monitor)),
      source_scale_(field_.source_scale()), adam_(field_) {
}

bool GridLearner::adapt(double progress, const TrainingSet& set, const RaySampling& sampling) {
  progress_ = progress;
  if (steps_at_level_ == 0) level_progress_ = progress;
  const bool refines = refinement_is_due(progress);
  if (refines) refine(progress);
  const bool prunes = pruning_is_due(progress, set);
  if (prunes) {
    n_prunings_ = prunings_by(progress);
    give_up_voxels(set, sampling);
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
  pass_.reset();
}

const RowsOfPass& GridLearner::pass(const TrainingSet& set) {
  if (!pass_) pass_ = rows_of_pass(set, field_.occupied_box_m(), kRowsOfPass);
  return *pass_;
}

int GridLearner::prunings_by(double progress) const {
  return static_cast<int>(progress * (options_.n_prunings + 1));
}

bool GridLearner::pruning_is_due(double progress, const TrainingSet& set) {
  if (progress < options_.prune_from || prunings_by(progress) <= n_prunings_) return false;
  const auto n_learned = static_cast<double>(steps_since_change_) * rows_per_step_;
  return n_learned >= kRowsLearned * static_cast<double>(pass(set).rows.size());
}

void GridLearner::give_up_voxels(const TrainingSet& set, const RaySampling& sampling) {
  steps_since_change_ = 0;
  const torch::Tensor kept = prune(field_, worth_keeping(field_, set, pass(set), sampling, options_));
  adam_.keep(kept);
  forget_layout();
}

double GridLearner::add_smoothness(std::span<const float> shares) {
  if (options_.smooth_density == 0.0 && options_.smooth_source == 0.0 && options_.smooth_angular == 0.0) return 0.0;
  if (!neighbours_) neighbours_.emplace(field_);
  const auto add = [&](torch::Tensor& parameter, std::span<const float> weights) {
    return neighbours_->smoothness(parameter.data_ptr<float>(), weights, shares, parameter.mutable_grad().data_ptr<float>());
  };
  const auto density = static_cast<float>(options_.smooth_density);
  const double of_density = add(field_.log_depth, {&density, 1});
  std::vector<float> source(static_cast<std::size_t>(field_.channels().n_source()),
                            static_cast<float>(options_.smooth_angular));
  source[0] = static_cast<float>(options_.smooth_source);
  return of_density + add(field_.coefficients, source);
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

double GridLearner::minimise(const RenderedRows& rows, const RowGradients& gradients, double rate) {
  field_.set_source_scale(source_scale_);
  for (torch::Tensor& parameter : field_.parameters()) parameter.mutable_grad() = torch::Tensor();
  gradients.carry_back(rows);
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

void GridLearner::finish(const TrainingSet& set) {
  field_.set_source_scale(source_scale_);
  field_.set_source_scale(source_scale_ * returned_share(field_, set));
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

// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/nerf/trainer.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <span>
#include <sstream>
#include <vector>

#include "files/archives.h"
#include "ground/median_ground.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/text.h"
#include "sarnerf/nerf/learned_field.h"
#include "train/field_learner.h"
#include "train/grid_learner.h"
#include "train/response.h"

namespace sarnerf {

/// Azimuth rows of all views in random order: each comes once before any comes again.
class RowQueue {
 public:
  struct Draw {
    RowReference row;
    double along_track_jitter, fan_jitter;  ///< in [0, 1)
  };

  RowQueue() = default;
  /// Empty until keep_rows_that_see().
  explicit RowQueue(std::uint64_t seed) : random_(seed) {}

  /// Begins anew with the rows that see the field's matter.
  void keep_rows_that_see(const TrainingSet& set, const LearnedField& field);

  bool empty() const { return rows_.empty(); }
  Draw next();

  /// Order, place and random state under "rows" and in the text.
  void save(Archive& archive) const;
  void restore(const Archive& archive, const std::string& where);

 private:
  std::mt19937_64 random_;
  std::vector<RowReference> rows_;
  std::size_t next_ = 0;
};

namespace {

/// In [0, 1), the same on every platform.
double unit_random(std::mt19937_64& random) { return static_cast<double>(random() >> 11) * 0x1p-53; }

/// Fisher and Yates; std::shuffle differs from library to library.
void shuffle(std::vector<RowReference>& rows, std::mt19937_64& random) {
  for (std::size_t n = rows.size(); n > 1; --n)
    std::swap(rows[n - 1], rows[static_cast<std::size_t>(unit_random(random) * static_cast<double>(n))]);
}

}  // namespace

void RowQueue::keep_rows_that_see(const TrainingSet& set, const LearnedField& field) {
  rows_ = rows_that_see(set, field.occupied_box_m());
  next_ = rows_.size();
}

RowQueue::Draw RowQueue::next() {
  if (next_ == rows_.size()) {
    shuffle(rows_, random_);
    next_ = 0;
  }
  const RowReference row = rows_[next_++];
  const double along_track = unit_random(random_);
  return {row, along_track, unit_random(random_)};
}

void RowQueue::save(Archive& archive) const {
  torch::Tensor rows = torch::empty({static_cast<std::int64_t>(rows_.size()), 2}, torch::kLong);
  auto* out = rows.data_ptr<std::int64_t>();
  for (const RowReference& row : rows_) {
    *out++ = row.view;
    *out++ = row.row;
  }
  archive.tensors["rows"] = rows;
  std::ostringstream random;
  random << random_;
  add_text(archive, "row_queue", {{"next", next_}, {"random", random.str()}});
}

void RowQueue::restore(const Archive& archive, const std::string& where) {
  const torch::Tensor rows = archive.tensor("rows", torch::kLong, 2, where).contiguous();
  if (rows.size(1) != 2) throw CheckpointError(where + ": the order of the rows is damaged");
  const Json text = text_of(archive, "row_queue", where);
  rows_.clear();
  const auto* in = rows.data_ptr<std::int64_t>();
  for (std::int64_t n = 0; n < rows.size(0); ++n, in += 2)
    rows_.push_back({static_cast<std::uint32_t>(in[0]), static_cast<std::uint32_t>(in[1])});
  next_ = member<std::size_t>(text, "next", where);
  std::istringstream random(member<std::string>(text, "random", where));
  if (!(random >> random_) || next_ > rows_.size())
    throw CheckpointError(where + ": the order of the rows is damaged");
}

std::unique_ptr<FieldLearner> make_learner(const TrainingSet& set, const TrainerOptions& options, const Monitor& monitor) {
  if (options.field == "grid")
    return std::make_unique<GridLearner>(set, options.grid, options.rows_per_step, monitor);
  if (options.field == "mlp") return make_mlp_learner(set, options.mlp, options.seed, monitor);
  throw UsageError("there is no field '" + options.field + "'; there are: grid, mlp");
}

namespace {

/// A loss this much larger than the smallest one says that the field has been lost, if it is also this much larger
/// than that of black images: few rows may by chance show next to nothing, and their loss is no measure then.
constexpr double kDivergence = 1000.0, kWorseThanBlack = 10.0;

/// Rates fall as far as they shall in so many steps or more. Fewer cannot afford to become slow.
constexpr double kStepsToFall = 100.0;

/// Errors e whose squares grow as Huber's loss beyond `most`: as 2 most |e|, but for a constant, in their gradients.
torch::Tensor bounded(const torch::Tensor& errors, double most) {
  return errors * (most / errors.detach().abs().clamp_min(most)).sqrt();
}

/// Mean square of pixels.
double mean_square(std::span<const float> pixels) {
  double sum = 0.0;
  for (const float p : pixels) sum += double{p} * double{p};
  return sum / static_cast<double>(std::max<std::size_t>(1, pixels.size()));
}

}  // namespace

struct Trainer::State {
  TrainingSet set;
  TrainerOptions options;
  std::unique_ptr<FieldLearner> learner;
  RowQueue queue;
  std::int64_t steps = 0;
  double mean_square_of_set = 0.0;
  double clutter_level = 0.0;  ///< mean brightness of the ground
  double least_loss = std::numeric_limits<double>::infinity();

  std::vector<StandingView> standing;  ///< of each view, over a level ground
  std::optional<RowsThroughResponse> through_response;  ///< where images with a response are not sharpened

  /// The queue's rows, or with `resume` only what goes with them, after the field's space has changed.
  void look_at_field(bool resume) {
    if (!resume) queue.keep_rows_that_see(set, learner->field());
    standing.clear();
    if (!set.clutter) return;
    const double height_m = set.clutter->ground->height_m;
    const Box box_m = learner->field().occupied_box_m();
    for (const PosedImage& image : set.images) standing.push_back(standing_view(image.acquisition, box_m, height_m));
  }

  /// Of a training that goes on at the pace so far.
  double share_of_fall(double progress) const {
    const double all_steps = progress > 0.0 ? static_cast<double>(steps) / progress : kStepsToFall;
    return std::min(1.0, all_steps / kStepsToFall);
  }

  RaySampling sampling(double progress) const {
    const LearnedField& field = learner->field();
    double most_m = std::numeric_limits<double>::infinity();
    for (const PosedImage& image : set.images)
      most_m = std::min(most_m, options.most_ray_spacing_bins * image.acquisition.range_spacing_m);
    const double voxel_m = field.voxel_size_m();
    RaySampling s;
    s.ray_spacing_m = std::min(options.ray_spacing * voxel_m, most_m);
    s.longest_m = options.longest_segment * voxel_m;
    s.end_depth = options.end_depth;
    s.distortion = options.distortion * std::pow(options.final_distortion, progress);
    return s;
  }
};

Trainer::Trainer(TrainingSet set, const TrainerOptions& options, const Monitor& monitor) : state_(std::make_unique<State>()) {
  state_->set = std::move(set);
  state_->options = options;
  state_->learner = make_learner(state_->set, options, monitor);
  for (const PosedImage& image : state_->set.appearances())
    state_->mean_square_of_set += mean_square(image.power.pixels()) / static_cast<double>(state_->set.images.size());
  if (state_->set.clutter) state_->clutter_level = state_->set.clutter->ground->mean_power();
  if (state_->set.resolution && state_->set.cleaned.empty())
    state_->through_response.emplace(state_->set, options.speckle_floor * state_->clutter_level, options.speckle_most);
  if (state_->learner->field().occupied_box_m().empty()) {
    const Box& box = state_->set.box_m;
    throw InputError(format("nothing can be learned: no place in the scene's box (%.4g..%.4g, %.4g..%.4g, %.4g..%.4g m about the aim "
                            "point) is shown by the images and not seen to be empty; check 'scene_box_m' and 'aim_m' of the "
                            "dataset, and whether its images are of one scene",
                            box.min.x, box.max.x, box.min.y, box.max.y, box.min.z, box.max.z));
  }
  state_->queue = RowQueue(options.seed);
  state_->look_at_field(false);
}

Trainer::~Trainer() = default;

StepReport Trainer::step(double progress) {
  State& s = *state_;
  if (s.learner->adapt(progress, s.set, s.sampling(0.0)))
    s.look_at_field(false);

  std::vector<RowReference> drawn;
  std::vector<RowRequest> rows;
  std::vector<float> wanted, counts;  // pixels, and 1 where they count
  for (int n = 0; n < s.options.rows_per_step && !s.queue.empty(); ++n) {
    const RowQueue::Draw draw = s.queue.next();
    const PosedImage& image = s.set.appearances()[draw.row.view];
    const auto i = static_cast<int>(draw.row.row);
    RowRequest request{image.acquisition, i, draw.along_track_jitter, draw.fan_jitter};
    StandingView part{request.least_angle_rad, request.most_angle_rad, 0, image.power.n_range()};
    if (s.set.clutter) part = s.standing[draw.row.view];
    request.least_angle_rad = part.least_angle_rad;
    request.most_angle_rad = part.most_angle_rad;
    rows.push_back(request);
    drawn.push_back(draw.row);
    const auto pixels = image.power.row(i);
    for (int j = 0; j < image.power.n_range(); ++j) {
      const bool inside = j >= part.first_bin && j < part.end_bin;
      wanted.push_back(inside ? pixels[static_cast<std::size_t>(j)] : 0.0f);
      counts.push_back(inside ? 1.0f : 0.0f);
    }
  }
  double loss = 0.0;
  if (!rows.empty()) {
    const auto n = static_cast<std::int64_t>(wanted.size());
    const torch::Tensor pixels = s.learner->field().render_rows(rows, s.sampling(progress));
    const torch::Tensor counting = torch::from_blob(counts.data(), {n}, torch::kFloat);
    const torch::Tensor truth = s.through_response ? s.through_response->wanted(drawn, pixels.detach(), counting)
                                                   : torch::from_blob(wanted.data(), {n}, torch::kFloat);
    // Errors have no unit before they are squared: images of any scale fit into float.
    const bool relative = s.options.speckle_floor > 0.0 && s.set.clutter;
    const double unit = relative ? s.options.speckle_floor * s.clutter_level : double{s.set.peak};
    torch::Tensor errors = (pixels - truth) * counting;
    if (relative) {
      errors = errors / (pixels.detach().clamp_min(0.0) + unit);
      if (s.options.speckle_most > 0.0 && !s.through_response) errors = bounded(errors, s.options.speckle_most);
    } else {
      errors = errors / unit;
    }
    const torch::Tensor squares = errors.square().sum();
    loss = squares.item<double>() / std::max(1.0, counting.sum().item<double>());
    // Errors of black images are the images over the unit, whichever loss it is.
    const double black = (mean_square(wanted) + s.mean_square_of_set) / (unit * unit);
    if (!std::isfinite(loss) || (loss > kDivergence * s.least_loss && loss > kWorseThanBlack * black))
      throw NumericsError("training diverges: at step " + std::to_string(s.steps + 1) + " the mean square error is " +
                          std::to_string(loss) + (relative ? " of the prediction's square" : " of the peak's square") +
                          "; use lower learning rates");
    s.least_loss = std::min(s.least_loss, loss);
    s.learner->minimise(squares, std::pow(s.options.final_rate, progress * s.share_of_fall(progress)));
  }
  ++s.steps;
  return {s.steps, loss, s.learner->field().size_text()};
}

void Trainer::finish() { state_->learner->finish(state_->set); }

std::int64_t Trainer::steps_done() const { return state_->steps; }
const LearnedField& Trainer::field() const { return state_->learner->field(); }
const TrainingSet& Trainer::set() const { return state_->set; }
const TrainerOptions& Trainer::options() const { return state_->options; }

Archive Trainer::checkpoint() const {
  Archive archive = state_->learner->state();
  state_->queue.save(archive);
  if (state_->through_response) state_->through_response->save(archive);
  add_trainer_json(archive, {options_json(state_->options), state_->steps, state_->least_loss});
  return archive;
}

void Trainer::restore(const Archive& archive, const std::string& where) {
  const TrainerJson saved = trainer_json(archive, where);
  if (saved.options != options_json(state_->options))
    throw CheckpointError(where + ": was written with other options: " + saved.options + " instead of " +
                          options_json(state_->options));
  state_->learner->restore(archive, where);
  state_->queue.restore(archive, where);
  if (state_->through_response) state_->through_response->restore(archive, where);
  state_->look_at_field(true);
  state_->steps = saved.steps;
  state_->least_loss = saved.least_loss;
}

}  // namespace sarnerf

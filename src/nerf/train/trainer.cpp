// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/nerf/trainer.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <span>
#include <sstream>
#include <utility>
#include <vector>

#include "files/archives.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/text.h"
#include "sarnerf/nerf/learned_field.h"
#include "train/field_learner.h"
#include "train/grid_learner.h"
#include "train/loss.h"
#include "train/registration.h"

namespace sarnerf {

/// Azimuth rows of all views in random order, in blocks of neighbours of one view. Each comes once before any comes again,
/// unless the rows that see the scene change.
class RowQueue {
 public:
  struct Draw {
    RowReference row;
    double along_track_jitter, fan_jitter;  ///< in [0, 1)
  };

  RowQueue() = default;
  /// Empty until keep_rows_that_see(). `block` is the number of rows of a block.
  RowQueue(std::uint64_t seed, std::uint32_t block) : random_(seed), block_(block) {}

  /// Restarts with the rows that see the field's occupied voxels.
  void keep_rows_that_see(const TrainingSet& set, const LearnedField& field);

  bool empty() const { return rows_.empty(); }
  /// Number of steps in which each row comes once.
  std::int64_t epoch_steps(int rows_per_step) const {
    return (static_cast<std::int64_t>(rows_.size()) + rows_per_step - 1) / rows_per_step;
  }
  Draw next();
  /// Another random number of [0, 1).
  double jitter();

  /// Saves the order under "rows", and position and random state in the JSON object.
  void save(Archive& archive) const;
  void restore(const Archive& archive, const TrainingSet& set, const std::string& where);

  std::span<const RowReference> rows() const { return rows_; }

 private:
  std::mt19937_64 random_;
  std::uint32_t block_ = 1;
  std::vector<RowReference> rows_;
  std::size_t next_ = 0;
};

namespace {

/// In [0, 1), the same on every platform.
double unit_random(std::mt19937_64& random) { return static_cast<double>(random() >> 11) * 0x1p-53; }

/// Fisher and Yates; std::shuffle differs from library to library.
template <class T>
void shuffle(std::vector<T>& items, std::mt19937_64& random) {
  for (std::size_t n = items.size(); n > 1; --n)
    std::swap(items[n - 1], items[static_cast<std::size_t>(unit_random(random) * static_cast<double>(n))]);
}

/// Puts blocks of neighbouring rows in random order. Where blocks begin is random, too: no row is at their ends more often
/// than others.
void shuffle_blocks(std::vector<RowReference>& rows, std::uint32_t block, std::mt19937_64& random) {
  if (block == 1) return shuffle(rows, random);
  const auto offset = static_cast<std::uint32_t>(unit_random(random) * block);
  const auto block_of = [&](const RowReference& r) { return (r.row + offset) / block; };
  std::ranges::sort(rows, {}, [](const RowReference& r) { return std::pair(r.view, r.row); });
  std::vector<std::span<const RowReference>> blocks;
  for (std::size_t first = 0, end; first < rows.size(); first = end) {
    const auto in_block = [&](const RowReference& r) { return r.view == rows[first].view && block_of(r) == block_of(rows[first]); };
    for (end = first + 1; end < rows.size() && in_block(rows[end]);) ++end;
    blocks.push_back(std::span(rows).subspan(first, end - first));
  }
  shuffle(blocks, random);
  std::vector<RowReference> shuffled;
  for (const auto& b : blocks) shuffled.insert(shuffled.end(), b.begin(), b.end());
  rows = std::move(shuffled);
}

}  // namespace

void RowQueue::keep_rows_that_see(const TrainingSet& set, const LearnedField& field) {
  rows_ = rows_that_see(set, field.occupied_box_m());
  next_ = rows_.size();
}

RowQueue::Draw RowQueue::next() {
  if (next_ == rows_.size()) {
    shuffle_blocks(rows_, block_, random_);
    next_ = 0;
  }
  const RowReference row = rows_[next_++];
  const double along_track = unit_random(random_);
  return {row, along_track, unit_random(random_)};
}

double RowQueue::jitter() { return unit_random(random_); }

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

void RowQueue::restore(const Archive& archive, const TrainingSet& set, const std::string& where) {
  const torch::Tensor rows = archive.tensor("rows", torch::kLong, 2, where).contiguous();
  if (rows.size(1) != 2) throw CheckpointError(where + ": the order of the rows is damaged");
  const Json text = text_of(archive, "row_queue", where);
  rows_.clear();
  const auto* in = rows.data_ptr<std::int64_t>();
  for (std::int64_t n = 0; n < rows.size(0); ++n, in += 2) {
    const std::int64_t view = in[0], row = in[1];
    if (view < 0 || view >= static_cast<std::int64_t>(set.images.size()) || row < 0 ||
        row >= set.images[static_cast<std::size_t>(view)].power.n_azimuth())
      throw CheckpointError(where + ": the order of the rows is that of other images, or damaged");
    rows_.push_back({static_cast<std::uint32_t>(view), static_cast<std::uint32_t>(row)});
  }
  next_ = member<std::size_t>(text, "next", where);
  std::istringstream random(member<std::string>(text, "random", where));
  if (!(random >> random_) || next_ > rows_.size())
    throw CheckpointError(where + ": the order of the rows is damaged");
}

std::unique_ptr<FieldLearner> make_learner(const TrainingSet& set, const TrainerOptions& options, const Monitor& monitor) {
  if (options.field == "grid")
    return std::make_unique<GridLearner>(set, options.grid, monitor);
  if (is_network(options.field)) return make_mlp_learner(set, options.mlp, options.seed, monitor);
  if (options.field == "surface") return make_surface_learner(set, options.surface, monitor);
  throw UsageError("there is no field '" + options.field + "'; there are: grid, mlp, paper, surface");
}

namespace {

/// Learning rates fall to final_rate only in trainings of at least so many steps. Shorter ones need higher rates.
constexpr double kStepsToFall = 100.0;

}  // namespace

struct Trainer::State {
  TrainingSet set;
  TrainerOptions options;
  std::unique_ptr<FieldLearner> learner;
  DataTerm data_term;
  DivergenceGuard guard;
  RowQueue queue;
  ViewRegistration registration;
  std::int64_t steps = 0;
  std::vector<LayoverShadowWindow> windows;  ///< of each view, over a level ground

  State(TrainingSet images, const TrainerOptions& how, const Monitor& monitor)
      : set(how.field == "paper" ? images_alone(std::move(images)) : std::move(images)), options(how), learner(make_learner(set, options, monitor)),
        data_term(set, pixel_loss(set, options), options.renderings), guard(set),
        queue(options.seed, data_term.rows_of_a_block()),
        registration(options.n_registrations) {}

  /// Updates what depends on the views' shifts and gains.
  void views_have_changed() {
    if (registration.is_complete() && set.ground) {
      if (auto ground = estimate_ground(set.training_images(), set.box_m, set.ground->plane->height_m, set.ground_rule)) {
        set.ground = std::move(ground);
        learner->set_ground(set.ground->plane);
      }
    }
    field_has_changed(true);
  }

  /// Updates the queue (unless `resume`), the windows and the data term after the field's occupied space has changed.
  void field_has_changed(bool resume) {
    if (!resume) queue.keep_rows_that_see(set, learner->field());
    windows.clear();
    if (!set.ground) return;
    const double height_m = set.ground->plane->height_m;
    const Box box_m = learner->field().occupied_box_m();
    for (const PosedImage& image : set.images) windows.push_back(layover_shadow_window(image.acquisition, box_m, height_m));
    data_term.update(set, queue.rows(), windows);
  }

  /// Fraction of the largest learning rates. The total number of steps is extrapolated from the progress so far.
  double rate(double progress) const {
    const double all_steps = progress > 0.0 ? static_cast<double>(steps) / progress : kStepsToFall;
    return std::pow(options.final_rate, progress * std::min(1.0, all_steps / kStepsToFall));
  }

  RaySampling sampling() const {
    const LearnedField& field = learner->field();
    const double most_m = options.most_ray_spacing_bins * set.finest_bin_m();
    const double voxel_m = field.voxel_size_m();
    RaySampling s;
    s.ray_spacing_m = std::min(options.ray_spacing * voxel_m, most_m);
    s.longest_m = options.longest_segment * voxel_m;
    s.end_depth = options.end_depth;
    return s;
  }

  /// The next rows of the queue, limited over a ground to the parts that objects on it can change.
  RowBatch next_batch() {
    RowBatch batch;
    for (int n = 0; n < options.rows_per_step && !queue.empty(); ++n) {
      const RowQueue::Draw draw = queue.next();
      const PosedImage& image = set.training_images()[draw.row.view];
      const auto i = static_cast<int>(draw.row.row);
      RowRequest request{image.acquisition, i, draw.along_track_jitter, draw.fan_jitter};
      LayoverShadowWindow window{request.least_angle_rad, request.most_angle_rad, 0, image.power.n_range()};
      if (set.ground) window = windows[draw.row.view];
      request.least_angle_rad = window.least_angle_rad;
      request.most_angle_rad = window.most_angle_rad;
      batch.rows.push_back(draw.row);
      batch.requests.push_back(request);
      const auto pixels = image.power.row(i);
      batch.image.insert(batch.image.end(), pixels.begin(), pixels.end());
      for (int j = 0; j < image.power.n_range(); ++j) batch.counts.push_back(j >= window.first_bin && j < window.end_bin);
    }
    for (std::size_t n = 0; options.renderings == 2 && n < batch.rows.size(); ++n) {
      RowRequest& other = batch.requests.emplace_back(batch.requests[n]);
      other.along_track_jitter = queue.jitter();
      other.fan_jitter = queue.jitter();
    }
    return batch;
  }
};

Trainer::Trainer(TrainingSet set, const TrainerOptions& options, const Monitor& monitor)
    : state_(std::make_unique<State>(std::move(set), options, monitor)) {
  if (state_->learner->field().occupied_box_m().empty()) {
    const Box& box = state_->set.box_m;
    throw InputError(format("nothing can be learned: every point of the scene's box (%.4g..%.4g, %.4g..%.4g, %.4g..%.4g m about the "
                            "aim point) lies outside all images or is shown to be empty; check 'scene_box_m' and 'aim_m' of the "
                            "dataset, and whether its images are of one scene",
                            box.min.x, box.max.x, box.min.y, box.max.y, box.min.z, box.max.z));
  }
  state_->field_has_changed(false);
}

Trainer::~Trainer() = default;

StepReport Trainer::step(double progress) {
  State& s = *state_;
  if (s.learner->adapt(progress, s.queue.epoch_steps(s.options.rows_per_step))) s.field_has_changed(false);
  if (s.registration.is_due(progress)) {
    s.registration.pass(s.set, s.learner->field(), s.data_term.pixel());
    s.views_have_changed();
  }
  StepReport report{s.steps + 1, 0.0, s.learner->field().size_text()};
  if (const RowBatch batch = s.next_batch(); !batch.rows.empty()) {
    const torch::Tensor pixels = s.learner->field().render_rows(batch.requests, s.sampling());
    const DataLoss data = s.data_term.of(batch, pixels);
    s.guard.check(data, report.step);
    s.learner->minimise(pixels, data.gradient, s.rate(progress));
    report.loss = data.per_pixel(data.value);
  }
  ++s.steps;
  return report;
}

std::int64_t Trainer::steps_done() const { return state_->steps; }
const LearnedField& Trainer::field() const { return state_->learner->field(); }
const TrainingSet& Trainer::set() const { return state_->set; }
const TrainerOptions& Trainer::options() const { return state_->options; }

Archive Trainer::checkpoint() const {
  Archive archive = state_->learner->state();
  state_->queue.save(archive);
  state_->data_term.save(archive);
  state_->registration.save(archive, state_->set);
  add_trainer_json(archive, {options_json(state_->options), state_->steps, state_->guard.least()});
  return archive;
}

void Trainer::restore(const Archive& archive, const std::string& where) {
  const TrainerJson saved = trainer_json(archive, where);
  if (saved.options != options_json(state_->options))
    throw CheckpointError(where + ": was written with other options: " + saved.options + " instead of " +
                          options_json(state_->options));
  state_->learner->restore(archive, where);
  state_->queue.restore(archive, state_->set, where);
  state_->registration.restore(archive, state_->set, where);
  state_->views_have_changed();
  state_->data_term.restore(archive, where);
  state_->steps = saved.steps;
  state_->guard.set_least(saved.least_error);
}

}  // namespace sarnerf

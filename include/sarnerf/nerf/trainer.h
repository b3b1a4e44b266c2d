// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "sarnerf/nerf/grid_field.h"
#include "sarnerf/nerf/learned_field.h"
#include "sarnerf/nerf/mlp_field.h"
#include "sarnerf/nerf/training_set.h"

namespace sarnerf {

/// How a field is learned. Lengths along and between rays are in voxels of the field.
struct TrainerOptions {
  std::string field = "grid";  ///< or "mlp"
  GridOptions grid;            ///< of the field `grid`
  MlpOptions mlp;              ///< of the field `mlp`
  int rows_per_step = 140;     ///< azimuth rows, drawn from all views without repetition until all have had their turn
  double ray_spacing = 1.4;    ///< wider than a voxel: where rays lie changes from step to step
  double most_ray_spacing_bins = 1.3;  ///< limit of the same, in range bins
  double longest_segment = 1.0;
  double end_depth = 6.0;      ///< two-way optical depth at which a ray ends: 0.25 % of its power lies behind
  double final_rate = 0.02;    ///< learning rates fall exponentially to this share, less far in under 100 steps
  double distortion = 1e-3;    ///< weight of ray_distortion.h, relative to squares of the peak; falls by the next
  double final_distortion = 0.1;  ///< its share at the end
  /// Above 0, errors count in proportion to what is predicted, as the likelihood of speckle has it, and of this multiple of
  /// the ground's brightness beside it, which is what the field may miss: gradients (μ − I) / (μ + floor)². 0: squares of power.
  double speckle_floor = 0.0;
  /// Above 0, such an error beyond so many times the prediction counts by its size, not its square (Huber): what glints in
  /// one view says little of the next. Of the clutter's own speckle of one look 2 % lie beyond 3.
  double speckle_most = 0.0;
  std::uint64_t seed = 1;
};

/// What the share of the training that is done is counted in.
enum class Schedule { steps, clock };

/// The options that suit a set of images: with few views, priors count more. `surfaces`: whether the field `grid` is to
/// become opaque where there is matter, so that surfaces can be taken from it; unless told otherwise, where enough images
/// of different incidences without a background tell them.
TrainerOptions default_options(const TrainingSet& set, const std::string& field, Schedule schedule = Schedule::steps,
                               std::optional<bool> surfaces = std::nullopt);

/// Steps after which more of them bring little: 1000, and 600 where images show a ground, which take longer each.
std::int64_t default_steps(const TrainingSet& set);

/// One JSON object with the options that concern the field in use, and its inverse. Throws UsageError for unknown keys
/// or impossible values.
std::string options_json(const TrainerOptions& options);
TrainerOptions options_from_json(const std::string& json);

struct StepReport {
  std::int64_t step = 0;    ///< steps done, this one included
  double loss = 0.0;        ///< mean square over the batch's pixels, relative to the peak's square
  std::string field_size;   ///< LearnedField::size_text()
};

/// Learns a field from images, step by step: mean square error over azimuth rows of many views (printed eq. 31), Adam,
/// derivatives by the native adjoints. The same seed and number of threads give the same bits; so does going on from
/// a checkpoint.
class Trainer {
 public:
  /// Carves and initialises the field. Throws UsageError for impossible options, and InputError where nothing of the
  /// scene's box can hold matter. `set` is kept.
  Trainer(TrainingSet set, const TrainerOptions& options);
  ~Trainer();

  /// One step. `progress` in [0, 1) is the share of the training that is done: rates, resolution and regularisation
  /// follow it, and it must not fall. Throws NumericsError when the loss is not finite or has become a thousand
  /// times its smallest value; the field is then no longer usable.
  StepReport step(double progress);

  /// Ends the training: over a level ground, scales the brightness of the field `grid` by returned_share(). Another
  /// step() takes the scale away again.
  void finish();

  std::int64_t steps_done() const;
  const LearnedField& field() const;
  const TrainingSet& set() const;
  const TrainerOptions& options() const;

  /// Everything that the next step depends on, but the images.
  Archive checkpoint() const;

  /// Goes on from there, bit by bit with the same images, options and number of threads. Throws CheckpointError
  /// where the archive is of another set of options or damaged; `where` names it.
  void restore(const Archive& archive, const std::string& where);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace sarnerf

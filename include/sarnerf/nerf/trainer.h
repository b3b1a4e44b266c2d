// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "sarnerf/core/parallel.h"
#include "sarnerf/nerf/grid_field.h"
#include "sarnerf/nerf/learned_field.h"
#include "sarnerf/nerf/mlp_field.h"
#include "sarnerf/nerf/surface_field.h"
#include "sarnerf/nerf/training_set.h"

namespace sarnerf {

/// How a field is learned. Lengths along and between rays are in voxels of the field.
struct TrainerOptions {
  std::string field = "grid";  ///< or "mlp", "paper", "surface"
  GridOptions grid;            ///< of the field `grid`
  MlpOptions mlp;              ///< of the field `mlp`
  SurfaceOptions surface;      ///< of the field `surface`
  int rows_per_step = 140;     ///< azimuth rows, drawn from all views without repetition until all have had their turn or the occupied box changes
  int renderings = 1;          ///< of each row in a step, from rays of its own; 2: the loss is free of their variance (E8)
  double ray_spacing = 1.4;    ///< wider than a voxel: where rays lie changes from step to step
  double most_ray_spacing_bins = 1.3;  ///< limit of the same, in range bins
  double longest_segment = 1.0;
  double end_depth = 6.0;      ///< two-way optical depth at which a ray ends: 0.25 % of its power lies behind
  double final_rate = 0.02;    ///< learning rates fall exponentially to this share, less far in under 100 steps
  /// Over a level ground, clean or speckled: what part of a pixel's power, and of the ground's mean, the field is expected to
  /// miss (standard deviation). Speckle comes on top (E8). 0: squares of power, as without a ground.
  double misfit = 0.1;
  /// Over a level ground: standard deviations beyond which an error counts linearly (Huber 1964); 0: none.
  double error_bound = 0.0;
  /// How often views' shifts and gains are learned, in the first three fifths of the training; 0 where poses are exact.
  int n_registrations = 0;
  std::uint64_t seed = 1;
};

/// Whether the progress of the training is measured in steps or in seconds.
enum class Schedule { steps, clock };

/// The options that suit a set of images: voxels of two thirds of a range bin; harmonics of degree 2 where many directions
/// are seen (36 or more images without a background whose incidences differ by more than 5°), else 1.
TrainerOptions default_options(const TrainingSet& set, const std::string& field, Schedule schedule = Schedule::steps);

/// Steps after which more of them bring little: 1000, and 600 over a ground, where a step takes longer; for the field `surface` 1000,
/// and 1250 with 100 images or more.
std::int64_t default_steps(const TrainingSet& set, const std::string& field);

/// One JSON object with the options that concern the field in use, and its inverse. Throws UsageError for unknown keys
/// or impossible values.
std::string options_json(const TrainerOptions& options);
TrainerOptions options_from_json(const std::string& json);

/// Throws UsageError for an option of older versions, naming what replaces it.
void refuse_replaced_option(const std::string& name);

/// The loss that these images and options have, in words.
std::string loss_text(const TrainingSet& set, const TrainerOptions& options);

struct StepReport {
  std::int64_t step = 0;    ///< steps done, this one included
  double loss = 0.0;        ///< data term: mean of e² over the batch's pixels (docs/method/equations.md, E8)
  std::string field_size;   ///< LearnedField::size_text()
};

/// Learns a field from images, step by step, by Adam and the native adjoints. The loss (docs/method/equations.md, E8) is a
/// sum over the pixels of azimuth rows of many views: of squares of errors of power where images show no ground (printed eq.
/// 31), and of errors in units of their standard deviation over a level ground, through the impulse response where that is
/// part of speckled views. The same seed and number of threads give the same bits; so does going on from a checkpoint.
class Trainer {
 public:
  /// Carves and initialises the field. Throws UsageError for impossible options, and InputError where nothing of the
  /// scene's box can hold matter. `set` is kept. The monitor watches the carving, and may interrupt it.
  Trainer(TrainingSet set, const TrainerOptions& options, const Monitor& monitor = {});
  ~Trainer();

  /// One step. `progress` in [0, 1) is the share of the training that is done: rates, resolution and regularisation
  /// follow it, and it must not fall. Throws NumericsError when the loss is not finite or the mean square error has become a
  /// thousand times its smallest value and ten times that of black images; the field is then no longer usable.
  StepReport step(double progress);

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

/// Rule of choose_field().
struct TrialRule {
  std::vector<std::string> fields{"surface", "grid"};  ///< the first one is chosen where there are too few views
  std::size_t n_held_out = 3;     ///< views that trials predict, spread over the set
  std::size_t least_views = 6;    ///< with fewer, too few would be left to learn from
  std::int64_t n_steps = 400;     ///< of each trial, with the whole schedule. Chosen: 200 mislead on one scene of twelve, 400 on none
  double most_seconds = std::numeric_limits<double>::infinity();  ///< for the steps of one trial, which then has fewer of them
};

/// What a short training of one kind of field reached.
struct FieldTrial {
  std::string field;
  double psnr_power_db = 0.0;  ///< mean over the held-out views, 100 dB at most
  double seconds = 0.0;
  std::int64_t n_steps = 0;
  std::string failure;         ///< why it reached nothing; else empty
};

/// The kind of field that suits a training set, and why.
struct FieldChoice {
  std::string field;
  std::vector<FieldTrial> trials;      ///< empty: there were too few views
  std::vector<std::size_t> held_out;   ///< indices of the set's images that trials predicted
};

/// Chooses between an opaque surface and translucent voxels by a trial: each field is learned for a few steps from all views but
/// three, with its default options, and the one whose predictions of these three have the higher PSNR of power is chosen. Two
/// fields cannot be compared by their losses on training views: fog explains more images than a surface, wrong ones included.
///
/// A field whose trial diverges, or learns nothing, is not chosen unless all do. Deterministic for a seed and number of
/// threads, unless seconds are limited. Throws Interrupted. Cost: two short trainings and six views: some 5 to 10 s.
FieldChoice choose_field(const TrainingSet& set, std::uint64_t seed = 1, const Monitor& monitor = {}, const TrialRule& rule = {});

/// One line for the user: "surface: 41.20 dB on 3 views held out from a trial of 200 steps (grid: 38.95 dB)".
std::string choice_text(const FieldChoice& choice, const TrialRule& rule = {});

}  // namespace sarnerf

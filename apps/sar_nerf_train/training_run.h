// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "console.h"
#include "options.h"
#include "sarnerf/dataset/posed_image.h"
#include "sarnerf/nerf/learned_field.h"
#include "sarnerf/nerf/trainer.h"

namespace sarnerf::app {

/// Keeps the field that is best on the held-out views so far, and determines whether to wait for a better one
/// (--patience). Fields are evaluated at fixed fractions of the schedule, not by the clock, so that a run continues
/// from a checkpoint as if it had never stopped.
class BestModel {
 public:
  /// `patience`: the fraction of the schedule within which a better field must appear; 0: nothing is kept.
  explicit BestModel(double patience) : patience_(patience) {}

  bool due(double progress) const;
  void judge(const LearnedField& field, double psnr_db, double progress, std::int64_t step);
  bool patience_exceeded(double progress) const;

  /// The best field, restored; null if none was evaluated.
  std::unique_ptr<LearnedField> field() const;
  std::int64_t step() const { return step_; }
  double psnr_db() const { return psnr_db_; }

  /// Store the best field in a checkpoint and restore it. Throws CheckpointError for damaged contents; `where` names the file.
  void add_to(Archive& archive) const;
  void restore(const Archive& archive, const std::string& where);

 private:
  double patience_;
  int n_judged_ = 0;
  double psnr_db_ = 0.0, progress_ = 0.0;  ///< of the best one
  std::int64_t step_ = 0;
  std::optional<Archive> field_;
};

/// State of the run in a checkpoint, beside the trainer's state.
struct RunState {
  std::string dataset_sha256;
  double progress = 0.0;  ///< greatest progress of a step
  double seconds = 0.0;   ///< of all programs that worked on the run, start-up included
  double trained_s = 0.0;  ///< the same without their start-ups
  bool finished = false;
  double time_s = 0.0;  ///< value of --time; 0: none
  std::int64_t steps = 0;
};

/// A checkpoint in memory; later steps do not change it.
Archive checkpoint_of(const Trainer& trainer, const RunState& state);

/// The run's state in a checkpoint. Throws CheckpointError for another kind of file, another version and damaged contents.
RunState run_state(const Archive& archive, const std::string& where);

/// Whether every number of an archive is finite.
bool all_finite(const Archive& archive);

/// PSNR of a few held-out views during training. measure_if_due() spaces its measurements so that they cost at most a
/// tenth of the time.
class Curve {
 public:
  /// Uses up to eight of the views, evenly spread. `validation` must outlive the curve.
  Curve(std::span<const PosedImage> validation, double peak_power);

  /// Mean PSNR of power over the curve's views (dB), if a measurement is due at `now_s`.
  std::optional<double> measure_if_due(const LearnedField& field, double now_s);

  /// The same, whether it is due or not.
  double measure(const LearnedField& field);

  /// The last mean PSNR; empty before the first.
  std::optional<double> last_db() const { return last_db_; }
  std::span<const std::size_t> views() const { return views_; }
  double spent_s() const { return spent_s_; }

 private:
  std::span<const PosedImage> validation_;
  std::vector<std::size_t> views_;
  double peak_power_;
  std::optional<double> first_s_, last_db_;
  double next_s_ = 0.0, spent_s_ = 0.0;
};

/// One line of metrics.jsonl.
struct MetricsLine {
  std::int64_t step = 0;
  double seconds = 0.0;           ///< of all programs that worked on the run, start-up included
  std::optional<double> loss;     ///< data term, mean since the line before
  std::optional<double> psnr_db;  ///< power, mean over the curve's views
};

/// Log of the training, line by line: {"step":10,"seconds":0.81,"loss":0.0012,"psnr_power_db":31.2}.
class MetricsLog {
 public:
  /// Keeps the existing lines up to `last_step`: later ones belong to steps that will be repeated.
  MetricsLog(std::filesystem::path path, std::int64_t last_step);

  /// Throws Error when the disk is full.
  void add(const MetricsLine& line);

  /// The lines that were kept and those that were added.
  const std::vector<MetricsLine>& lines() const { return lines_; }

 private:
  struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  std::filesystem::path path_;
  std::vector<MetricsLine> lines_;
  std::unique_ptr<std::FILE, Close> file_;
};

/// Check before anything is read. Throws UsageError if the path is a file or other files are in the way, Error if no
/// run can be written.
void check_place(const Options& options, const RunFolder& folder);

/// What exists of a run.
struct Start {
  std::optional<Archive> checkpoint;  ///< to continue from
  bool done = false;                  ///< the run is complete: nothing to do
};

/// Compares an existing run with the wanted configuration, clears what --overwrite replaces, and writes config.toml.
/// Call it with the folder locked. Throws UsageError for a run of other options or data, InputError and
/// CheckpointError for damaged files of a run.
Start start_run(const Options& options, const RunFolder& folder, const std::string& config,
                const std::string& fingerprint, Console& console);

/// Trains to the end of the schedule and keeps checkpoints on the way.
class TrainingRun {
 public:
  /// `found`: the checkpoint to continue from, or null. All references must outlive the run.
  TrainingRun(const Options& options, const Data& data, Trainer& trainer, const RunFolder& folder,
              const ModelInfo& info, const Archive* found);

  /// Ends with the last checkpoint and model.pt in place. Throws Interrupted, with a checkpoint saved, if `monitor`
  /// requests it; NumericsError if training diverges, with model.pt from the last good checkpoint; Error if no
  /// occupied voxel is left.
  void train(Console& console, const Monitor& monitor);

  const MetricsLog& metrics() const { return metrics_; }
  const Curve& curve() const { return curve_; }
  double training_s() const {
    return training_s_;
  }  ///< of this program, curve and checkpoints included
  double checkpoints_s() const { return checkpoints_s_; }
  std::int64_t steps_here() const { return trainer_.steps_done() - first_step_; }
  const std::string& field_size() const { return field_size_; }
  const LearnedField& field() const;  ///< the learned field: that of the last step, or the best one
  std::int64_t field_steps() const;   ///< step of field()
  double seconds() const;  ///< of all programs that worked on the run
  double trained_until_s() const { return trained_until_s_; }  ///< seconds() when training ended

 private:
  bool ended() const;
  double next_progress() const;
  double trained_s() const;  ///< of all programs that worked on the run, their start-ups left out
  std::optional<double> held_out_psnr_db();
  void log(const StepReport& report, bool last);
  void tell(Console& console) const;
  RunState state(bool finished) const;
  void save_model() const;
  Archive checkpoint(bool finished) const;
  void write(const Archive& archive);
  void keep_last_good() const;

  const Options& options_;
  Trainer& trainer_;
  const RunFolder& folder_;
  ModelInfo info_;
  Curve curve_;
  BestModel best_;
  std::unique_ptr<LearnedField> best_field_;  ///< set when training has ended, if the last field is not the best
  MetricsLog metrics_;
  RunState before_;
  std::int64_t first_step_;
  double progress_ = 0.0;
  double trained_until_s_ = 0.0, begin_s_ = 0.0, training_s_ = 0.0, checkpoints_s_ = 0.0,
         last_write_s_ = 0.0, next_checkpoint_s_ = 0.0;
  double loss_sum_ = 0.0;
  int n_losses_ = 0;
  std::optional<Archive> pending_;  ///< written once the next step has succeeded
  std::string field_size_;
};

}  // namespace sarnerf::app

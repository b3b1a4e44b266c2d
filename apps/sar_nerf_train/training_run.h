// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "best_model.h"
#include "checkpoint.h"
#include "console.h"
#include "curve.h"
#include "data.h"
#include "metrics_log.h"
#include "options.h"
#include "run_folder.h"

namespace sarnerf::app {

/// Trains to the end of the schedule and keeps checkpoints on the way.
class TrainingRun {
 public:
  /// `found`: the checkpoint to go on from. All references must outlive the run.
  TrainingRun(const Options& options, const Data& data, Trainer& trainer, const RunFolder& folder,
              const ModelInfo& info, const Archive* found);

  /// Ends with the last checkpoint and model.pt in place. Throws Interrupted, with a checkpoint saved, when `monitor` asks
  /// for it; NumericsError when training diverges, model.pt then being that of the last good checkpoint.
  void train(Console& console, const Monitor& monitor);

  const MetricsLog& metrics() const { return metrics_; }
  const Curve& curve() const { return curve_; }
  double training_s() const {
    return training_s_;
  }  ///< of this program, curve and checkpoints included
  double checkpoints_s() const { return checkpoints_s_; }
  std::int64_t steps_here() const { return trainer_.steps_done() - first_step_; }
  const std::string& field_size() const { return field_size_; }
  const LearnedField& field() const;  ///< what was learned: that of the last step, or the best one
  std::int64_t field_steps() const;   ///< after which it was so
  double seconds() const;  ///< of all programs that worked on the run
  double trained_until_s() const { return trained_until_s_; }  ///< the same when training ended

 private:
  bool ended() const;
  double next_progress() const;
  double trained_s() const;  ///< of all programs that worked on the run, their start-ups left out
  std::optional<double> held_out_psnr_db();
  void log(double loss, bool last);
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
  std::unique_ptr<LearnedField> best_field_;  ///< once training has ended, where the last is not the best
  MetricsLog metrics_;
  RunState before_;
  std::int64_t first_step_;
  double progress_ = 0.0;
  double trained_until_s_ = 0.0, begin_s_ = 0.0, training_s_ = 0.0, checkpoints_s_ = 0.0,
         last_write_s_ = 0.0, next_checkpoint_s_ = 0.0;
  double loss_sum_ = 0.0;
  int n_losses_ = 0;
  std::optional<Archive> pending_;  ///< written once the step after it has gone well
  std::string field_size_;
};

}  // namespace sarnerf::app

// SPDX-License-Identifier: Apache-2.0
#include "training_run.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "process.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/format.h"
#include "sarnerf/core/stopwatch.h"
#include "version.h"

namespace sarnerf::app {
namespace {

constexpr int kStepsPerLine = 10;
constexpr double kCheckpointInterval_s = 10.0, kFirstInterval_s = 1.0;
constexpr double kCheckpointShare = 0.02;  ///< of the time, at most

/// What is left to do when training ends in time: two files and their names on the disk, with a margin.
constexpr double kEndMargin_s = 0.05;

std::string shown(double value, const char* format) {
  char text[60];
  std::snprintf(text, sizeof text, format, value);
  return text;
}

}  // namespace

TrainingRun::TrainingRun(const Options& options, const Data& data, Trainer& trainer,
                         const RunFolder& folder, const ModelInfo& info, const Archive* found)
    : options_(options),
      trainer_(trainer),
      folder_(folder),
      info_(info),
      curve_(data.validation, info.peak_power),
      best_(data.validation.empty() ? 0.0 : options.patience),
      metrics_(folder.metrics(), trainer.steps_done()),
      first_step_(trainer.steps_done()),
      begin_s_(seconds_since_start()),
      field_size_(trainer.field().size_text()) {
  if (found != nullptr) {
    before_ = run_state(*found, folder.checkpoint().string());
    best_.restore(*found, folder.checkpoint().string());
  }
  before_.dataset_sha256 = data.fingerprint;
  progress_ = before_.progress;
}

double TrainingRun::seconds() const { return before_.seconds + seconds_since_start(); }

const LearnedField& TrainingRun::field() const {
  return best_field_ ? *best_field_ : trainer_.field();
}

std::int64_t TrainingRun::field_steps() const {
  return best_field_ ? best_.step() : trainer_.steps_done();
}

bool TrainingRun::ended() const {
  if (best_.worn_out(progress_)) return true;
  if (!options_.time_s) return trainer_.steps_done() >= options_.steps;
  // One step at least: a model that has learned nothing is of no use.
  const std::int64_t n = steps_here();
  if (n == 0) return before_.finished && before_.time_s == *options_.time_s;
  const double step_s = (seconds_since_start() - begin_s_) / static_cast<double>(n);
  return seconds() + step_s + 2.0 * last_write_s_ + kEndMargin_s >= *options_.time_s;
}

double TrainingRun::trained_s() const {
  return before_.trained_s + seconds_since_start() - begin_s_;
}

double TrainingRun::next_progress() const {
  double share = static_cast<double>(trainer_.steps_done()) / static_cast<double>(options_.steps);
  if (options_.time_s) {
    // Start-up has its part of --time, but nothing was learned in it.
    const double left_s = *options_.time_s - seconds() - 2.0 * last_write_s_ - kEndMargin_s;
    share = trained_s() / (trained_s() + std::max(left_s, 1e-3));
  }
  // Where a run goes on with a longer schedule, the trainer must not be sent back.
  return std::clamp(share, progress_, std::max(progress_, std::nextafter(1.0, 0.0)));
}

RunState TrainingRun::state(bool finished) const {
  return {before_.dataset_sha256, progress_, seconds(), trained_s(), finished,
          options_.time_s.value_or(0.0), trainer_.steps_done()};
}

void TrainingRun::save_model() const {
  ModelInfo info = info_;
  info.program = "sar_nerf_train " + std::string(kVersion);
  info.steps = field_steps();
  write_model(folder_.model(), field(), info);
}

Archive TrainingRun::checkpoint(bool finished) const {
  Archive archive = checkpoint_of(trainer_, state(finished));
  best_.add_to(archive);
  return archive;
}

void TrainingRun::write(const Archive& archive) {
  const Stopwatch watch;
  // What is not finite must not replace what is: the loss may not have told yet.
  if (!all_finite(archive))
    throw NumericsError("training diverges: parameters are not finite after step " +
                        std::to_string(trainer_.steps_done()) + "; use lower learning rates");
  write_archive(folder_.checkpoint(), archive);
  last_write_s_ = watch.seconds();
  checkpoints_s_ += last_write_s_;
  const double trained_s = seconds_since_start() - begin_s_;
  next_checkpoint_s_ = seconds_since_start() +
                       std::max(std::clamp(trained_s, kFirstInterval_s, kCheckpointInterval_s),
                                last_write_s_ / kCheckpointShare);
}

void TrainingRun::keep_last_good() const {
  const Archive archive = read_archive(folder_.checkpoint());
  const auto field = restore_field(archive, folder_.checkpoint().string());
  ModelInfo info = info_;
  info.program = "sar_nerf_train " + std::string(kVersion);
  info.steps = run_state(archive, folder_.checkpoint().string()).steps;
  write_model(folder_.model(), *field, info);
}

std::optional<double> TrainingRun::held_out_psnr_db() {
  if (options_.patience == 0.0 || curve_.views().empty())
    return curve_.measure_if_due(trainer_.field(), seconds_since_start());
  // By the clock there is no time left at the end.
  const bool last = !options_.time_s && ended();
  if (!best_.due(progress_) && !last) return std::nullopt;
  const double psnr_db = curve_.measure(trainer_.field());
  best_.judge(trainer_.field(), psnr_db, progress_, trainer_.steps_done());
  return psnr_db;
}

void TrainingRun::log(double loss, bool last) {
  loss_sum_ += loss;
  ++n_losses_;
  const auto psnr_db = held_out_psnr_db();
  const std::int64_t step = trainer_.steps_done();
  if (!psnr_db && !last && step % kStepsPerLine != 0) return;
  metrics_.add({step, seconds(), loss_sum_ / n_losses_, psnr_db});
  loss_sum_ = 0.0;
  n_losses_ = 0;
}

void TrainingRun::tell(Console& console) const {
  const auto n = static_cast<double>(steps_here());
  std::string detail = curve_.last_db() ? "held out " + shown(*curve_.last_db(), "%.2f dB") : "";
  if (!options_.time_s) {
    console.progress("steps", static_cast<std::uint64_t>(trainer_.steps_done()),
                     static_cast<std::uint64_t>(options_.steps), detail);
    return;
  }
  const double here_s = std::max(1e-3, seconds_since_start() - begin_s_);
  detail = std::to_string(trainer_.steps_done()) + " steps, " + shown(n / here_s, "%.3g/s") +
           (detail.empty() ? "" : "  ") + detail;
  console.progress("seconds", static_cast<std::uint64_t>(seconds()),
                   static_cast<std::uint64_t>(std::max(1.0, std::ceil(*options_.time_s))), detail);
}

void TrainingRun::train(Console& console, const Monitor& monitor) {
  // From now on there is something to go on from, whatever happens.
  if (first_step_ == 0) {
    write(checkpoint(false));
  } else {
    next_checkpoint_s_ = seconds_since_start() + kFirstInterval_s;
  }
  try {
    while (!ended()) {
      progress_ = next_progress();
      const StepReport report = trainer_.step(progress_);
      field_size_ = report.field_size;
      if (pending_) {
        write(*pending_);
        pending_.reset();
      }
      log(report.loss, ended());
      tell(console);
      if (monitor.stop_requested()) {
        write(checkpoint(false));
        save_model();
        throw Interrupted("interrupted after " + counted(static_cast<std::uint64_t>(trainer_.steps_done()), "step") +
                          "; they are saved; " + "sar_nerf_train --resume " +
                          folder_.path().string() + " continues");
      }
      if (seconds_since_start() >= next_checkpoint_s_)
        pending_ = checkpoint(false);
    }
    write(checkpoint(true));
    if (trainer_.field().occupied_box_m().empty())
      throw Error("nothing was learned: after " + counted(static_cast<std::uint64_t>(trainer_.steps_done()), "step") +
                  " no voxel holds matter, and an empty field is neither saved nor scored; do the images show anything "
                  "but ground, and of one scene?");
    trainer_.finish();
    field_size_ = trainer_.field().size_text();
    if (best_.step() != trainer_.steps_done()) best_field_ = best_.field();
    if (best_field_) field_size_ = best_field_->size_text();
    save_model();
  } catch (const NumericsError& e) {
    keep_last_good();
    throw NumericsError(std::string(e.what()) + "; the last good state is kept in " +
                        folder_.model().string() + " and " + folder_.checkpoint().string());
  }
  console.progress(options_.time_s ? "seconds" : "steps", 1, 1);
  trained_until_s_ = seconds();
  training_s_ = seconds_since_start() - begin_s_;
}

}  // namespace sarnerf::app

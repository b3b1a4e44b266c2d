// SPDX-License-Identifier: Apache-2.0
#include "training_run.h"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <fstream>

#include "version.h"
#include <nlohmann/json.hpp>

#include "nerf_common.h"
#include "process.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/files.h"
#include "sarnerf/core/metrics.h"
#include "sarnerf/core/numbers.h"
#include "sarnerf/core/parallel.h"
#include "sarnerf/core/text.h"
#include "sarnerf/evaluation/evaluation.h"

namespace sarnerf::app {

namespace {

using Json = nlohmann::ordered_json;

// Format of a checkpoint.
constexpr const char* kFormat = "sarnerf-checkpoint";
constexpr int kCheckpointVersion = 2;

// Settings of the best model.
constexpr double kPerSchedule = 10.0;  ///< evaluations of the field; each costs as much as many steps
constexpr double kLeastGain_db = 0.02;  ///< a smaller gain is no improvement
constexpr const char* kPrefix = "best.";

// Settings of the curve.
constexpr std::size_t kMostViews = 8;
constexpr double kShare = 0.1;         ///< greatest fraction of the time
constexpr double kPointsPerSpan = 30;  ///< more are not visible in a diagram

int place(double progress) { return static_cast<int>(progress * kPerSchedule); }

}  // namespace

Archive checkpoint_of(const Trainer& trainer, const RunState& state) {
  Archive archive = trainer.checkpoint();
  // The archive refers to the optimiser's moments, which the next step changes in place.
  for (auto& [name, tensor] : archive.tensors) tensor = tensor.detach().clone();
  Json json = Json::parse(archive.json);
  json["run"] = {{"format", kFormat},
                 {"version", kCheckpointVersion},
                 {"dataset_sha256", state.dataset_sha256},
                 {"progress", state.progress},
                 {"seconds", state.seconds},
                 {"trained_s", state.trained_s},
                 {"finished", state.finished},
                 {"time_s", state.time_s},
                 {"steps", state.steps}};
  archive.json = json.dump();
  return archive;
}

RunState run_state(const Archive& archive, const std::string& where) {
  const Json json = Json::parse(archive.json, nullptr, false);
  if (!json.is_object() || !json.contains("run") || !json["run"].is_object())
    throw CheckpointError(where + ": is not a checkpoint of a training run");
  const Json& run = json["run"];
  try {
    if (run.at("format").get<std::string>() != kFormat)
      throw CheckpointError(where + ": is not a checkpoint of a training run");
    const int version = run.at("version").get<int>();
    if (version > kCheckpointVersion)
      throw CheckpointError(where + ": is of version " + std::to_string(version) +
                            ", and this program knows versions up to " + std::to_string(kCheckpointVersion) +
                            "; use the program that wrote it");
    if (version < kCheckpointVersion)
      throw CheckpointError(where + ": is of version " + std::to_string(version) +
                            ", and this program goes on from version " + std::to_string(kCheckpointVersion) +
                            "; begin again with --overwrite");
    return {run.at("dataset_sha256").get<std::string>(),
            run.at("progress").get<double>(),
            run.at("seconds").get<double>(),
            run.at("trained_s").get<double>(),
            run.at("finished").get<bool>(),
            run.at("time_s").get<double>(),
            run.at("steps").get<std::int64_t>()};
  } catch (const nlohmann::json::exception&) {
    throw CheckpointError(where + ": its record of the run is incomplete; the file is damaged");
  }
}

bool all_finite(const Archive& archive) {
  for (const auto& [name, tensor] : archive.tensors) {
    if (tensor.is_floating_point() && !tensor.isfinite().all().item<bool>()) return false;
  }
  return true;
}

bool BestModel::due(double progress) const {
  return patience_ > 0.0 && place(progress) > n_judged_;
}

void BestModel::judge(const LearnedField& field, double psnr_db, double progress,
                      std::int64_t step) {
  n_judged_ = place(progress);
  if (field_ && psnr_db < psnr_db_ + kLeastGain_db) return;
  psnr_db_ = psnr_db;
  progress_ = progress;
  step_ = step;
  field_ = field.state();
  // The next step changes the field's numbers in place.
  for (auto& [name, tensor] : field_->tensors) tensor = tensor.detach().clone();
}

bool BestModel::patience_exceeded(double progress) const {
  return field_ && progress - progress_ > patience_;
}

std::unique_ptr<LearnedField> BestModel::field() const {
  return field_ ? restore_field(*field_, "the best model") : nullptr;
}

void BestModel::add_to(Archive& archive) const {
  if (!field_) return;
  Json json = Json::parse(archive.json);
  json["best"] = {{"judged", n_judged_},
                  {"psnr_power_db", psnr_db_},
                  {"progress", progress_},
                  {"step", step_},
                  {"field", Json::parse(field_->json)}};
  archive.json = json.dump();
  for (const auto& [name, tensor] : field_->tensors) archive.tensors[kPrefix + name] = tensor;
}

void BestModel::restore(const Archive& archive, const std::string& where) {
  const Json json = Json::parse(archive.json, nullptr, false);
  if (!json.is_object() || !json.contains("best")) return;
  try {
    const Json& best = json.at("best");
    n_judged_ = best.at("judged").get<int>();
    psnr_db_ = best.at("psnr_power_db").get<double>();
    progress_ = best.at("progress").get<double>();
    step_ = best.at("step").get<std::int64_t>();
    field_.emplace();
    field_->json = best.at("field").dump();
  } catch (const nlohmann::json::exception&) {
    throw CheckpointError(where +
                          ": what it says of its best model is incomplete; the file is damaged");
  }
  for (const auto& [name, tensor] : archive.tensors) {
    if (name.starts_with(kPrefix))
      field_->tensors[name.substr(std::string(kPrefix).size())] = tensor;
  }
  (void)restore_field(*field_, where);
}

Curve::Curve(std::span<const PosedImage> validation, double peak_power)
    : validation_(validation),
      views_(spread_indices(validation.size(), kMostViews)),
      peak_power_(peak_power) {}

std::optional<double> Curve::measure_if_due(const LearnedField& field, double now_s) {
  if (views_.empty()) return std::nullopt;
  if (!first_s_) next_s_ = *(first_s_ = now_s) + 0.1;
  if (now_s < next_s_) return std::nullopt;
  if (!last_db_) {
    // What a measurement costs is not known yet: one view says it. A network that is not pruned yet can take a minute for all.
    const Stopwatch watch;
    render_view(field, validation_[views_.front()].acquisition);
    spent_s_ += watch.seconds();
    const double wanted_s = *first_s_ + 0.1 + watch.seconds() * static_cast<double>(views_.size()) / kShare;
    if (now_s < wanted_s && wanted_s > *first_s_ + 1.0) {
      next_s_ = wanted_s;
      return std::nullopt;
    }
  }
  const double before_s = spent_s_;
  measure(field);
  const double cost_s = spent_s_ - before_s;
  // Costs change as voxels are halved and pruned, hence a margin.
  next_s_ = now_s + cost_s + std::max(1.25 * cost_s / kShare, (now_s - *first_s_) / kPointsPerSpan);
  return last_db_;
}

double Curve::measure(const LearnedField& field) {
  const Stopwatch watch;
  double sum_db = 0.0;
  for (const std::size_t n : views_) {
    const PosedImage& truth = validation_[n];
    sum_db += capped_psnr_db(render_view(field, truth.acquisition), truth.power, peak_power_);
  }
  last_db_ = sum_db / static_cast<double>(views_.size());
  spent_s_ += watch.seconds();
  return *last_db_;
}

namespace {

std::string text_of(const MetricsLine& line) {
  Json j{{"step", line.step}, {"seconds", line.seconds}};
  if (line.loss) j["loss"] = *line.loss;
  if (line.psnr_db) j["psnr_power_db"] = *line.psnr_db;
  return j.dump() + "\n";
}

/// Nothing for a line that was cut off.
std::optional<MetricsLine> line_of(const std::string& text) {
  const Json j = Json::parse(text, nullptr, false);
  const auto number = [&](const char* name) -> std::optional<double> {
    if (!j.contains(name) || !j[name].is_number()) return std::nullopt;
    return j[name].get<double>();
  };
  if (!j.is_object() || !number("step") || !number("seconds")) return std::nullopt;
  return MetricsLine{static_cast<std::int64_t>(*number("step")), *number("seconds"), number("loss"),
                     number("psnr_power_db")};
}

}  // namespace

MetricsLog::MetricsLog(std::filesystem::path path, std::int64_t last_step)
    : path_(std::move(path)) {
  std::ifstream old(path_);
  std::string kept;
  for (std::string text; std::getline(old, text);) {
    const auto line = line_of(text);
    if (!line || line->step > last_step) continue;
    lines_.push_back(*line);
    kept += text_of(*line);
  }
  old.close();
  write_file_atomically(path_, kept, Durability::process);
  file_.reset(std::fopen(path_.c_str(), "a"));
  if (!file_) throw Error(path_.string() + ": cannot be written: " + std::strerror(errno));
}

void MetricsLog::add(const MetricsLine& line) {
  lines_.push_back(line);
  const std::string text = text_of(line);
  if (std::fwrite(text.data(), 1, text.size(), file_.get()) != text.size() ||
      std::fflush(file_.get()) != 0)
    throw Error(path_.string() + ": cannot be written: " + std::strerror(errno) +
                "; free some space, the run can be continued");
}

namespace {

constexpr int kStepsPerLine = 10;
constexpr double kCheckpointInterval_s = 10.0, kFirstInterval_s = 1.0;
constexpr double kCheckpointShare = 0.02;  ///< greatest fraction of the time

/// Time for the work after a training by --time: two files and their names on the disk, with a margin.
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
  if (best_.patience_exceeded(progress_)) return true;
  if (!options_.time_s) return trainer_.steps_done() >= options_.steps;
  // At least one step: a model that has learned nothing is of no use.
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
    // Start-up counts towards --time, but nothing was learned in it.
    const double left_s = *options_.time_s - seconds() - 2.0 * last_write_s_ - kEndMargin_s;
    share = trained_s() / (trained_s() + std::max(left_s, 1e-3));
  }
  // If a run continues with a longer schedule, its progress must not decrease.
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
  // Parameters that are not finite must not replace finite ones; the loss may not show it yet.
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
  const bool last = !options_.time_s && ended();
  if (!best_.due(progress_) && !last) return std::nullopt;
  const double psnr_db = curve_.measure(trainer_.field());
  best_.judge(trainer_.field(), psnr_db, progress_, trainer_.steps_done());
  return psnr_db;
}

void TrainingRun::log(const StepReport& report, bool last) {
  loss_sum_ += report.loss;
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
  // From now on, a checkpoint to continue from always exists.
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
      log(report, ended());
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
    // With --time, training ends between two judgements: the last field has none yet.
    if (options_.time_s && options_.patience > 0.0 && !curve_.views().empty())
      best_.judge(trainer_.field(), curve_.measure(trainer_.field()), progress_, trainer_.steps_done());
    write(checkpoint(true));
    if (trainer_.field().occupied_box_m().empty())
      throw Error("nothing was learned: after " + counted(static_cast<std::uint64_t>(trainer_.steps_done()), "step") +
                  " no voxel is occupied, and an empty field is neither saved nor scored; do the images show anything "
                  "but ground, and of one scene?");
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

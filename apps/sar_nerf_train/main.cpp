// SPDX-License-Identifier: Apache-2.0
#include <fstream>
#include <optional>

#include <nlohmann/json.hpp>

#include "app_main.h"
#include "options.h"
#include "final_report.h"
#include "output_lock.h"
#include "training_run.h"
#include "sarnerf/core/files.h"
#include "sarnerf/core/parallel.h"
#include "sarnerf/nerf/trainer.h"
#include "torch_setup.h"

namespace sarnerf::app {
namespace {

using Json = nlohmann::ordered_json;

/// Greatest fraction of --time for the steps of one trial; there are two.
constexpr double kTrialPart = 0.1;

/// The choice of an earlier program that worked on this run with the same images; none if there is none.
std::optional<Json> recorded_choice(const RunFolder& folder, const std::string& fingerprint) {
  std::ifstream file(folder.trial());
  const Json record = Json::parse(file, nullptr, false);
  if (!record.is_object() || record.value("dataset_sha256", "") != fingerprint || !record.contains("field")) return std::nullopt;
  return record;
}

/// Replaces --field auto by the field that a trial chooses, or that it chose when the run began. Returns the record for the run's
/// folder; null if the user named the field.
Json choose(Options& options, const RunFolder& folder, Data& data, Console& console, const Monitor& monitor) {
  const auto recorded = options.overwrite ? std::nullopt : recorded_choice(folder, data.fingerprint);
  if (options.field != "auto") {
    // A run that is continued names its field.
    if (recorded && options.resume && recorded->value("field", "") == options.field) data.field_choice = recorded->value("reason", "");
    return {};
  }
  if (recorded) {
    options.field = recorded->value("field", "");
    data.field_choice = recorded->value("reason", "");
    return *recorded;
  }
  TrialRule rule;
  if (options.time_s) rule.most_seconds = kTrialPart * *options.time_s;
  const FieldChoice choice = choose_field(data.set, options.seed, monitor, rule);
  options.field = choice.field;
  data.field_choice = choice_text(choice);
  console.note("field " + data.field_choice + "; --field names another");
  Json record{{"dataset_sha256", data.fingerprint}, {"field", choice.field}, {"reason", data.field_choice}};
  for (const FieldTrial& trial : choice.trials)
    record["trials"].push_back({{"field", trial.field}, {"psnr_power_db", trial.psnr_power_db}, {"seconds", trial.seconds}});
  return record;
}

void run(const Options& asked, Console& console) {
  Options options = asked;
  use_torch_threads(is_network(options.field) ? options.shared.n_threads : 1);
  StageTimes times;
  times.add("start-up", seconds_since_start());
  const Monitor monitor{[&](std::string_view stage, std::uint64_t done, std::uint64_t n) {
                          console.progress(stage, done, n);
                        },
                        &stop_requested()};
  const RunFolder folder(options.run);
  check_place(options, folder);
  const ImageDistance lpips = load_lpips(options.lpips);

  const Stopwatch loading;
  Data data = load_data(options, console, monitor);
  times.add("load images", loading.seconds());
  if (options.field == "auto") require_common_options(options);
  const Stopwatch trying;
  const Json trial = choose(options, folder, data, console, monitor);
  if (!data.field_choice.empty()) times.add("trial of fields", trying.seconds());
  if (options.steps == 0) options.steps = default_steps(data.set, options.field);
  const TrainerOptions training = training_options(options, data.set);
  if (is_network(options.field)) warn_of_slow_blas(best_mlp_kernel(training.mlp.shape), console);
  const std::string config = config_text(options, training);
  if (options.dry_run) {
    const Trainer trainer(data.set, training, monitor);
    print_result(explain(options, data, trainer) + "\n");
    return;
  }
  make_folder(folder.path());
  const FolderLock lock(folder.path());
  const Start start = start_run(options, folder, config, data.fingerprint, console);
  const std::string result = folder.path().string() + "\n";
  if (start.done) {
    console.note("already done: the same run is there, nothing was trained");
    print_result(result);
    return;
  }
  folder.prepare();
  if (!trial.is_null()) write_file_atomically(folder.trial(), trial.dump(2) + "\n");
  monitor.check();

  const Stopwatch preparing;
  const ModelInfo info = model_info(data, data.set, options);
  Trainer trainer(std::move(data.set), training, monitor);
  if (start.checkpoint) trainer.restore(*start.checkpoint, folder.checkpoint().string());
  times.add("prepare field", preparing.seconds());
  if (options.explain) console.asked_for(explain(options, data, trainer));
  monitor.check();

  TrainingRun run(options, data, trainer, folder, info,
                  start.checkpoint ? &*start.checkpoint : nullptr);
  run.train(console, monitor);
  times.add("train", run.training_s() - run.curve().spent_s() - run.checkpoints_s());
  times.add("curve of held-out PSNR", run.curve().spent_s());
  times.add("checkpoints", run.checkpoints_s());
  write_reports({options, data, trainer, run, folder, config, lpips}, times, console, monitor);
  print_result(result);
}

}  // namespace
}  // namespace sarnerf::app

int main(int argc, char** argv) {
  using namespace sarnerf::app;
  return app_main("sar_nerf_train", argc, argv, parse_options, run);
}

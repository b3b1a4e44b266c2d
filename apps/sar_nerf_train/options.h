// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "console.h"
#include "nerf_common.h"
#include "process.h"
#include "sarnerf/core/parallel.h"
#include "sarnerf/dataset/posed_image.h"
#include "sarnerf/evaluation/evaluation.h"
#include "sarnerf/nerf/model_file.h"
#include "sarnerf/nerf/trainer.h"
#include "sarnerf/nerf/training_set.h"

namespace sarnerf::app {

/// Names of the files in a run's folder.
class RunFolder {
 public:
  explicit RunFolder(std::filesystem::path folder) : folder_(std::move(folder)) {}

  const std::filesystem::path& path() const { return folder_; }
  std::filesystem::path model() const { return folder_ / "model.pt"; }
  std::filesystem::path checkpoints() const { return folder_ / "checkpoints"; }
  std::filesystem::path checkpoint() const { return checkpoints() / "latest.pt"; }
  std::filesystem::path config() const { return folder_ / "config.toml"; }
  std::filesystem::path trial() const { return folder_ / "trial.json"; }  ///< with --field auto: the choice, and why
  std::filesystem::path metrics() const { return folder_ / "metrics.jsonl"; }
  std::filesystem::path report() const {
    return folder_ / "report.json";
  }  ///< written last: the run is complete
  std::filesystem::path page() const { return folder_ / "report.html"; }
  std::filesystem::path pictures() const { return folder_ / "val"; }

  /// Whether the folder contains any file or subfolder of a run.
  bool occupied() const;

  /// Deletes what an earlier run wrote, and nothing else. Deletes config.toml last:
  /// after an interruption, the remaining files can still be attributed to that run.
  void clear() const;

  /// Deletes the reports and the pictures, which will be made anew.
  void clear_reports() const;

  /// Creates the folders, and deletes temporary files of a killed process. Call it only while the folder is locked.
  void prepare() const;

 private:
  std::filesystem::path folder_;
};

/// What the user asked for, checked one by one and against each other, before any file but --config is opened.
struct Options {
  std::filesystem::path dataset;
  std::string field = "auto";    ///< auto: a trial decides between surface and grid
  std::optional<bool> registers;  ///< whether views' shifts and gains are learned; empty: the dataset decides
  SceneHeights heights;          ///< empty: the images decide
  ResolutionChoice resolution;   ///< automatic: that of the dataset
  std::int64_t steps = 0;        ///< 0: default_steps() for the images
  std::optional<double> time_s;  ///< instead of steps: the schedule follows the clock
  Holdout holdout;
  double patience = 0.0;          ///< fraction of the schedule; 0: no early end
  std::filesystem::path against;  ///< empty: no views of another dataset
  std::filesystem::path lpips;    ///< empty: not computed
  double despeckle_deg = 0.0;     ///< 0: single views are the only truth
  std::uint64_t seed = 1;
  std::vector<std::string> training;  ///< name=value
  std::filesystem::path run;          ///< folder of the output
  bool resume = false;                ///< continue the run in the folder `run`
  bool overwrite = false;
  bool explain = false;
  bool dry_run = false;               ///< print the plan and stop
  SharedOptions shared;
};

/// Empty when help or the version was asked for and has been printed. Throws UsageError, and InputError for a bad
/// configuration file or a run that does not exist.
std::optional<Options> parse_options(int argc, char** argv);

/// The images to learn from, and those that predictions are compared with.
struct Data {
  Dataset dataset;
  std::string fingerprint;  ///< dataset_fingerprint()
  std::vector<DatasetView> training_views;
  std::vector<PosedImage> validation;  ///< with the training set's aim point
  std::vector<DatasetView> validation_views;
  std::optional<DespeckledTruth> despeckled;  ///< of the validation views, if requested
  std::size_t n_held_out = 0;  ///< validation views of the dataset itself; they come first
  TrainingSet set;             ///< the trainer moves it out
  std::string field_choice;    ///< why the field was chosen; empty if the user named it
  /// The training images as registered to one another, for the baselines; empty if poses are exact.
  std::vector<PosedImage> registered;
};

/// Reads the dataset's manifest and images, and those of --against. Reports on the console what was left out or is unusual.
/// Throws InputError for bad files, UsageError if the two datasets cannot be compared or memory does not suffice.
Data load_data(const Options& options, Console& console, const Monitor& monitor);

/// Throws UsageError if a training option belongs to one kind of field alone, and none is named.
void require_common_options(const Options& options);

/// The description of these images in a model file; the caller sets steps and program.
ModelInfo model_info(const Data& data, const TrainingSet& set, const Options& options);

/// config.toml: every option that the result depends on, with defaults written out, so that --config repeats the run
/// even if another version has other defaults. Threads, memory limit and the run folder are not part of it.
std::string config_text(const Options& options, const TrainerOptions& training);

/// How a run's config.toml differs from the wanted one, in one line; empty if it does not. Ignores --steps and --time
/// unless `with_length`. Throws InputError for a file that is no configuration.
std::string config_difference(const std::filesystem::path& found, const std::string& wanted,
                              bool with_length);

/// The default training options for the images, changed by --option. Throws UsageError for unknown names (with the closest
/// known one), for values of another type or outside their limits, and for voxels too small for the scene's box.
TrainerOptions training_options(const Options& options, const TrainingSet& set);

}  // namespace sarnerf::app

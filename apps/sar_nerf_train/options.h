// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <tuple>
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
  std::filesystem::path metrics() const { return folder_ / "metrics.jsonl"; }
  std::filesystem::path report() const {
    return folder_ / "report.json";
  }  ///< written last: the run is complete
  std::filesystem::path page() const { return folder_ / "report.html"; }
  std::filesystem::path pictures() const { return folder_ / "val"; }

  /// Whether anything of a run is there.
  bool occupied() const;

  /// Deletes what an earlier run wrote and nothing else; config.toml goes last: whatever stops this in the middle, the
  /// rest is still known as that run's.
  void clear() const;

  /// Deletes reports and pictures: what is about to be made anew.
  void clear_reports() const;

  /// Creates the folders, and deletes temporary files of a killed process. Only while the folder is locked.
  void prepare() const;

 private:
  std::filesystem::path folder_;
};

/// Of the field `grid`: over what suits the images.
struct Smoothness {
  double factor = 1.0;
  bool validated = false;  ///< held-out views choose the factor
};

/// What the user asked for, checked one by one and against each other, before any file but --config is opened.
struct Options {
  std::filesystem::path dataset;
  std::string field = "grid";
  std::optional<bool> surfaces;  ///< unless the images decide
  std::optional<bool> registers;  ///< whether views' shifts and gains are learned; unless told, the dataset decides
  SceneHeights heights;          ///< unless told, the images decide
  ResolutionChoice resolution;   ///< unless told, the dataset says
  Smoothness smoothness;
  std::int64_t steps = 0;        ///< 0: as many as suit the images
  std::optional<double> time_s;  ///< instead of steps: the schedule follows the clock
  Holdout holdout;
  double patience = 0.0;          ///< share of the schedule; 0: training ends with it
  std::filesystem::path against;  ///< empty: no views of another dataset
  std::filesystem::path lpips;    ///< empty: not computed
  double despeckle_deg = 0.0;     ///< 0: single views are the only truth
  std::uint64_t seed = 1;
  std::vector<std::string> training;  ///< name=value
  std::filesystem::path run;          ///< folder of the output
  bool resume = false;                ///< `run` holds what is continued
  bool overwrite = false;
  bool explain = false;
  bool dry_run = false;               ///< print the plan and stop
  SharedOptions shared;
};

/// Empty when help or the version was asked for and has been printed. Throws UsageError, and InputError for a bad
/// configuration file or a run that is not there.
std::optional<Options> parse_options(int argc, char** argv);

/// Which images are learned from, and which are predicted to see how well.
struct Data {
  Dataset dataset;
  std::string fingerprint;  ///< dataset_fingerprint()
  std::vector<DatasetView> training_views;
  std::vector<PosedImage> validation;  ///< with the training set's aim point
  std::vector<DatasetView> validation_views;
  std::optional<DespeckledTruth> despeckled;  ///< of the validation views, where asked for
  std::size_t n_held_out = 0;  ///< of them, views of the dataset itself, first
  TrainingSet set;             ///< moved out by whoever trains
  /// Of the training images as they are registered to one another, which baselines average; none where poses are exact.
  std::vector<Acquisition> registered;
};

/// Reads the dataset's manifest and images, and those of --against. Tells the console what was left out or is odd. Throws
/// InputError for bad files and UsageError where the two datasets cannot be compared or memory does not suffice.
Data load_data(const Options& options, Console& console, const Monitor& monitor);

/// What a model says of these images; steps and program are the caller's.
ModelInfo model_info(const Data& data, const TrainingSet& set, const Options& options);

/// config.toml: every option that the result depends on, defaults written out, so that --config repeats the run whatever
/// another version's defaults are. Threads, memory limit and places are no part of it.
std::string config_text(const Options& options, const TrainerOptions& training);

/// How a run's config.toml differs from the wanted one, in one line; empty where it does not. Without `with_length`,
/// --steps and --time are passed over. Throws InputError for a file that is no configuration.
std::string config_difference(const std::filesystem::path& found, const std::string& wanted,
                              bool with_length);

/// smooth_density, smooth_source and smooth_angular of a run's config.toml; nothing where they are not all there. Throws
/// InputError for a file that is no configuration.
std::optional<std::tuple<double, double, double>> smoothness_in(const std::filesystem::path& found);

/// The training options that suit the images, changed as --option says. Throws UsageError for unknown names, with the
/// closest one, for values of another type, and for those with which nothing can be learned or no memory suffices.
TrainerOptions training_options(const Options& options, const TrainingSet& set);

/// Sets the weights smooth_* as --smoothness says: times a factor, or times the one that validation chooses. A run that is
/// there and goes on has been through that: its weights are taken. Says on the console what was chosen. Throws as
/// choose_smoothness().
TrainerOptions with_chosen_smoothness(const Options& options, const TrainerOptions& training, const TrainingSet& set,
                                      const RunFolder& folder, Console& console, const Monitor& monitor);

}  // namespace sarnerf::app

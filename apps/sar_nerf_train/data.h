// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "console.h"
#include "options.h"
#include "sarnerf/core/monitor.h"
#include "sarnerf/dataset/despeckled_truth.h"
#include "sarnerf/dataset/posed_image.h"
#include "sarnerf/nerf/model_file.h"
#include "sarnerf/nerf/training_set.h"

namespace sarnerf::app {

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
};

/// Reads the dataset's manifest and images, and those of --against. Tells the console what was left out or is odd. Throws
/// InputError for bad files and UsageError where the two datasets cannot be compared or memory does not suffice.
Data load_data(const Options& options, Console& console, const Monitor& monitor);

/// What a model says of these images; steps and program are the caller's.
ModelInfo model_info(const Data& data, const TrainingSet& set, const Options& options);

}  // namespace sarnerf::app

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "sarnerf/dataset/manifest.h"
#include "sarnerf/nerf/learned_field.h"

namespace sarnerf {

/// What a model file records about its training images.
struct ModelInfo {
  std::string program;  ///< the program that wrote it, with its version
  double reference_bin_m = 0.0;         ///< Δ_ref, the finest range bin of the training images
  Box scene_box_m;                      ///< world
  glm::dvec3 aim_m{0.0};                ///< world; origin of the field's frame
  Quantity quantity = Quantity::power;  ///< of the dataset's files; the field renders power
  Calibration calibration = Calibration::beta0;  ///< of what it renders
  double scale = 1.0;                            ///< of the dataset's files
  double peak_power = 0.0;                       ///< largest training pixel, reference of PSNR
  DatasetView acquisition;     ///< default of new views; no image
  std::string dataset;         ///< folder, as it was given
  std::string dataset_sha256;  ///< dataset_fingerprint()
  std::vector<DatasetView> training_views;  ///< their names, angles, ranges and look sides
  std::int64_t steps = 0;                   ///< number of training steps
};

struct Model {
  ModelInfo info;
  std::unique_ptr<LearnedField> field;
  /// Contents that older versions wrote and that have no effect any more, in words; empty when there are none.
  std::string ignored;
};

/// Writes LearnedField::state() and `info` with write_archive(), which replaces the file atomically. Equal fields and information
/// give the same bytes. Throws Error when the disk is full.
void write_model(const std::filesystem::path& path, const LearnedField& field,
                 const ModelInfo& info);

/// Throws CheckpointError for a file that is missing, truncated, not a model (a training checkpoint, say), of a newer
/// version, or has an unknown kind of field.
Model read_model(const std::filesystem::path& path);

}  // namespace sarnerf

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <glm/glm.hpp>

#include "process.h"
#include "sarnerf/dataset/posed_image.h"
#include "sarnerf/geometry/acquisition.h"
#include "sarnerf/render/engine.h"
#include "sarnerf/formation/image_formation.h"
#include "sarnerf/scene/scene.h"

namespace sarnerf::app {

enum class EngineChoice { automatic, surface, voxel };

/// "auto", "surface", "voxel".
std::string_view name(EngineChoice choice);

/// What the user asked for, checked one by one and against each other, before any file is opened.
/// Empty optionals are left to the program.
struct Options {
  std::filesystem::path scene;

  std::vector<double> incidence_deg;
  std::vector<double> azimuth_deg{0.0};
  double altitude_m = 10000.0;
  std::optional<double> slant_range_m;  ///< instead of the altitude
  Look look = Look::right;
  std::optional<glm::dvec3> aim_m;

  std::optional<std::pair<int, int>> size;  ///< azimuth, range
  std::pair<double, double> spacing_m{0.3, 0.3};
  Calibration calibration = Calibration::beta0;
  Quantity quantity = Quantity::power;
  ImageFormation formation;

  double units_m = 1.0;
  double scale = 1.0;
  UpAxis up = UpAxis::y;
  std::filesystem::path materials;
  std::optional<std::string> ground;
  std::optional<double> ground_height_m;

  EngineChoice engine = EngineChoice::automatic;
  std::optional<double> voxel_size_m;   ///< empty: chosen from the spacing
  double extinction_per_density = 1.0;  ///< of fog volumes made elsewhere (1/m)
  std::filesystem::path save_volume;    ///< empty: the voxels are not kept
  Sampling sampling;
  std::optional<double> tolerance;  ///< E that every view should meet, by its own estimate
  LayerSet layers;  ///< beside the image

  std::string output;  ///< empty: named after the scene
  bool overwrite = false;
  bool explain = false;
  bool dry_run = false;

  std::set<std::string> given;        ///< long names of the options that the user gave, here or in a file
  std::vector<std::string> warnings;  ///< parts of the options that were left out, one line each
  std::vector<std::string> notes;  ///< what the user should know about these options, one line each

  SharedOptions shared;
  std::vector<std::filesystem::path> indirect_inputs;  ///< files that the scene names; known once it is loaded

  /// Whether the scene is an OpenVDB file.
  bool volume() const { return scene.extension() == ".vdb"; }
  bool sweep() const { return incidence_deg.size() * azimuth_deg.size() > 1; }
};

/// Empty when help or the version was asked for and has been printed. Throws UsageError, and
/// InputError for a bad configuration file.
std::optional<Options> parse_options(int argc, char** argv);

/// Files of a single view.
struct ImagePaths {
  std::filesystem::path tiff, png, report;
  std::filesystem::path recipe;  ///< appears last: if it exists, the others are complete

  /// The file of a layer, by its ending.
  std::filesystem::path layer(const std::string& ending) const;
};
ImagePaths image_paths(const Options& options);

/// Folder of a sweep.
std::filesystem::path sweep_folder(const Options& options);

/// The output paths of these options, as text.
std::string output_text(const Options& options);

/// Check before any work. Throws UsageError if --save-volume would replace a file, unless the command continues or repeats an earlier
/// one, whose volume that may be.
void require_volume_place(const Options& options, bool continues);

/// Throws UsageError when a file to be written is one of the inputs.
void refuse_input(const std::filesystem::path& output, const Options& options);

}  // namespace sarnerf::app

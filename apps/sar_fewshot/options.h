// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "process.h"
#include "sarnerf/evaluation/baseline.h"
#include "sarnerf/recognise/classifier.h"

/// What is compared in a study, and what the user can choose.
namespace sarnerf::app {

/// Name of this program in recipes.
inline constexpr const char* kProgram = "sar_fewshot";

/// What a classifier gets beside the shots.
enum class Arm {
  none,
  turned,          ///< the nearest shot, turned on the level plane, within the gap between shots
  turned_both,     ///< both shots next to a view, turned: twice as many chips as turned, without a field
  turned_clutter,  ///< the nearest shot, turned, on the clutter of a shot of its class, as Speckle::shots gives to learned views
  turned_circle,   ///< every shot, turned through 360°
  rescaled,        ///< the nearest shot, turned, and rescaled in range to the depression of generated chips
  interpolated,    ///< the neighbouring shots, turned and averaged
  learned,         ///< views of a field that was learned from the shots, with the clutter of shots
  learned_turned,  ///< both
  interpolated_turned,  ///< as many chips as learned_turned, without a field: a control
  turned_clutter_turned,  ///< turned_clutter and turned: as many chips as learned_turned at the shots' depression, and clutter of shots, without a field: a control
  corrected,       ///< the nearest shot, turned, times the change that the field predicts
  measured,        ///< the measured chips nearest to these azimuths: what generation could reach at most
};
std::string_view name(Arm arm);

/// Whether its chips are made by a field.
inline bool needs_field(Arm arm) { return arm == Arm::learned || arm == Arm::learned_turned || arm == Arm::corrected; }

/// The arm whose chips stand beside turned ones in an arm that joins both.
inline std::optional<Arm> beside_turned(Arm arm) {
  if (arm == Arm::learned_turned) return Arm::learned;
  if (arm == Arm::interpolated_turned) return Arm::interpolated;
  if (arm == Arm::turned_clutter_turned) return Arm::turned_clutter;
  return std::nullopt;
}

inline constexpr Arm kArms[] = {Arm::none,           Arm::turned,              Arm::turned_both,           Arm::turned_clutter, Arm::turned_circle,
                                Arm::rescaled,       Arm::interpolated,        Arm::learned,               Arm::learned_turned,
                                Arm::interpolated_turned, Arm::turned_clutter_turned, Arm::corrected, Arm::measured};

/// What the clutter of a learned view is.
enum class Speckle {
  none,          ///< its mean
  shots,         ///< the background of a shot of its class, chosen and mirrored at random: other ground than that of the view
  nearest_shot,  ///< the background of the nearest shot, turned to the view: the same ground
};

/// What is generated, and how. The same for all classes and draws.
struct GenerationOptions {
  double step_deg = 5.0;    ///< between generated views
  double reach_deg = 45.0;  ///< largest distance of a generated view from a shot; never more than half the gap
  std::optional<double> depression_deg;  ///< of rescaled, interpolated, learned and corrected views; without: that of the shots
  Interpolation interpolation = Interpolation::rotated_linear;
  std::string field = "grid";
  std::int64_t field_steps = 200;
  Speckle speckle = Speckle::shots;
  int n_backgrounds = 1;  ///< of shots, averaged on each learned view: its looks over theirs
};

/// What the user asked for.
struct Options {
  std::filesystem::path chips, table;
  double scale = 1.0;
  std::optional<std::pair<double, double>> spacing_m;
  double training_depression_deg = 17.0, test_depression_deg = 15.0;
  std::vector<std::string> classes;  ///< empty: all
  std::size_t most_classes = 0;      ///< the first so many by name; 0: all

  std::vector<int> shots{4, 8, 12};  ///< 0: all chips
  int n_draws = 10;
  bool same_azimuths = false;  ///< shots of all classes start at the same azimuth
  std::vector<Arm> arms{Arm::none, Arm::turned, Arm::interpolated, Arm::learned, Arm::learned_turned};
  std::vector<Classifier> classifiers{Classifier::a_convnet, Classifier::nearest_neighbour, Classifier::background};
  bool validate = false;  ///< the test chips are sectors of 30° of the training depression
  bool test_rest = false;  ///< classes without chips at the test depression are tested on their training chips that are no shots
  bool exchange = false;   ///< test on chips with exchanged background, too
  bool check_clutter = false;  ///< compare the background of measured and generated chips, and learn nothing else
  bool check_ground = false;   ///< compare the background of training and test chips, and learn nothing

  ClassifierOptions training;
  GenerationOptions generation;

  std::filesystem::path output;
  /// Chips of all draws and arms are written there, as images, and as files for sar_recognise, and no classifier is trained; empty: not.
  std::filesystem::path chips_folder, draws_folder;
  bool dry_run = false;
  SharedOptions shared;
};

/// Empty when help or the version was asked for and has been printed. Throws UsageError, and InputError for a bad
/// configuration file.
std::optional<Options> parse_options(int argc, char** argv);

}  // namespace sarnerf::app

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "console.h"
#include "process.h"
#include "recipe_file.h"
#include "sarnerf/core/parallel.h"
#include "sarnerf/core/units.h"
#include "sarnerf/dataset/posed_image.h"
#include "sarnerf/evaluation/baseline.h"
#include "sarnerf/recognise/cell.h"
#include "sarnerf/report/plot.h"

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

/// The chips of a class, sorted by azimuth. Their aim is the origin.
struct ClassChips {
  std::string name;
  std::vector<PosedImage> training, test;
  std::string sha256;  ///< of all of it
};

/// Whether chips of the training depression are tested: in a validation, and where there are no others.
inline bool tests_training(const ClassChips& chips, bool validate) { return validate || chips.test.empty(); }

/// The list of which Draw::test takes chips.
inline const std::vector<PosedImage>& list_of_test(const ClassChips& chips, bool validate) {
  return tests_training(chips, validate) ? chips.training : chips.test;
}

/// Between two azimuths.
inline double apart_rad(double a_rad, double b_rad) { return std::abs(std::remainder(a_rad - b_rad, 2.0 * kPi)); }

inline double azimuth_deg(const PosedImage& chip) { return deg_from_rad(chip.acquisition.azimuth_rad); }

/// Reads the chips of both depressions (in a validation, of the training depression) and cuts them to the size of the smallest. Throws InputError if
/// a class has none, or fewer than the most shots, and UsageError for depressions and classes that do not go with the chips.
std::vector<ClassChips> read_chips(const Options& options, Console& console, const Monitor& monitor);

/// The shots of one draw: for each class, indices of its training chips, and of its test chips.
struct Draw {
  int n_shots = 0, number = 0;
  std::vector<std::vector<std::size_t>> shots;  ///< [class]
  std::vector<std::vector<std::size_t>> test;   ///< [class]: of list_of_test()
};

/// Shots at equal steps of azimuth from a random start for each class, or from one for all; the nearest chip to each step. In a validation, chips of
/// every fourth sector of 30°, beginning with the draw's number, are the test, and all shots lie in the other sectors: a step in a tested sector
/// gets a shot at its border, and every fourth draw tests the same sectors. Otherwise all
/// chips at the test depression are tested, or, of a class without any, all training chips that are no shots.
Draw draw_shots(const std::vector<ClassChips>& chips, int n_shots, int number, const Options& options);

/// No more chips than so many does an arm generate in a draw. An estimate for memory, in which all views lie within the reach.
std::size_t most_generated(Arm arm, const Draw& draw, const GenerationOptions& options);

/// Chips of an arm beside the draw's shots; none for Arm::none. Views divide each gap between neighbouring shots evenly, in steps of about
/// `step_deg`, and lie at most `reach_deg` from the nearer shot.
LabelledChips generated_chips(Arm arm, const std::vector<ClassChips>& chips, const Draw& draw, const Options& options,
                              const std::filesystem::path& cache, const Monitor& monitor);

/// The shots of a draw.
LabelledChips shots_of_classes(const std::vector<ClassChips>& chips, const Draw& draw);

/// The test chips of a draw; with exchanged backgrounds too, if the options ask for them.
TestChips test_of_classes(const std::vector<ClassChips>& chips, const Draw& draw, const Options& options);

/// In the folder of a study.
inline constexpr const char* kExchangePicture = "pictures/exchanged_background.png";

/// The picture of a class, in the folder of a study.
inline std::string picture_file(const ClassChips& chips) { return "pictures/" + chips.name + ".png"; }

/// What the pictures of a study show.
struct Pictures {
  std::vector<Arm> rows;   ///< below measured chips, in the picture of each class; empty: there are none
  bool exchanged = false;  ///< there is a picture of exchanged backgrounds
};

/// Writes a picture of each class, measured chips and below them those of the arms, and one of exchanged backgrounds. They are made again for other
/// arms or shots. None if all chips are shots.
Pictures write_pictures(const Options& options, const std::vector<ClassChips>& chips, const Monitor& monitor);

/// Side of the chips that classifiers get (pixels): the largest crop, and room for shifts.
inline constexpr int kStoredSide = 88 + 2 * 8;

/// Target and shadow of a chip are regions that reach this near to its centre (pixels): half a vehicle. What lies apart from them is clutter.
inline constexpr int kReachOfObject_pixels = 16;

/// Chips as a tensor, the central kStoredSide × kStoredSide pixels.
LabelledChips labelled(std::span<const PosedImage* const> chips, std::span<const std::int64_t> labels);

/// Power of the stored pixels.
std::vector<Image<float>> powers_of(const LabelledChips& chips);

/// The background of a chip over its mean, everywhere: where its target and its shadow are, it is that of the chip's edge.
Image<float> relative_background(const Image<float>& power);

/// The target and the shadow of a chip, with 8 pixels around them, on clutter of mean 1 and the same size, which is made as bright as the chip's
/// background. A chip in which no region is found, as on a ground without power, is returned as it is.
Image<float> on_clutter(const Image<float>& power, const Image<float>& clutter);

/// Fills `within` and `across`: the test chips, with targets and shadows on the backgrounds of other test chips of the same class and nearly
/// the same azimuth (a control: whatever this costs is the exchange's own fault) and of other classes. Targets and shadows are regions of
/// find_regions() around the centre, and 8 pixels more.
void exchange_backgrounds(TestChips& test, const std::vector<ClassChips>& chips, const Draw& draw, bool validate);

/// Correlation of the background of test chips with that of training chips, by class and distance in azimuth; in Markdown.
std::string ground_text(const std::vector<ClassChips>& chips, const Monitor& monitor);

/// Statistics of the background of measured chips and of learned ones at the same azimuths, and how often a network can tell them apart;
/// in Markdown. Of the first draw with the most shots. The corners of a learned view are those of a shot, mirrored: what is asked is whether
/// that shows, not whether clutter under a shot's target was filled in well.
std::string clutter_text(const Options& options, const std::vector<ClassChips>& chips, const Monitor& monitor);

/// Makes all cells that are not in the folder yet, and writes each as it ends. Throws Interrupted.
std::vector<Cell> run_study(const Options& options, const std::vector<ClassChips>& chips, Console& console, const Monitor& monitor);

/// Writes the chips that classifiers would learn from, float32 TIFFs of amplitude (a row of pixels is an azimuth, the first column the
/// nearest range): FOLDER/SHOTS_DRAW/ARM/CLASS/shot_000.tif and generated_000.tif, with a table of their azimuths, ARM/chips.csv; and files
/// of draws, DRAWS/SHOTS_DRAW.pt. Returns the number of chips.
std::size_t export_chips(const Options& options, const std::vector<ClassChips>& chips, const Monitor& monitor);

/// The study as it is planned, before any work: chips, cells, fields.
std::string plan_text(const Options& options, const std::vector<ClassChips>& chips);

/// What the cells and the generated chips of a folder depend on: the chips, the options, and how this program generates and trains; not
/// which cells are asked for.
Json request_of(const Options& options, const std::vector<ClassChips>& chips);

/// Fingerprint of the chips and options of an arm's chips and cells. Options of fields are left out for arms without a field, and all options of
/// generation for the shots alone: other fields leave such cells valid.
std::string study_of(const Options& options, const std::vector<ClassChips>& chips, Arm arm);

/// Throws UsageError if a draw that is asked for has not enough chips.
void require_draws(const Options& options, const std::vector<ClassChips>& chips);

/// "4", or "all" for 0.
std::string shots_text(int n_shots);

/// Title, tables of accuracy and of differences, in Markdown.
std::string study_text(const Options& options, const std::vector<ClassChips>& chips, const std::vector<Cell>& cells);

/// Tables of answers by class, in Markdown.
std::string confusion_text(const Options& options, const std::vector<ClassChips>& chips, const std::vector<Cell>& cells);

/// Accuracy against shots; nothing where all chips are shots.
std::optional<Plot> accuracy_plot(const Options& options, const std::vector<Cell>& cells, Classifier classifier);

Json study_json(const Options& options, const std::vector<ClassChips>& chips, const std::vector<Cell>& cells);

}  // namespace sarnerf::app

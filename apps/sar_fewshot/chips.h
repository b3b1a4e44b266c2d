// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "console.h"
#include "options.h"
#include "sarnerf/core/parallel.h"
#include "sarnerf/core/units.h"
#include "sarnerf/dataset/posed_image.h"

/// The chips of a study, its draws of shots, and chips as classifiers get them.
namespace sarnerf::app {

/// The chips of a class, sorted by azimuth. Their aim is the origin.
struct ClassChips {
  std::string name;
  std::vector<PosedImage> training, test;
  std::string sha256;    ///< of names, angles and power
  std::string geometry;  ///< as sha256, of spacings, slant ranges and sides
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
/// a class has none, or fewer than the most shots, or one chip twice, and UsageError for depressions and classes that do not go with the chips.
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
/// chips at the test depression are tested, or, of a class without any, all training chips that are no shots. Throws UsageError for fewer
/// usable chips than shots, and in a validation for a class without shots or test chips.
Draw draw_shots(const std::vector<ClassChips>& chips, int n_shots, int number, const Options& options);

/// Throws UsageError if a draw that is asked for has not enough chips.
void require_draws(const Options& options, const std::vector<ClassChips>& chips);

/// Side of the chips that classifiers get (pixels): the largest crop, and room for shifts.
inline constexpr int kStoredSide = 88 + 2 * 8;

/// Target and shadow of a chip are regions that reach this near to its centre (pixels): half a vehicle. What lies apart from them is clutter.
inline constexpr int kReachOfObject_pixels = 16;

/// Chips as a tensor, the central kStoredSide × kStoredSide pixels.
LabelledChips labelled(std::span<const PosedImage* const> chips, std::span<const std::int64_t> labels);

/// Power of the stored pixels.
std::vector<Image<float>> powers_of(const LabelledChips& chips);

/// The label of a chip.
inline std::size_t class_of(const LabelledChips& chips, std::size_t n) {
  return static_cast<std::size_t>(chips.label[static_cast<std::int64_t>(n)].item<std::int64_t>());
}

/// The shots of a draw.
LabelledChips shots_of_classes(const std::vector<ClassChips>& chips, const Draw& draw);

/// The test chips of a draw, as they were measured.
LabelledChips tested_chips(const std::vector<ClassChips>& chips, const Draw& draw, bool validate);

}  // namespace sarnerf::app

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "chips.h"
#include "recipe_file.h"
#include "sarnerf/recognise/cell.h"
#include "sarnerf/report/plot.h"

/// What the program does, one after the other: it plans a study (study.cpp), makes its cells or exports its chips, and writes tables
/// (results.cpp) and pictures (pictures.cpp).
namespace sarnerf::app {

/// The cells that are not in the folder yet, and how many steps of a network each takes. Throws InputError for one there that is of other chips or
/// options.
std::map<std::filesystem::path, std::uint64_t> missing_cells(const Options& options, const std::vector<ClassChips>& chips);

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

/// "4", or "all" for 0.
std::string shots_text(int n_shots);

/// Title, tables of accuracy and of differences, in Markdown.
std::string study_text(const Options& options, const std::vector<ClassChips>& chips, const std::vector<Cell>& cells);

/// Tables of answers by class, in Markdown.
std::string confusion_text(const Options& options, const std::vector<ClassChips>& chips, const std::vector<Cell>& cells);

/// Accuracy against shots; nothing where all chips are shots.
std::optional<Plot> accuracy_plot(const Options& options, const std::vector<Cell>& cells, Classifier classifier);

Json study_json(const Options& options, const std::vector<ClassChips>& chips, const std::vector<Cell>& cells);

/// In the folder of a study.
inline constexpr const char* kCellsFolder = "cells";
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

}  // namespace sarnerf::app

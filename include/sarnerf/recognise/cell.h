// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "sarnerf/recognise/classifier.h"

/// Cells of a study of few-shot recognition, and the files by which sar_fewshot and sar_recognise exchange chips and cells.
namespace sarnerf {

/// Numbers of test chips: [true class][answer].
using Confusion = std::vector<std::vector<int>>;

/// Of scores [n, n_classes]. Ties have the first of the highest scores.
Confusion confusion_of(const torch::Tensor& scores, const torch::Tensor& label, int n_classes);

/// Part of the test chips that were recognised.
double accuracy(const Confusion& confusion);

/// What classifiers are tested on: chips as they were measured, and, if the study exchanges them, the same chips with the background of
/// another chip of their class, at nearly the same azimuth, and of other classes.
struct TestChips {
  LabelledChips measured, within, across;
};

/// One trained classifier and its answers on the test chips.
struct Cell {
  Classifier classifier = Classifier::a_convnet;
  std::string arm;
  int n_shots = 0, draw = 0;            ///< 0 shots: all chips
  std::string study;                    ///< fingerprint of the chips and options that the arm depends on
  Confusion confusion, within, across;  ///< of TestChips
  std::string device;                   ///< "cpu, 2 threads": networks of other devices differ (classify())
  double seconds = 0.0;
};

/// Trains one classifier and tests it: fills the cell's answers, device and seconds. Throws as classify() does.
void make_cell(Cell& cell, const TrainingChips& training, const TestChips& test, int n_classes, const ClassifierOptions& options,
               const ProgressReport& report = {});

/// Whether an arm has a cell of its own: that of the background is that of the shots alone.
inline bool has_cell(Classifier classifier, std::string_view arm) { return classifier != Classifier::background || arm == "none"; }

/// "a-convnet_none_12_00.json".
std::string cell_file_name(const Cell& cell);

/// The cell as a JSON object.
std::string cell_json(const Cell& cell);

/// Everything that the classifiers of one draw of shots need, as one file: sar_fewshot writes it where the chips are, and
/// sar_recognise reads it where a GPU is.
struct DrawFile {
  /// The chips of an arm; without any for the shots alone.
  struct Generated {
    LabelledChips chips;
    std::string study;  ///< as in Cell
  };

  std::vector<std::string> classes;
  int n_shots = 0, draw = 0;
  ClassifierOptions options;
  LabelledChips shots;
  TestChips test;
  std::map<std::string, Generated> generated;  ///< by arm
};

/// A pickled dictionary of tensors, their sums, numbers and texts, which Python's torch.load() reads too. The device is not kept. The file appears
/// when it is complete. Throws Error for a file that cannot be written, and InputError for one that is missing, is something else, is of another
/// kTrainingMethod, or whose chips have changed since it was written.
void write_draw_file(const std::string& path, const DrawFile& draw);
DrawFile read_draw_file(const std::string& path);

/// Writes a file that appears when it is complete: an interrupted program leaves no half of it. Throws Error if that is impossible.
void write_when_complete(const std::string& path, std::string_view bytes);

}  // namespace sarnerf

// SPDX-License-Identifier: Apache-2.0
// sar_recognise: trains the classifiers of sar_fewshot from files that it wrote (--export-draws), where there is LibTorch and nothing
// else, such as on a machine with a GPU. Its cells belong into the folder `cells` of the study, which then makes its report of them.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <string>
#include <vector>

#include <torch/cuda.h>

#include "sarnerf/core/error.h"
#include "sarnerf/recognise/cell.h"

namespace {

using namespace sarnerf;

constexpr const char* kUsage =
    "Usage: sar_recognise FILE... [OPTION VALUE]...\n"
    "Trains classifiers from files of sar_fewshot --export-draws, and writes a cell for each, CLASSIFIER_ARM_SHOTS_DRAW.json. Cells that\n"
    "are there are not made again. Put them into the folder `cells` of the study; sar_fewshot then makes its report.\n"
    "  --classifier NAME  a-convnet (default), resnet50, nearest or background; may be given again\n"
    "  --arm NAME         only this arm of the files; may be given again\n"
    "  --device NAME      cpu or cuda (default: cuda if there is one)\n"
    "  -o FOLDER          of the cells (default cells)\n"
    "Exit codes: 0 done, 1 failure at run time, 2 usage, 3 bad input file, 4 a training diverged\n";

struct Options {
  std::vector<std::string> files, arms;
  std::vector<Classifier> classifiers;
  torch::Device device = torch::cuda::is_available() ? torch::kCUDA : torch::kCPU;
  std::filesystem::path output = "cells";
};

Classifier classifier_named(const std::string& text) {
  for (const Classifier c : {Classifier::a_convnet, Classifier::resnet50, Classifier::nearest_neighbour, Classifier::background})
    if (name(c) == text) return c;
  throw UsageError("--classifier: expected a-convnet, resnet50, nearest or background, found '" + text + "'");
}

Options parse(const std::vector<std::string>& arguments) {
  Options o;
  for (std::size_t n = 0; n < arguments.size(); ++n) {
    const std::string& option = arguments[n];
    if (option.empty() || option.front() != '-') {
      o.files.push_back(option);
      continue;
    }
    if (n + 1 == arguments.size()) throw UsageError(option + ": expected a value, found none; see --help");
    const std::string& value = arguments[++n];
    if (option == "--classifier") {
      o.classifiers.push_back(classifier_named(value));
    } else if (option == "--arm") {
      o.arms.push_back(value);
    } else if (option == "--device") {
      if (value != "cpu" && value != "cuda") throw UsageError("--device: expected cpu or cuda, found '" + value + "'");
      o.device = value == "cuda" ? torch::kCUDA : torch::kCPU;
      if (o.device.is_cuda() && !torch::cuda::is_available()) throw UsageError("--device cuda: this LibTorch finds no GPU; leave it out");
    } else if (option == "-o") {
      o.output = value;
    } else {
      throw UsageError(option + " " + value + ": expected an option of --help");
    }
  }
  if (o.files.empty()) throw UsageError("expected files of sar_fewshot --export-draws, found none; see --help");
  if (o.classifiers.empty()) o.classifiers = {Classifier::a_convnet};
  return o;
}

/// Where a cell is kept.
std::filesystem::path file_of(const Options& o, const Cell& cell) { return o.output / cell_file_name(cell); }

/// Whether the cell's file is there. Throws InputError if it is another cell's, or a part of one.
bool is_made(const Options& o, const Cell& cell) {
  const auto file = file_of(o, cell);
  std::ifstream in(file);
  if (!in) return false;
  const std::string text((std::istreambuf_iterator<char>(in)), {});
  if (text.find("\"study\": \"") == std::string::npos || text.find("\"seconds\"") == std::string::npos)
    throw InputError(file.string() + ": expected a cell, found something else, or a part of one; remove the file");
  if (text.find("\"study\": \"" + cell.study + "\"") == std::string::npos)
    throw InputError(file.string() + ": is a cell of other chips or options; choose another folder (-o)");
  return true;
}

/// Makes a cell, unless there is one of the same study.
void make_cell_file(const Options& o, Cell cell, const DrawFile& draw) {
  if (is_made(o, cell)) return;
  ClassifierOptions options = draw.options;
  options.device = o.device;
  make_cell(cell, {draw.shots, draw.generated.at(cell.arm).chips}, draw.test, static_cast<int>(draw.classes.size()), options);
  write_when_complete(file_of(o, cell).string(), cell_json(cell));
  std::printf("%s: %.1f %% recognised, %.1f s\n", file_of(o, cell).c_str(), 100.0 * accuracy(cell.confusion), cell.seconds);
  std::fflush(stdout);
}

bool asks_for(const Options& o, const std::string& arm) { return o.arms.empty() || std::find(o.arms.begin(), o.arms.end(), arm) != o.arms.end(); }

/// The cells that are asked for of a draw, empty.
std::vector<Cell> cells_of(const Options& o, const DrawFile& draw) {
  std::vector<Cell> cells;
  for (const Classifier classifier : o.classifiers)
    for (const auto& [arm, generated] : draw.generated)
      if (asks_for(o, arm) && has_cell(classifier, arm))
        cells.push_back({classifier, arm, draw.n_shots, draw.draw, generated.study, {}, {}, {}, {}, 0.0});
  return cells;
}

/// Refuses a file without the chips that are asked for, and cells of other studies.
void check(const Options& o, const std::string& file, const DrawFile& draw) {
  if (std::count(o.classifiers.begin(), o.classifiers.end(), Classifier::background) > 0 && (draw.generated.count("none") == 0 || !asks_for(o, "none")))
    throw UsageError("--classifier background: learns from the shots alone, the arm none; add that arm");
  for (const std::string& arm : o.arms)
    if (draw.generated.count(arm) == 0) throw UsageError("--arm: expected an arm of " + file + ", found '" + arm + "'");
  for (const Cell& cell : cells_of(o, draw)) is_made(o, cell);
}

void run(const Options& o) {
  // All files before the first training: hours may lie between it and the last one.
  for (const std::string& file : o.files) check(o, file, read_draw_file(file));
  std::error_code ignored;
  std::filesystem::create_directories(o.output, ignored);
  const auto trial = o.output / "trial";
  write_when_complete(trial.string(), "");
  std::filesystem::remove(trial);
  for (const std::string& file : o.files) {
    const DrawFile draw = read_draw_file(file);
    for (const Cell& cell : cells_of(o, draw)) make_cell_file(o, cell, draw);
  }
}

int exit_code(const std::exception& e) {
  if (dynamic_cast<const UsageError*>(&e)) return 2;
  if (dynamic_cast<const InputError*>(&e)) return 3;
  return dynamic_cast<const NumericsError*>(&e) ? 4 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    const std::vector<std::string> arguments(argv + 1, argv + argc);
    for (const std::string& argument : arguments)
      if (argument == "--help" || argument == "-h") return std::fputs(kUsage, stdout), 0;
    run(parse(arguments));
    return 0;
  } catch (const std::exception& e) {
    std::fprintf(stderr, "sar_recognise: error: %s\n", std::string(e.what()).substr(0, std::string(e.what()).find('\n')).c_str());
    return exit_code(e);
  }
}

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
    "  -o FOLDER          of the cells (default cells)\n";

/// A wrong command line.
struct Usage : std::runtime_error {
  using std::runtime_error::runtime_error;
};

struct Options {
  std::vector<std::string> files, arms;
  std::vector<Classifier> classifiers;
  torch::Device device = torch::cuda::is_available() ? torch::kCUDA : torch::kCPU;
  std::filesystem::path output = "cells";
};

Classifier classifier_named(const std::string& text) {
  for (const Classifier c : {Classifier::a_convnet, Classifier::resnet50, Classifier::nearest_neighbour, Classifier::background})
    if (name(c) == text) return c;
  throw Usage("--classifier: expected a-convnet, resnet50, nearest or background, found '" + text + "'");
}

Options parse(const std::vector<std::string>& arguments) {
  Options o;
  for (std::size_t n = 0; n < arguments.size(); ++n) {
    const std::string& option = arguments[n];
    if (option.empty() || option.front() != '-') {
      o.files.push_back(option);
      continue;
    }
    if (n + 1 == arguments.size()) throw Usage(option + ": expected a value, found none; see --help");
    const std::string& value = arguments[++n];
    if (option == "--classifier") {
      o.classifiers.push_back(classifier_named(value));
    } else if (option == "--arm") {
      o.arms.push_back(value);
    } else if (option == "--device") {
      if (value != "cpu" && value != "cuda") throw Usage("--device: expected cpu or cuda, found '" + value + "'");
      o.device = value == "cuda" ? torch::kCUDA : torch::kCPU;
      if (o.device.is_cuda() && !torch::cuda::is_available()) throw Usage("--device cuda: this LibTorch finds no GPU; leave it out");
    } else if (option == "-o") {
      o.output = value;
    } else {
      throw Usage(option + " " + value + ": expected an option of --help");
    }
  }
  if (o.files.empty()) throw Usage("expected files of sar_fewshot --export-draws, found none; see --help");
  if (o.classifiers.empty()) o.classifiers = {Classifier::a_convnet};
  return o;
}

/// Makes a cell, unless there is one of the same study.
void make_cell_file(const Options& o, Classifier classifier, const std::string& arm, const DrawFile& draw) {
  const DrawFile::Generated& generated = draw.generated.at(arm);
  Cell cell{classifier, arm, draw.n_shots, draw.draw, generated.study, {}, {}, {}, {}, 0.0};
  const auto file = o.output / cell_file_name(cell);
  if (std::ifstream in(file); in) {
    const std::string text((std::istreambuf_iterator<char>(in)), {});
    if (text.find("\"study\": \"" + generated.study + "\"") != std::string::npos) return;
    if (text.find("\"study\": \"") == std::string::npos || text.find("\"seconds\"") == std::string::npos)
      throw std::runtime_error(file.string() + ": expected a cell, found something else, or a part of one; remove the file");
    throw std::runtime_error(file.string() + ": is a cell of other chips or options; choose another folder (-o)");
  }
  ClassifierOptions options = draw.options;
  options.device = o.device;
  make_cell(cell, {draw.shots, generated.chips}, draw.test, static_cast<int>(draw.classes.size()), options);
  // Renamed when complete: an interrupted run leaves no half of a cell.
  const auto part = std::filesystem::path(file).concat(".part");
  std::ofstream out(part);
  out << cell_json(cell);
  out.close();
  if (!out) throw std::runtime_error(part.string() + ": cannot be written; is the disk full?");
  std::filesystem::rename(part, file);
  std::printf("%s: %.1f %% recognised, %.1f s\n", file.c_str(), 100.0 * accuracy(cell.confusion), cell.seconds);
  std::fflush(stdout);
}

bool asks_for(const Options& o, const std::string& arm) { return o.arms.empty() || std::find(o.arms.begin(), o.arms.end(), arm) != o.arms.end(); }

/// Refuses a file without the chips that are asked for.
void check(const Options& o, const std::string& file, const DrawFile& draw) {
  if (std::count(o.classifiers.begin(), o.classifiers.end(), Classifier::background) > 0 && (draw.generated.count("none") == 0 || !asks_for(o, "none")))
    throw Usage("--classifier background: learns from the shots alone, the arm none; add that arm");
  for (const std::string& arm : o.arms)
    if (draw.generated.count(arm) == 0) throw std::runtime_error(file + ": has no chips of the arm '" + arm + "'");
}

void run(const Options& o) {
  // All files before the first training: hours may lie between it and the last one.
  for (const std::string& file : o.files) check(o, file, read_draw_file(file));
  std::filesystem::create_directories(o.output);
  for (const std::string& file : o.files) {
    const DrawFile draw = read_draw_file(file);
    for (const Classifier classifier : o.classifiers)
      for (const auto& [arm, generated] : draw.generated)
        if (asks_for(o, arm) && has_cell(classifier, arm)) make_cell_file(o, classifier, arm, draw);
  }
}

}  // namespace

int main(int argc, char** argv) {
  try {
    const std::vector<std::string> arguments(argv + 1, argv + argc);
    for (const std::string& argument : arguments)
      if (argument == "--help" || argument == "-h") return std::fputs(kUsage, stdout), 0;
    run(parse(arguments));
    return 0;
  } catch (const Usage& e) {
    std::fprintf(stderr, "sar_recognise: error: %s\n", e.what());
    return 2;
  } catch (const std::exception& e) {
    std::fprintf(stderr, "sar_recognise: error: %s\n", std::string(e.what()).substr(0, std::string(e.what()).find('\n')).c_str());
    return 1;
  }
}

// SPDX-License-Identifier: Apache-2.0
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>
#include <stdexcept>
#include <type_traits>

#include <ATen/Parallel.h>
#include <torch/csrc/jit/serialization/pickle.h>
#include <torch/types.h>

#include "sarnerf/core/error.h"
#include "sarnerf/recognise/cell.h"

namespace sarnerf {

Confusion confusion_of(const torch::Tensor& scores, const torch::Tensor& label, int n_classes) {
  const auto n = static_cast<std::size_t>(n_classes);
  Confusion confusion(n, std::vector<int>(n, 0));
  const torch::Tensor answer = scores.argmax(1);
  for (std::int64_t k = 0; k < label.size(0); ++k)
    ++confusion[static_cast<std::size_t>(label[k].item<std::int64_t>())][static_cast<std::size_t>(answer[k].item<std::int64_t>())];
  return confusion;
}

double accuracy(const Confusion& confusion) {
  int n_test = 0, n_correct = 0;
  for (std::size_t c = 0; c < confusion.size(); ++c) {
    for (const int count : confusion[c]) n_test += count;
    n_correct += confusion[c][c];
  }
  return n_test > 0 ? static_cast<double>(n_correct) / n_test : 0.0;
}

void make_cell(Cell& cell, const TrainingChips& training, const TestChips& test, int n_classes, const ClassifierOptions& options,
               const ProgressReport& report) {
  const auto start = std::chrono::steady_clock::now();
  const LabelledChips all = joined(joined(test.measured, test.within), test.across);
  const torch::Tensor scores = classify(cell.classifier, training, all.amplitude, n_classes, options, report);
  std::int64_t first = 0;
  const auto next = [&](const LabelledChips& part) -> Confusion {
    if (part.size() == 0) return {};
    first += part.size();
    return confusion_of(scores.narrow(0, first - part.size(), part.size()), part.label, n_classes);
  };
  cell.confusion = next(test.measured);
  cell.within = next(test.within);
  cell.across = next(test.across);
  const torch::Device device = is_network(cell.classifier) ? options.device : torch::Device(torch::kCPU);
  cell.device = device.str();
  if (device.is_cpu()) cell.device += ", " + std::to_string(at::get_num_threads()) + (at::get_num_threads() == 1 ? " thread" : " threads");
  cell.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

// Cells as files.

std::string cell_file_name(const Cell& cell) {
  char numbers[40];
  std::snprintf(numbers, sizeof numbers, "_%02d_%02d.json", cell.n_shots, cell.draw);
  return std::string(name(cell.classifier)) + "_" + cell.arm + numbers;
}

namespace {

std::string json_rows(const Confusion& confusion) {
  std::ostringstream rows;
  for (std::size_t c = 0; c < confusion.size(); ++c) {
    rows << (c > 0 ? ", [" : "[");
    for (std::size_t answer = 0; answer < confusion[c].size(); ++answer) rows << (answer > 0 ? ", " : "") << confusion[c][answer];
    rows << "]";
  }
  return "[" + rows.str() + "]";
}

}  // namespace

std::string cell_json(const Cell& cell) {
  std::ostringstream json;
  json << "{\n \"classifier\": \"" << name(cell.classifier) << "\",\n \"arm\": \"" << cell.arm << "\",\n \"shots\": " << cell.n_shots
       << ",\n \"draw\": " << cell.draw << ",\n \"study\": \"" << cell.study << "\",\n \"accuracy\": " << accuracy(cell.confusion)
       << ",\n \"confusion\": " << json_rows(cell.confusion);
  if (!cell.within.empty())
    json << ",\n \"confusion_within\": " << json_rows(cell.within) << ",\n \"confusion_across\": " << json_rows(cell.across);
  if (!cell.device.empty()) json << ",\n \"device\": \"" << cell.device << "\"";
  json << ",\n \"seconds\": " << cell.seconds << "\n}\n";
  return json.str();
}

// Draws as files.

namespace {

using Dictionary = c10::impl::GenericDict;

constexpr const char* kFormat = "sarnerf-draw-5";

/// Of all bits of the chips: LibTorch's reader does not look whether bytes of an archive have changed.
std::int64_t sum_of(const LabelledChips& chips) {
  return chips.size() > 0 ? chips.amplitude.contiguous().view(torch::kInt32).sum().item<std::int64_t>() + chips.label.sum().item<std::int64_t>() : 0;
}

void put(Dictionary& file, const std::string& name, const LabelledChips& chips) {
  const bool any = chips.size() > 0;
  file.insert(name + ".amplitude", any ? chips.amplitude.contiguous() : torch::empty({0, 0, 0}));
  file.insert(name + ".label", any ? chips.label.contiguous() : torch::empty({0}, torch::kInt64));
  file.insert(name + ".sum", sum_of(chips));
}

LabelledChips chips_of(const Dictionary& file, const std::string& name) {
  LabelledChips chips{file.at(name + ".amplitude").toTensor(), file.at(name + ".label").toTensor()};
  if (chips.amplitude.dim() != 3 || chips.amplitude.scalar_type() != torch::kFloat32 || chips.label.dim() != 1 ||
      chips.label.scalar_type() != torch::kInt64 || chips.label.size(0) != chips.amplitude.size(0) ||
      sum_of(chips) != file.at(name + ".sum").toInt())
    throw std::runtime_error("chips");
  return chips.size() > 0 ? chips : LabelledChips{};
}

/// Texts as one, a line each.
std::string lines(const std::vector<std::string>& texts) {
  std::string all;
  for (const std::string& text : texts) all += text + '\n';
  return all;
}

std::vector<std::string> texts_of(const Dictionary& file, const std::string& name) {
  std::vector<std::string> texts;
  std::istringstream all(file.at(name).toStringRef());
  for (std::string line; std::getline(all, line);) texts.push_back(line);
  return texts;
}

/// The options that decide what is learned, by their names in the file.
template <class Options, class Visit>
void each_number(Options& o, const Visit& visit) {
  visit("steps", o.n_steps);
  visit("batch", o.batch);
  visit("rate", o.rate);
  visit("weight_decay", o.weight_decay);
  visit("label_smoothing", o.label_smoothing);
  visit("shift_pixels", o.shift_pixels);
  visit("gain_jitter", o.gain_jitter);
  visit("shot_fraction", o.shot_fraction);
  visit("seed", o.seed);
}

}  // namespace

void write_draw_file(const std::string& path, const DrawFile& draw) {
  Dictionary file(c10::StringType::get(), c10::AnyType::get());
  file.insert("format", std::string(kFormat));
  file.insert("training_method", static_cast<std::int64_t>(kTrainingMethod));
  file.insert("classes", lines(draw.classes));
  file.insert("shots_of_each_class", static_cast<std::int64_t>(draw.n_shots));
  file.insert("draw", static_cast<std::int64_t>(draw.draw));
  each_number(draw.options, [&](const char* name, auto value) { file.insert(name, static_cast<double>(value)); });
  put(file, "shots", draw.shots);
  put(file, "test", draw.test.measured);
  put(file, "test within", draw.test.within);
  put(file, "test across", draw.test.across);
  std::vector<std::string> arms;
  for (const auto& [arm, generated] : draw.generated) {
    arms.push_back(arm);
    put(file, arm, generated.chips);
    file.insert(arm + ".study", generated.study);
  }
  file.insert("arms", lines(arms));
  const std::vector<char> bytes = torch::jit::pickle_save(file);
  write_when_complete(path, {bytes.data(), bytes.size()});
}

DrawFile read_draw_file(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  if (!in) throw InputError(path + ": expected a file of a draw of shots (sar_fewshot --export-draws), found none");
  const std::vector<char> bytes((std::istreambuf_iterator<char>(in)), {});
  try {
    const Dictionary file = torch::jit::pickle_load(bytes).toGenericDict();
    if (file.at("format").toStringRef() != kFormat) throw std::runtime_error("format");
    if (file.at("training_method").toInt() != kTrainingMethod) throw std::runtime_error("training_method");
    DrawFile draw;
    draw.classes = texts_of(file, "classes");
    draw.n_shots = static_cast<int>(file.at("shots_of_each_class").toInt());
    draw.draw = static_cast<int>(file.at("draw").toInt());
    each_number(draw.options, [&](const char* name, auto& value) {
      value = static_cast<std::remove_reference_t<decltype(value)>>(file.at(name).toDouble());
    });
    draw.shots = chips_of(file, "shots");
    draw.test = {chips_of(file, "test"), chips_of(file, "test within"), chips_of(file, "test across")};
    for (const std::string& arm : texts_of(file, "arms")) draw.generated[arm] = {chips_of(file, arm), file.at(arm + ".study").toStringRef()};
    std::vector<const LabelledChips*> all{&draw.shots, &draw.test.measured, &draw.test.within, &draw.test.across};
    for (const auto& [arm, generated] : draw.generated) all.push_back(&generated.chips);
    for (const LabelledChips* chips : all)
      if (!has_labels_of(*chips, static_cast<std::int64_t>(draw.classes.size()))) throw std::runtime_error("labels");
    return draw;
  } catch (const std::exception&) {
    throw InputError(path + ": is not a file of a draw of shots (sar_fewshot --export-draws of this version), or is damaged (" +
                     std::to_string(bytes.size()) + " bytes)");
  }
}

void write_when_complete(const std::string& path, std::string_view bytes) {
  const std::string part = path + ".part";
  std::ofstream out(part, std::ios::binary);
  out.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  out.close();
  std::error_code code, ignored;
  if (out) std::filesystem::rename(part, path, code);
  if (out && !code) return;
  std::filesystem::remove(part, ignored);
  throw Error(path + ": cannot be written; is the folder there and writable, or the disk full?");
}

}  // namespace sarnerf

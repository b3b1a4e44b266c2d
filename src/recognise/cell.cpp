// SPDX-License-Identifier: Apache-2.0
#include <fstream>
#include <iterator>
#include <sstream>
#include <stdexcept>
#include <type_traits>

#include <torch/csrc/jit/serialization/pickle.h>
#include <torch/torch.h>

#include "sarnerf/recognise/classifier.h"

namespace sarnerf {

namespace {

using Dictionary = c10::impl::GenericDict;

constexpr const char* kFormat = "sarnerf-draw-1";

void put(Dictionary& file, const std::string& name, const LabelledChips& chips) {
  const bool any = chips.size() > 0;
  file.insert(name + ".amplitude", any ? chips.amplitude.contiguous() : torch::empty({0, 0, 0}));
  file.insert(name + ".label", any ? chips.label.contiguous() : torch::empty({0}, torch::kInt64));
}

LabelledChips chips_of(const Dictionary& file, const std::string& name) {
  LabelledChips chips{file.at(name + ".amplitude").toTensor(), file.at(name + ".label").toTensor()};
  if (chips.amplitude.dim() != 3 || chips.amplitude.scalar_type() != torch::kFloat32 || chips.label.dim() != 1 ||
      chips.label.scalar_type() != torch::kInt64 || chips.label.size(0) != chips.amplitude.size(0))
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
  visit("shift_pixels", o.shift_pixels);
  visit("gain_jitter", o.gain_jitter);
  visit("shot_fraction", o.shot_fraction);
  visit("seed", o.seed);
}

}  // namespace

void write_draw_file(const std::string& path, const DrawFile& draw) {
  Dictionary file(c10::StringType::get(), c10::AnyType::get());
  file.insert("format", std::string(kFormat));
  file.insert("classes", lines(draw.classes));
  file.insert("shots_of_each_class", static_cast<std::int64_t>(draw.n_shots));
  file.insert("draw", static_cast<std::int64_t>(draw.draw));
  each_number(draw.options, [&](const char* name, auto value) { file.insert(name, static_cast<double>(value)); });
  put(file, "shots", draw.shots);
  put(file, "test", draw.test);
  std::vector<std::string> arms;
  for (const auto& [arm, chips] : draw.generated) {
    arms.push_back(arm);
    put(file, arm, chips);
  }
  file.insert("arms", lines(arms));
  const std::vector<char> bytes = torch::jit::pickle_save(file);
  std::ofstream out(path, std::ios::binary);
  out.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  out.close();
  if (!out) throw std::runtime_error(path + ": cannot be written; is the disk full?");
}

DrawFile read_draw_file(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  if (!in) throw std::runtime_error(path + ": expected a file of a draw of shots (sar_fewshot --export-draws), found none");
  const std::vector<char> bytes((std::istreambuf_iterator<char>(in)), {});
  try {
    const Dictionary file = torch::jit::pickle_load(bytes).toGenericDict();
    if (file.at("format").toStringRef() != kFormat) throw std::runtime_error("format");
    DrawFile draw;
    draw.classes = texts_of(file, "classes");
    draw.n_shots = static_cast<int>(file.at("shots_of_each_class").toInt());
    draw.draw = static_cast<int>(file.at("draw").toInt());
    each_number(draw.options, [&](const char* name, auto& value) {
      value = static_cast<std::remove_reference_t<decltype(value)>>(file.at(name).toDouble());
    });
    draw.shots = chips_of(file, "shots");
    draw.test = chips_of(file, "test");
    for (const std::string& arm : texts_of(file, "arms")) draw.generated[arm] = chips_of(file, arm);
    return draw;
  } catch (const std::exception&) {
    throw std::runtime_error(path + ": is not a file of a draw of shots (sar_fewshot --export-draws), or is damaged (" +
                             std::to_string(bytes.size()) + " bytes)");
  }
}

}  // namespace sarnerf

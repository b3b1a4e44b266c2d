// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <random>
#include <string>
#include <utility>
#include <vector>

namespace sarnerf::test {

/// The layers of AlexNet with a few channels only, and random weights.
struct SmallNetwork {
  static constexpr std::array<int, 5> kPlace{0, 3, 6, 8, 10};
  static constexpr std::array<int, 5> kKernel{11, 5, 3, 3, 3};
  std::array<int, 6> channels{3, 4, 6, 5, 3, 7};
  std::array<std::vector<float>, 5> weight, bias, linear;

  explicit SmallNetwork(unsigned seed = 1) {
    std::mt19937 random(seed);
    std::normal_distribution<float> normal;
    for (std::size_t l = 0; l < 5; ++l) {
      const int n_in = channels[l], n_out = channels[l + 1], fan = n_in * kKernel[l] * kKernel[l];
      weight[l].resize(static_cast<std::size_t>(n_out * fan));
      for (float& w : weight[l]) w = normal(random) * std::sqrt(2.0f / static_cast<float>(fan));
      bias[l].resize(static_cast<std::size_t>(n_out));
      for (float& b : bias[l]) b = 0.1f * normal(random);
      linear[l].resize(static_cast<std::size_t>(n_out));
      for (float& w : linear[l]) w = std::abs(normal(random));
    }
  }
};

/// A safetensors file, written by its description alone.
class SafetensorsWriter {
 public:
  void add(const std::string& name, const std::vector<int>& shape, const std::vector<float>& values,
           const std::string& type = "F32") {
    std::string sides;
    for (const int side : shape) sides += (sides.empty() ? "" : ",") + std::to_string(side);
    const std::size_t begin = values_.size();
    values_.resize(begin + 4 * values.size());
    if (!values.empty()) std::memcpy(values_.data() + begin, values.data(), 4 * values.size());
    header_ += (header_.empty() ? "" : ",") +
               ("\"" + name + "\":{\"dtype\":\"" + type + "\",\"shape\":[" + sides) +
               "],\"data_offsets\":[" + std::to_string(begin) + "," +
               std::to_string(values_.size()) + "]}";
  }

  std::string bytes() const {
    const std::string header = "{\"__metadata__\":{\"format\":\"pt\"}," + header_ + "}  ";
    std::string length(8, '\0');
    for (std::size_t n = 0; n < 8; ++n)
      length[n] = static_cast<char>((std::uint64_t{header.size()} >> (8 * n)) & 255);
    return length + header + values_;
  }

 private:
  std::string header_, values_;
};

inline std::string file_of(const SmallNetwork& net) {
  SafetensorsWriter file;
  file.add("classifier.1.weight", {2, 2}, {1, 2, 3, 4}, "F16");  // of no interest, whatever it is
  for (std::size_t l = 0; l < 5; ++l) {
    const std::string layer = "features." + std::to_string(net.kPlace[l]);
    file.add(layer + ".weight",
             {net.channels[l + 1], net.channels[l], net.kKernel[l], net.kKernel[l]}, net.weight[l]);
    file.add(layer + ".bias", {net.channels[l + 1]}, net.bias[l]);
    file.add("lin" + std::to_string(l) + ".model.1.weight", {1, net.channels[l + 1], 1, 1},
             net.linear[l]);
  }
  return file.bytes();
}

}  // namespace sarnerf::test

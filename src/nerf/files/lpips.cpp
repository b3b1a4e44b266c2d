// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/nerf/lpips.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <ATen/ATen.h>
#include <c10/core/InferenceMode.h>
#include <c10/util/Exception.h>
#include <nlohmann/json.hpp>

#include "sarnerf/core/error.h"
#include "sarnerf/core/files.h"
#include "sarnerf/core/text.h"

namespace sarnerf {

/// A tensor of a file; the last index changes fastest.
struct StoredTensor {
  std::vector<std::int64_t> shape;
  std::vector<float> values;
};

/// The tensors of a safetensors file: eight bytes with the length of a JSON header (little-endian), the header
/// {"name": {"dtype": "F32", "shape": [...], "data_offsets": [begin, end]}, ...} with offsets from its own end, then
/// the values, little-endian. `wanted` are the names to read; other tensors are ignored. Throws InputError, naming file
/// and tensor, if one of them is missing, is not float32 or has values that are not finite; also for damaged files and
/// files beyond 1 GiB. Cost: reading the file once.
std::map<std::string, StoredTensor> read_safetensors(const std::filesystem::path& path,
                                                     const std::vector<std::string>& wanted);

namespace {

using Json = nlohmann::json;

static_assert(std::endian::native == std::endian::little,
              "safetensors files are read as they lie in memory");

constexpr std::uint64_t kLargestFile_bytes = std::uint64_t{1} << 30;
constexpr std::size_t kLength_bytes = 8;

[[noreturn]] void fail(const std::string& where, const std::string& complaint) {
  throw InputError(in_one_line(where + ": " + complaint));
}

/// The header and the bytes after it.
struct Parts {
  Json header;
  std::string_view values;
};

Parts split(std::string_view bytes, const std::string& where) {
  const char* advice = "; expected a safetensors file (docs/guide/lpips.md)";
  if (bytes.size() < kLength_bytes) {
    fail(where, "only " + std::to_string(bytes.size()) + " bytes long" + advice);
  }
  std::uint64_t length = 0;
  std::memcpy(&length, bytes.data(), kLength_bytes);
  const std::string_view rest = bytes.substr(kLength_bytes);
  if (length > rest.size()) {
    fail(where, "its header should be " + std::to_string(length) + " bytes long, but only " +
                    std::to_string(rest.size()) + " follow" + advice);
  }
  const std::string_view text = rest.substr(0, length);
  require_shallow_json(text, where);
  Json header = Json::parse(text, nullptr, false);
  if (!header.is_object()) fail(where, std::string("its header is not a JSON object") + advice);
  return {std::move(header), rest.substr(length)};
}

/// A list of `count` non-negative integers; of any number of them if `count` is 0.
std::vector<std::int64_t> whole_numbers(const Json& entry, const char* key, std::size_t count,
                                        const std::string& where) {
  const auto found = entry.find(key);
  bool good = found != entry.end() && found->is_array() && (count == 0 || found->size() == count);
  std::vector<std::int64_t> numbers;
  if (good) {
    for (const Json& number : *found) {
      good =
          good && number.is_number_unsigned() && number.get<std::uint64_t>() <= kLargestFile_bytes;
      numbers.push_back(good ? number.get<std::int64_t>() : 0);
    }
  }
  if (!good)
    fail(where, std::string("\"") + key + "\" is not a list of whole numbers that fit the file");
  return numbers;
}

StoredTensor read_tensor(const Parts& parts, const std::string& name, const std::string& file) {
  const auto entry = parts.header.find(name);
  if (entry == parts.header.end()) {
    fail(file, "the tensor \"" + name + "\" is missing; convert the weights as docs/guide/lpips.md says");
  }
  const std::string where = file + ": " + name;
  if (!entry->is_object()) fail(where, "its description is not a JSON object");
  const auto type = entry->find("dtype");
  if (type == entry->end() || *type != "F32") {
    fail(where, "expected values of type F32, found " +
                    (type == entry->end() ? std::string("no type")
                                          : in_one_line(type->dump(-1, ' ', true), 60)) +
                    "; save them as float32");
  }
  StoredTensor tensor{whole_numbers(*entry, "shape", 0, where), {}};
  const std::vector<std::int64_t> offsets = whole_numbers(*entry, "data_offsets", 2, where);
  const std::uint64_t begin = static_cast<std::uint64_t>(offsets[0]),
                      end = static_cast<std::uint64_t>(offsets[1]);
  if (begin > end || end > parts.values.size()) {
    fail(where, "its values should lie at bytes " + std::to_string(begin) + " to " +
                    std::to_string(end) + ", but only " + std::to_string(parts.values.size()) +
                    " follow the header; was the file cut?");
  }
  std::uint64_t count = 1;
  for (const std::int64_t side : tensor.shape) {
    count *= static_cast<std::uint64_t>(side);
    // Both factors are at most the largest file's size, so that the product cannot wrap before it is refused.
    if (count > kLargestFile_bytes) break;
  }
  if (count * sizeof(float) != end - begin) {
    fail(where, "its shape does not fit its " + std::to_string(end - begin) + " bytes");
  }
  tensor.values.resize(count);
  if (count > 0) std::memcpy(tensor.values.data(), parts.values.data() + begin, end - begin);
  for (const float value : tensor.values) {
    if (!std::isfinite(value)) fail(where, "holds values that are not finite");
  }
  return tensor;
}

}  // namespace

std::map<std::string, StoredTensor> read_safetensors(const std::filesystem::path& path,
                                                     const std::vector<std::string>& wanted) {
  const std::string file = path.string();
  if (const std::uint64_t size = regular_file_size(path); size > kLargestFile_bytes) {
    fail(file, "expected at most 1 GiB, found " + std::to_string(size) +
                   " bytes; keep only the tensors that docs/guide/lpips.md names");
  }
  const std::string bytes = read_whole_file(path);
  const Parts parts = split(bytes, file);
  std::map<std::string, StoredTensor> tensors;
  for (const std::string& name : wanted) tensors.emplace(name, read_tensor(parts, name, file));
  return tensors;
}

namespace {

/// A convolution of AlexNet: its index in the published list of layers, and the parameters that its weights do not contain.
struct LayerShape {
  int place;
  std::int64_t kernel, stride, padding;
  bool pooled;  ///< whether its input is max-pooled: 3 × 3, stride 2
};

constexpr std::array<LayerShape, 5> kAlexNet{{{0, 11, 4, 2, false},
                                              {3, 5, 1, 2, true},
                                              {6, 3, 1, 1, true},
                                              {8, 3, 1, 1, false},
                                              {10, 3, 1, 1, false}}};

// Means and standard deviations of red, green and blue, in [−1, 1], over the network's training photographs.
constexpr std::array<float, 3> kShift{-0.030f, -0.088f, -0.188f};
constexpr std::array<float, 3> kScale{0.458f, 0.448f, 0.450f};

constexpr double kSmallestNorm = 1e-10;

std::string weight_name(const LayerShape& layer) {
  return "features." + std::to_string(layer.place) + ".weight";
}
std::string bias_name(const LayerShape& layer) {
  return "features." + std::to_string(layer.place) + ".bias";
}
std::string linear_name(std::size_t n) { return "lin" + std::to_string(n) + ".model.1.weight"; }

std::string shape_text(const std::vector<std::int64_t>& shape) {
  std::string text = "[";
  for (const std::int64_t side : shape)
    text += (text.size() > 1 ? ", " : "") + std::to_string(side);
  return text + "]";
}

/// [n_azimuth, n_range], power over peak.
at::Tensor relative(const Image<float>& power, double peak) {
  const at::Tensor image = at::empty({power.n_azimuth(), power.n_range()}, at::kFloat);
  float* out = image.data_ptr<float>();
  for (const float p : power.pixels()) *out++ = static_cast<float>(double(p) / peak);
  return image;
}

at::Tensor of_channels(const std::array<float, 3>& values) {
  return at::tensor(at::ArrayRef<float>(values.data(), values.size())).view({1, 3, 1, 1});
}

void check(const Image<float>& power, const Image<float>& reference, double peak) {
  const auto size = [](const Image<float>& image) {
    return std::to_string(image.n_azimuth()) + " x " + std::to_string(image.n_range());
  };
  if (power.n_azimuth() != reference.n_azimuth() || power.n_range() != reference.n_range()) {
    throw UsageError("LPIPS compares images of one size; the image has " + size(power) +
                     " pixels, the reference " + size(reference));
  }
  if (std::min(power.n_azimuth(), power.n_range()) < Lpips::kSmallestSide_pixels) {
    throw UsageError("LPIPS needs images of at least " +
                     std::to_string(Lpips::kSmallestSide_pixels) +
                     " rows and columns; these have " + size(power) + " pixels");
  }
  if (!(peak > 0.0 && std::isfinite(peak))) {
    throw UsageError("the peak of LPIPS must be positive and finite; it is " +
                     std::to_string(peak));
  }
}

}  // namespace

struct Lpips::Network {
  struct Layer {
    at::Tensor weight;  // [out, in, k, k]
    at::Tensor bias;    // [out]
    at::Tensor linear;  // [1, out, 1, 1]
  };
  std::array<Layer, 5> layers;

  /// Distance of the two images in `images` [2, 3, n_azimuth, n_range].
  double distance(const at::Tensor& images) const {
    at::Tensor features = images;
    double sum = 0.0;
    for (std::size_t n = 0; n < layers.size(); ++n) {
      const LayerShape& shape = kAlexNet[n];
      if (shape.pooled) features = at::max_pool2d(features, {3, 3}, {2, 2});
      features = at::conv2d(features, layers[n].weight, layers[n].bias, shape.stride, shape.padding)
                     .relu();
      const at::Tensor unit = features / (features.square().sum(1, true).sqrt() + kSmallestNorm);
      const at::Tensor difference =
          (unit.select(0, 0) - unit.select(0, 1)).square();  // [out, rows, columns]
      sum += (difference * layers[n].linear.squeeze(0)).sum(0).mean().item<double>();
    }
    return sum;
  }
};

Lpips::Lpips(const std::filesystem::path& weights) {
  std::vector<std::string> names;
  for (std::size_t n = 0; n < kAlexNet.size(); ++n) {
    for (const auto& name : {weight_name(kAlexNet[n]), bias_name(kAlexNet[n]), linear_name(n)})
      names.push_back(name);
  }
  const auto stored = read_safetensors(weights, names);
  const auto tensor = [&](const std::string& name, const std::vector<std::int64_t>& expected) {
    const StoredTensor& found = stored.at(name);
    if (found.shape != expected) {
      throw InputError(weights.string() + ": " + name + ": expected the shape " +
                       shape_text(expected) + ", found " + shape_text(found.shape) +
                       "; only AlexNet's form of LPIPS is read (docs/guide/lpips.md)");
    }
    const at::Tensor copy = at::empty(found.shape, at::kFloat);
    std::copy(found.values.begin(), found.values.end(), copy.data_ptr<float>());
    return copy;
  };

  auto network = std::make_shared<Network>();
  std::int64_t n_in = 3;
  for (std::size_t n = 0; n < kAlexNet.size(); ++n) {
    const LayerShape& shape = kAlexNet[n];
    const std::vector<std::int64_t>& found = stored.at(weight_name(shape)).shape;
    const std::int64_t n_out = found.empty() ? 1 : std::max<std::int64_t>(1, found[0]);
    network->layers[n] = {tensor(weight_name(shape), {n_out, n_in, shape.kernel, shape.kernel}),
                          tensor(bias_name(shape), {n_out}),
                          tensor(linear_name(n), {1, n_out, 1, 1})};
    n_in = n_out;
  }
  network_ = std::move(network);
}

double Lpips::operator()(const Image<float>& power, const Image<float>& reference,
                         double peak) const {
  check(power, reference, peak);
  double distance = 0.0;
  try {
    const c10::InferenceMode no_gradients;
    const at::Tensor grey =
        at::stack({relative(power, peak), relative(reference, peak)}).unsqueeze(1);
    const at::Tensor colours = (2.0 * grey.clamp(0.0, 1.0) - 1.0).expand({2, 3, -1, -1});
    distance = network_->distance((colours - of_channels(kShift)) / of_channels(kScale));
  } catch (const c10::Error& e) {
    throw Error(std::string("LPIPS could not be computed: ") + e.what_without_backtrace());
  }
  if (!std::isfinite(distance)) {
    throw NumericsError(
        "LPIPS is not finite: an image holds values that are not finite, or the weights are too large");
  }
  return distance;
}

}  // namespace sarnerf

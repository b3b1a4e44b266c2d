// SPDX-License-Identifier: Apache-2.0
#include "safetensors.h"

#include <bit>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>
#include <string_view>

#include "sarnerf/core/error.h"
#include "sarnerf/core/input_file.h"
#include "sarnerf/core/input_text.h"

namespace sarnerf {
namespace {

using Json = nlohmann::json;

static_assert(std::endian::native == std::endian::little,
              "safetensors files are read as they lie in memory");

constexpr std::uint64_t kLargestFile_bytes = std::uint64_t{1} << 30;
constexpr std::size_t kLength_bytes = 8;

[[noreturn]] void fail(const std::string& where, const std::string& complaint) {
  throw InputError(in_one_line(where + ": " + complaint));
}

/// The header and what follows it.
struct Parts {
  Json header;
  std::string_view values;
};

Parts split(std::string_view bytes, const std::string& where) {
  const char* advice = "; expected a safetensors file (docs/lpips.md)";
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

/// A list of `count` (any: 0) whole numbers from zero on.
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
    fail(file, "the tensor \"" + name + "\" is missing; convert the weights as docs/lpips.md says");
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
                   " bytes; keep only the tensors that docs/lpips.md names");
  }
  const std::string bytes = read_whole_file(path);
  const Parts parts = split(bytes, file);
  std::map<std::string, StoredTensor> tensors;
  for (const std::string& name : wanted) tensors.emplace(name, read_tensor(parts, name, file));
  return tensors;
}

}  // namespace sarnerf

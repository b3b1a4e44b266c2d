// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/nerf/archive.h"

#include <torch/csrc/jit/serialization/pickle.h>

#include <span>
#include <string_view>

#include "sarnerf/core/atomic_file.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/input_file.h"

namespace sarnerf {
namespace {

constexpr const char* kText = "json";

/// Whether the bytes end as LibTorch ends its files: with a zip archive's last record, 22 bytes without a comment.
/// Its own reader does not always notice when some of them are missing.
bool ends_whole(std::string_view bytes) {
  constexpr std::size_t kLastRecord = 22;
  return bytes.size() >= kLastRecord && bytes.substr(bytes.size() - kLastRecord, 4) == "PK\x05\x06" &&
         bytes.substr(bytes.size() - 2) == std::string_view("\0\0", 2);
}

}  // namespace

const torch::Tensor& Archive::tensor(const std::string& name, torch::ScalarType type, std::int64_t n_dimensions,
                                     const std::string& where) const {
  const auto found = tensors.find(name);
  if (found == tensors.end())
    throw CheckpointError(where + ": has no tensor '" + name + "'; was it written by another version?");
  const torch::Tensor& t = found->second;
  if (t.scalar_type() != type || t.dim() != n_dimensions)
    throw CheckpointError(where + ": tensor '" + name + "' should have " + std::to_string(n_dimensions) +
                          " dimensions of " + c10::toString(type) + ", found " + std::to_string(t.dim()) + " of " +
                          c10::toString(t.scalar_type()));
  return t;
}

void write_archive(const std::filesystem::path& path, const Archive& archive) {
  c10::impl::GenericDict dictionary(c10::StringType::get(), c10::AnyType::get());
  dictionary.insert(kText, archive.json);
  for (const auto& [name, tensor] : archive.tensors) dictionary.insert(name, tensor.detach().contiguous());
  const std::vector<char> bytes = torch::jit::pickle_save(dictionary);
  AtomicFiles files;
  files.add(path, std::as_bytes(std::span(bytes)));
  files.commit();
}

Archive read_archive(const std::filesystem::path& path) {
  std::vector<char> bytes;
  try {
    const std::string content = read_whole_file(path);
    bytes.assign(content.begin(), content.end());
  } catch (const InputError& e) {
    throw CheckpointError(e.what());
  }
  Archive archive;
  try {
    if (!ends_whole({bytes.data(), bytes.size()})) throw std::runtime_error("cut");
    const auto dictionary = torch::jit::pickle_load(bytes).toGenericDict();
    for (const auto& entry : dictionary) {
      const std::string& name = entry.key().toStringRef();
      if (name == kText) {
        archive.json = entry.value().toStringRef();
      } else {
        archive.tensors.emplace(name, entry.value().toTensor());
      }
    }
  } catch (const std::exception&) {
    // LibTorch's own words say where in its code it gave up, in many lines.
    throw CheckpointError(path.string() + ": is not a model or checkpoint, or is truncated or damaged (" +
                          std::to_string(bytes.size()) + " bytes)");
  }
  return archive;
}

}  // namespace sarnerf

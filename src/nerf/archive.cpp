// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/nerf/archive.h"

#include <torch/csrc/jit/serialization/pickle.h>
#include <zip.h>

#include <array>
#include <memory>
#include <span>

#include "sarnerf/core/atomic_file.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/input_file.h"

namespace sarnerf {
namespace {

constexpr const char* kText = "json";

/// Whether the bytes are a zip archive, as LibTorch writes them, whose files all have the CRC-32 that the archive says.
/// LibTorch's own reader skips that check, and does not always notice missing bytes either: a damaged number would be
/// rendered. libzip compares a file's sum when its last byte is read.
bool is_intact(std::span<const char> bytes) {
  zip_error_t error;
  zip_error_init(&error);
  zip_source_t* const source = zip_source_buffer_create(bytes.data(), bytes.size(), 0, &error);
  zip_t* const opened = source != nullptr ? zip_open_from_source(source, ZIP_RDONLY, &error) : nullptr;
  if (opened == nullptr && source != nullptr) zip_source_free(source);  // else the archive owns it
  zip_error_fini(&error);
  const std::unique_ptr<zip_t, decltype(&zip_discard)> archive(opened, zip_discard);
  if (!archive) return false;
  const zip_int64_t n_files = zip_get_num_entries(archive.get(), 0);
  std::array<char, 1 << 16> part;
  for (zip_int64_t n = 0; n < n_files; ++n) {
    const std::unique_ptr<zip_file_t, decltype(&zip_fclose)> file(
        zip_fopen_index(archive.get(), static_cast<zip_uint64_t>(n), 0), zip_fclose);
    if (!file) return false;
    zip_int64_t n_read = 0;
    while ((n_read = zip_fread(file.get(), part.data(), part.size())) > 0) {
    }
    if (n_read < 0) return false;
  }
  return n_files > 0;
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
    if (!is_intact(bytes)) throw std::runtime_error("damaged");
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

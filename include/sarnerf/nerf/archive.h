// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <torch/types.h>

#include <filesystem>
#include <map>
#include <string>

namespace sarnerf {

/// What model and checkpoint files hold: named tensors, and everything else as one JSON object.
struct Archive {
  std::string json = "{}";
  std::map<std::string, torch::Tensor> tensors;

  /// A tensor of this name, type and number of dimensions. Throws CheckpointError, naming `where`, if there is none.
  const torch::Tensor& tensor(const std::string& name, torch::ScalarType type, std::int64_t n_dimensions,
                              const std::string& where) const;
};

/// Writes an archive beside its place and renames it: whoever looks sees the old file or the new one, whole. The
/// format is LibTorch's own pickled dictionary of name to tensor, with the text under "json": LibTorch 1.13 and 2.x
/// read it, and Python's torch.load() does, too. Throws Error when the disk is full.
void write_archive(const std::filesystem::path& path, const Archive& archive);

/// Throws CheckpointError for a file that is missing, truncated, damaged, or something else.
Archive read_archive(const std::filesystem::path& path);

}  // namespace sarnerf

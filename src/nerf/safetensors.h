// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace sarnerf {

/// A tensor of a file; the last index changes fastest.
struct StoredTensor {
  std::vector<std::int64_t> shape;
  std::vector<float> values;
};

/// The tensors of a safetensors file: eight bytes with the length of a JSON header (little-endian), the header
/// {"name": {"dtype": "F32", "shape": [...], "data_offsets": [begin, end]}, ...} with offsets from its own end, then
/// the values, little-endian. `wanted` are the names to read; all must be there as float32 with finite values, and
/// what else the file holds is not looked at. Throws InputError, naming file and tensor, otherwise; also for files
/// beyond 1 GiB. Cost: reading the file once.
std::map<std::string, StoredTensor> read_safetensors(const std::filesystem::path& path,
                                                     const std::vector<std::string>& wanted);

}  // namespace sarnerf

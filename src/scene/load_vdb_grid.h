// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <openvdb/openvdb.h>

#include <cstdint>

#include "sarnerf/core/monitor.h"
#include "vdb_file.h"

namespace sarnerf {

/// Loads grids of a scanned file, within a memory limit.
class VdbGridLoader {
 public:
  /// `max_memory_bytes` for the file's bytes and all grids loaded by this object; 0: unlimited. The file must
  /// outlive it.
  VdbGridLoader(const VdbFile& file, std::uint64_t max_memory_bytes, const Monitor& monitor);

  /// The grid as it is in the file: values, transform, name and class. `GridType`: FloatGrid, Vec3SGrid or
  /// Int32Grid. Throws InputError for a grid of another type or a damaged one; UsageError beyond the limit.
  template <class GridType>
  typename GridType::Ptr load(const VdbFileGrid& grid);

  /// Counts memory that is to be made of a grid; throws UsageError beyond the limit.
  void require_memory(const VdbFileGrid& grid, std::uint64_t more_bytes);

  const VdbFile& file() const { return file_; }
  const Monitor& monitor() const { return monitor_; }

 private:
  openvdb::GridBase::Ptr load_as(const VdbFileGrid& grid, openvdb::GridBase::Ptr empty, int n_components);

  const VdbFile& file_;
  std::uint64_t max_memory_bytes_;
  std::uint64_t used_bytes_;
  const Monitor& monitor_;
};

/// "float", "double", "vector", … for messages, from a tree's type.
std::string vdb_type_words(const std::string& type);

}  // namespace sarnerf

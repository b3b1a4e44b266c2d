// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "load_vdb_grid.h"
#include "vdb_grids.h"
#include "vdb_placement.h"

/// What grids of a file mean, for the two kinds of files: ours and those of other tools.
namespace sarnerf {

/// One file while it is read.
struct VdbReading {
  VdbGridLoader& loader;
  const VdbReadOptions& options;
  std::vector<std::string>& notes;
  Box& scene_box_m;  ///< stays empty where the file does not say

  const VdbFile& file() const { return loader.file(); }
  std::string place(const VdbFileGrid& grid) const;
};

/// The names and the metadata of docs/volumes.md.
std::unique_ptr<VdbScene::Grids> read_own_layout(VdbReading& reading);
/// Whether a file has grids by those names, whoever wrote it.
bool has_own_layout(const VdbFile& file);

/// A fog volume or a level set.
std::unique_ptr<VdbScene::Grids> read_foreign_layout(VdbReading& reading);

/// "extinction (float, fog volume), v (vec3s, unknown)"; "none" when the file has no grid.
std::string listed_grids(const VdbFile& file);

}  // namespace sarnerf

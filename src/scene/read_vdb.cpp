// SPDX-License-Identifier: Apache-2.0
#include "read_vdb.h"

#include <cmath>
#include <string>

#include "readers.h"
#include "sarnerf/core/error.h"
#include "text.h"
#include "vdb_layouts.h"

namespace sarnerf {
namespace {

void check_options(const VdbReadOptions& options) {
  for (const auto& [name, value] : {std::pair("units", options.units_m), std::pair("scale", options.scale)}) {
    if (!(value > 0.0) || !std::isfinite(value)) {
      throw UsageError(std::string("expected ") + name + " above 0, found " + number_text(value));
    }
  }
  for (const auto& [name, value] : {std::pair("extinction of density 1", options.extinction_per_density),
                                    std::pair("albedo", options.albedo)}) {
    if (!(value >= 0.0) || !std::isfinite(value)) {
      throw UsageError(std::string("expected an ") + name + " of at least 0, found " + number_text(value));
    }
  }
}

}  // namespace

std::string VdbReading::place(const VdbFileGrid& grid) const {
  return file().name + ": grid " + in_quotes(grid.name);
}

std::string listed_grids(const VdbFile& file) {
  std::vector<std::string> names;
  for (const VdbFileGrid& grid : file.grids) {
    names.push_back(in_quotes(grid.name) + " (" + vdb_type_words(grid.type) + ", " +
                    in_quotes(grid.grid_class()) + ")");
  }
  return names.empty() ? "none" : listed(names);
}

VdbScene read_vdb(const std::filesystem::path& path, const VdbReadOptions& options) {
  check_options(options);
  return read_vdb_bytes(read_file(path, MemoryBudget(options.max_memory_bytes)), path.string(), options);
}

VdbScene read_vdb_bytes(std::string_view bytes, const std::string& name, const VdbReadOptions& options) {
  check_options(options);
  openvdb::initialize();
  const VdbFile file = scan_vdb_file(bytes, name);
  if (file.grids.empty()) throw InputError(file.name + ": expected a volume, found a file without grids");

  VdbGridLoader loader(file, options.max_memory_bytes, options.monitor);
  std::vector<std::string> notes;
  Box scene_box_m;
  VdbReading reading{loader, options, notes, scene_box_m};
  VdbScene scene(has_own_layout(file) ? read_own_layout(reading) : read_foreign_layout(reading));
  scene.notes = std::move(notes);
  scene.scene_box_m = scene_box_m;
  options.monitor.report("reading", bytes.size(), bytes.size());
  return scene;
}

}  // namespace sarnerf

// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <istream>
#include <mutex>
#include <optional>
#include <streambuf>
#include <string>

#include <openvdb/io/io.h>
#include <openvdb/tree/LeafManager.h>

#include "readers/readers.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/parallel.h"
#include "sarnerf/core/text.h"
#include "sarnerf/scene/scene.h"
#include "vdb/vdb_file.h"
#include "vdb/vdb_layouts.h"

namespace sarnerf {

namespace {

/// A file in memory as a stream buffer. OpenVDB queries positions as it reads.
class MemoryBuffer : public std::streambuf {
 public:
  MemoryBuffer(std::string_view bytes, std::size_t begin) {
    char* data = const_cast<char*>(bytes.data());  // only ever read: nothing is put back
    setg(data, data + begin, data + bytes.size());
  }

 protected:
  pos_type seekoff(off_type offset, std::ios_base::seekdir from, std::ios_base::openmode) override {
    const char* base = from == std::ios_base::beg ? eback() : from == std::ios_base::cur ? gptr() : egptr();
    const off_type at = base - eback() + offset;
    if (at < 0 || at > egptr() - eback()) return pos_type(off_type(-1));
    setg(eback(), eback() + at, egptr());
    return at;
  }
  pos_type seekpos(pos_type position, std::ios_base::openmode mode) override {
    return seekoff(position, std::ios_base::beg, mode);
  }
};

std::string place(const VdbFile& file, const VdbFileGrid& grid) {
  return file.name + ": grid " + in_quotes(grid.name);
}

/// Throws InputError unless the map is linear. Checks its name before OpenVDB allocates memory for its length.
void require_linear_map(const VdbFile& file, const VdbFileGrid& grid) {
  ByteCursor cursor(file.bytes, file.name, grid.transform_begin, grid.end);
  const std::string_view name = cursor.text();
  for (const std::string_view linear :
       {"AffineMap", "ScaleMap", "UniformScaleMap", "TranslationMap", "ScaleTranslateMap",
        "UniformScaleTranslateMap", "UnitaryMap"}) {
    if (name == linear) return;
  }
  throw InputError(place(file, grid) +
                   ": expected a transform of uniform scale and translation, found a perspective or "
                   "unknown one (" + in_quotes(name) + "); resample the grid");
}

template <class GridType>
constexpr int kComponents = 1;
template <>
constexpr int kComponents<openvdb::Vec3SGrid> = 3;

}  // namespace

std::string vdb_type_words(const std::string& type) {
  constexpr std::string_view kPrefix = "Tree_", kSuffix = "_5_4_3";
  if (!type.starts_with(kPrefix) || !type.ends_with(kSuffix) ||
      type.size() <= kPrefix.size() + kSuffix.size()) {
    return in_quotes(type);
  }
  return in_one_line(type.substr(kPrefix.size(), type.size() - kPrefix.size() - kSuffix.size()), 60);
}

VdbGridLoader::VdbGridLoader(const VdbFile& file, std::uint64_t max_memory_bytes, const Monitor& monitor)
    : file_(file), max_memory_bytes_(max_memory_bytes), used_bytes_(file.bytes.size()), monitor_(monitor) {}

void VdbGridLoader::require_memory(const VdbFileGrid& grid, std::uint64_t more_bytes) {
  used_bytes_ += more_bytes;
  if (max_memory_bytes_ == 0 || used_bytes_ <= max_memory_bytes_) return;
  throw UsageError(place(file_, grid) + ": reading up to and with this grid needs about " +
                   human_bytes(used_bytes_) + " of memory, and " +
                   human_bytes(max_memory_bytes_) + " are available (--max-memory); raise it, or resample the volume to larger voxels");
}

openvdb::GridBase::Ptr VdbGridLoader::load_as(const VdbFileGrid& grid, openvdb::GridBase::Ptr empty,
                                              int n_components) {
  monitor_.check();
  monitor_.report("reading", grid.transform_begin, file_.bytes.size());
  if (grid.type != empty->type()) {
    throw InputError(place(file_, grid) + ": expected values of type " + vdb_type_words(empty->type()) +
                     ", found " + vdb_type_words(grid.type) + "; convert the grid");
  }
  require_linear_map(file_, grid);
  try {
    MemoryBuffer buffer(file_.bytes.substr(0, grid.end), grid.transform_begin);
    std::istream stream(&buffer);
    openvdb::io::setVersion(stream, {file_.library_major, file_.library_minor}, file_.format_version);
    openvdb::io::setDataCompression(stream, grid.compression);
    empty->setName(grid.name);
    const std::string grid_class = grid.grid_class();
    empty->setGridClass(openvdb::GridBase::stringToGridClass(grid_class));
    openvdb::io::setGridClass(stream, empty->getGridClass());
    empty->readTransform(stream);
    if (!stream) throw InputError(place(file_, grid) + ": its transform ends too early");
    if (!grid.instance_parent.empty()) return empty;

    const auto topology_begin = static_cast<std::size_t>(stream.tellg());
    require_memory(grid, check_vdb_tree(file_, grid, topology_begin, n_components).memory_bytes);
    empty->setSaveFloatAsHalf(grid.half);
    empty->readTopology(stream);
    empty->readBuffers(stream);
    empty->setSaveFloatAsHalf(false);
    if (!stream || static_cast<std::size_t>(stream.tellg()) != grid.end) {
      throw InputError(place(file_, grid) + ": its values do not end where they should");
    }
  } catch (const openvdb::Exception& failure) {
    throw InputError(place(file_, grid) + ": cannot be read (" + in_one_line(failure.what(), 200) +
                     "); copy or write the file again");
  }
  return empty;
}

template <class GridType>
typename GridType::Ptr VdbGridLoader::load(const VdbFileGrid& grid) {
  const typename GridType::Ptr empty = GridType::create();
  load_as(grid, empty, kComponents<GridType>);
  if (grid.instance_parent.empty()) return empty;
  for (const VdbFileGrid& owner : file_.grids) {
    // Loads a tree of its own, because the grids of a scene may be changed one by one.
    if (owner.unique_name == grid.instance_parent && owner.instance_parent.empty()) {
      empty->setTree(load<GridType>(owner)->treePtr());
      return empty;
    }
  }
  throw InputError(place(file_, grid) + ": shares the values of a grid that the file does not hold");
}

template openvdb::FloatGrid::Ptr VdbGridLoader::load<openvdb::FloatGrid>(const VdbFileGrid&);
template openvdb::Vec3SGrid::Ptr VdbGridLoader::load<openvdb::Vec3SGrid>(const VdbFileGrid&);
template openvdb::Int32Grid::Ptr VdbGridLoader::load<openvdb::Int32Grid>(const VdbFileGrid&);

namespace {

constexpr std::size_t kLeavesPerChunk = 64;

std::string value_text(float value) {
  if (std::isnan(value)) return "NaN";
  if (std::isinf(value)) return value > 0 ? "infinite" : "minus infinity";
  return number_text(double{value});
}
std::string value_text(std::int32_t value) { return std::to_string(value); }
std::string value_text(const openvdb::Vec3s& value) {
  return "(" + value_text(value[0]) + ", " + value_text(value[1]) + ", " + value_text(value[2]) + ")";
}

/// Invalid values of a grid. The first is that with the lowest coordinates, for any order of the threads.
template <class Value>
struct Offences {
  std::uint64_t count = 0;
  openvdb::Coord first;
  Value value{};

  void add(const openvdb::Coord& at, const Value& found, std::uint64_t n = 1) {
    if (count == 0 || at < first) {
      first = at;
      value = found;
    }
    count += n;
  }
  void add(const Offences& other) {
    if (other.count > 0) add(other.first, other.value, other.count);
  }
};

template <class Grid, class Good>
void require_all(const Grid& grid, const std::string& where, const char* expected, const Good& good) {
  using Tree = typename Grid::TreeType;
  Offences<typename Grid::ValueType> offences;
  std::mutex mutex;
  const openvdb::tree::LeafManager<const Tree> leaves(grid.constTree());
  parallel_for(leaves.leafCount(), kLeavesPerChunk, [&](std::size_t begin, std::size_t end, int) {
    Offences<typename Grid::ValueType> found;
    for (std::size_t n = begin; n < end; ++n) {
      for (auto voxel = leaves.leaf(n).cbeginValueOn(); voxel; ++voxel) {
        if (!good(*voxel)) found.add(voxel.getCoord(), *voxel);
      }
    }
    const std::lock_guard lock(mutex);
    offences.add(found);
  });
  auto tile = grid.constTree().cbeginValueOn();
  tile.setMaxDepth(Tree::ValueOnCIter::LEAF_DEPTH - 1);
  for (; tile; ++tile) {
    if (!good(*tile)) offences.add(tile.getBoundingBox().min(), *tile, tile.getVoxelCount());
  }
  if (offences.count == 0) return;
  const openvdb::Coord& at = offences.first;
  throw InputError(where + ": expected " + expected + ", found " +
                   counted(offences.count, "voxel that is", "voxels that are") +
                   " not, the first at index (" + std::to_string(at.x()) + ", " + std::to_string(at.y()) +
                   ", " + std::to_string(at.z()) + "): " + value_text(offences.value) +
                   "; mend the grid where it was made");
}

template <class Grid>
void require_background(const Grid& grid, const std::string& where) {
  if (grid.background() == openvdb::zeroVal<typename Grid::ValueType>()) return;
  throw InputError(where + ": expected 0 outside of the active voxels, found the background value " +
                   value_text(grid.background()) + "; write the grid with background 0");
}

}  // namespace

void require_values(const openvdb::FloatGrid& grid, ValueRule rule, double factor, const std::string& where) {
  require_background(grid, where);
  const auto by = static_cast<float>(factor);
  if (rule == ValueRule::finite) {
    return require_all(grid, where, "finite values", [=](float v) { return std::isfinite(v * by); });
  }
  require_all(grid, where, "finite values of at least 0",
              [=](float v) { return v >= 0.0f && std::isfinite(v * by); });
}

void require_finite_distances(const openvdb::FloatGrid& grid, const std::string& where) {
  require_all(grid, where, "finite distances", [](float v) { return std::isfinite(v); });
}

void require_vectors(const openvdb::Vec3SGrid& grid, const std::string& where) {
  require_background(grid, where);
  require_all(grid, where, "finite vectors", [](const openvdb::Vec3s& v) {
    return std::isfinite(v[0]) && std::isfinite(v[1]) && std::isfinite(v[2]);
  });
}

void require_components(const openvdb::Int32Grid& grid, const std::string& where) {
  require_background(grid, where);
  require_all(grid, where, "components 0 to 4", [](std::int32_t v) {
    return v >= 0 && v <= static_cast<std::int32_t>(Component::other);
  });
}

void multiply_values(openvdb::FloatGrid& grid, double factor) {
  const auto by = static_cast<float>(factor);
  openvdb::tree::LeafManager<openvdb::FloatTree> leaves(grid.tree());
  parallel_for(leaves.leafCount(), kLeavesPerChunk, [&](std::size_t begin, std::size_t end, int) {
    for (std::size_t n = begin; n < end; ++n) {
      for (auto voxel = leaves.leaf(n).beginValueAll(); voxel; ++voxel) voxel.setValue(*voxel * by);
    }
  });
  auto tile = grid.tree().beginValueAll();
  tile.setMaxDepth(openvdb::FloatTree::ValueAllIter::LEAF_DEPTH - 1);
  for (; tile; ++tile) tile.setValue(*tile * by);
  grid.tree().root().setBackground(grid.background() * by, false);
}

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
  VdbReading reading{loader, options, notes, scene_box_m, false};
  VdbScene scene(has_own_layout(file) ? read_own_layout(reading) : read_foreign_layout(reading));
  scene.notes = std::move(notes);
  scene.scene_box_m = scene_box_m;
  scene.is_fog = reading.is_fog;
  options.monitor.report("reading", bytes.size(), bytes.size());
  return scene;
}

}  // namespace sarnerf

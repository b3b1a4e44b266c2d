// SPDX-License-Identifier: Apache-2.0
#include "load_vdb_grid.h"

#include <openvdb/io/io.h>

#include <algorithm>
#include <istream>
#include <streambuf>

#include "byte_cursor.h"
#include "sarnerf/core/error.h"
#include "text.h"

namespace sarnerf {
namespace {

/// A file in memory as a stream buffer; OpenVDB asks for positions as it reads.
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

/// Other maps are not linear. Their names are checked before OpenVDB allocates what a length promises.
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
                   human_bytes(used_bytes_) + " of memory, but --max-memory allows " +
                   human_bytes(max_memory_bytes_) + "; raise it, or resample the volume to larger voxels");
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
    // A tree of its own again: grids of a scene may be changed one by one.
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

}  // namespace sarnerf

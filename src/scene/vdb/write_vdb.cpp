// SPDX-License-Identifier: Apache-2.0
#include <cerrno>
#include <cstring>
#include <fstream>
#include <ios>
#include <span>
#include <string>

#include <openvdb/io/Archive.h>

#include "sarnerf/core/error.h"
#include "sarnerf/core/files.h"
#include "vdb/vdb_grids.h"

namespace sarnerf {

namespace {

/// Offset of a file's identifier: after the magic number, three versions and a flag.
constexpr std::streamoff kIdentifierAt = 8 + 3 * 4 + 1;
constexpr std::size_t kIdentifierBytes = 36;

/// Replaces OpenVDB's File, which opens its file itself and does not check whether the disk accepts the data.
class Archive : public openvdb::io::Archive {
 public:
  void write_to(std::ostream& out, const openvdb::GridCPtrVec& grids, const openvdb::MetaMap& metadata) {
    setCompression(openvdb::io::COMPRESS_ZIP | openvdb::io::COMPRESS_ACTIVE_MASK);
    openvdb::io::Archive::write(out, grids, /*seekable=*/true, metadata);
  }
};

std::string basis_name(SourceBasis basis, int degree) {
  if (basis == SourceBasis::cosine) return "cosine";
  return degree == 0 ? "isotropic" : "sh";
}

openvdb::MetaMap file_metadata(const VdbScene::Grids& grids, const Box& box_m) {
  openvdb::MetaMap metadata(grids.metadata);
  const auto set = [&](const char* name, const openvdb::Metadata& value) {
    metadata.removeMeta(name);
    metadata.insertMeta(name, value);
  };
  set("format", openvdb::StringMetadata("sarnerf-volume"));
  set("version", openvdb::Int32Metadata(1));
  set("units", openvdb::StringMetadata("m"));
  set("up_axis", openvdb::StringMetadata("y"));
  metadata.removeMeta("brightness_basis");
  if (grids.basis != SourceBasis::scattering) {
    set("brightness_basis", openvdb::StringMetadata(basis_name(grids.basis, grids.harmonics_degree)));
  }
  if (!box_m.empty()) {
    set("scene_box_min_m", openvdb::Vec3DMetadata({box_m.min.x, box_m.min.y, box_m.min.z}));
    set("scene_box_max_m", openvdb::Vec3DMetadata({box_m.max.x, box_m.max.y, box_m.max.z}));
  }
  return metadata;
}

/// The same tree under its name in the format, without the grid's other metadata.
openvdb::GridBase::ConstPtr named(const openvdb::GridBase::Ptr& grid, const std::string& name,
                                  openvdb::GridClass grid_class) {
  const openvdb::GridBase::Ptr copy =
      openvdb::ConstPtrCast<openvdb::GridBase>(grid->copyGridReplacingMetadata(openvdb::MetaMap()));
  copy->setName(name);
  if (grid->saveFloatAsHalf()) copy->setSaveFloatAsHalf(true);
  if (grid_class != openvdb::GRID_UNKNOWN) copy->setGridClass(grid_class);
  return copy;
}

openvdb::GridCPtrVec named_grids(const VdbScene::Grids& grids) {
  openvdb::GridCPtrVec named_grids;
  const auto add = [&](const openvdb::GridBase::Ptr& grid, const std::string& name,
                       openvdb::GridClass grid_class = openvdb::GRID_UNKNOWN) {
    if (grid) named_grids.push_back(named(grid, name, grid_class));
  };
  add(grids.extinction, "extinction", openvdb::GRID_FOG_VOLUME);
  add(grids.extinction_back, "extinction_back", openvdb::GRID_FOG_VOLUME);
  add(grids.scattering, "scattering", openvdb::GRID_FOG_VOLUME);
  for (std::size_t n = 0; n < grids.brightness.size(); ++n) {
    add(grids.brightness[n], n == 0 ? "brightness" : "brightness_" + std::to_string(n));
  }
  add(grids.normal, "normal");
  add(grids.exponent, "exponent");
  add(grids.component, "component");
  add(grids.distance, "distance", openvdb::GRID_LEVEL_SET);
  add(grids.unseen, "unseen");
  add(grids.occupancy, "occupancy", openvdb::GRID_FOG_VOLUME);
  return named_grids;
}

/// Replaces OpenVDB's random identifier by a digest of the rest of the file. It still distinguishes files, and the
/// same scene gives the same file.
void set_identifier(std::fstream& file) {
  file.seekp(kIdentifierAt);
  file.write(std::string(kIdentifierBytes, '0').data(), kIdentifierBytes);
  file.seekg(0);
  Sha256 digest;
  std::string block(std::size_t{1} << 20, '\0');
  file.exceptions(std::ios::badbit);  // the end of the file is no failure
  while (file.read(block.data(), static_cast<std::streamsize>(block.size())), file.gcount() > 0) {
    digest.update(std::as_bytes(std::span(block.data(), static_cast<std::size_t>(file.gcount()))));
  }
  file.clear();
  file.exceptions(std::ios::badbit | std::ios::failbit);
  std::string identifier = digest.hex_digest().substr(0, kIdentifierBytes);
  for (const std::size_t dash : {8u, 13u, 18u, 23u}) identifier[dash] = '-';
  identifier[14] = '8';  // RFC 9562, version 8: custom content
  identifier[19] = 'a';
  file.seekp(kIdentifierAt);
  file.write(identifier.data(), kIdentifierBytes);
}

}  // namespace

void write_vdb(const VdbScene& scene, const std::filesystem::path& path) {
  const VdbScene::Grids& grids = scene.grids();
  require_complete(grids);
  AtomicFiles files;
  const std::filesystem::path temporary = files.reserve(path);
  const auto fail = [&](const char* reason) {
    throw Error(path.string() + ": the volume cannot be written (" + reason +
                "); free some space or write elsewhere");
  };
  try {
    errno = 0;
    std::fstream file(temporary, std::ios::binary | std::ios::in | std::ios::out | std::ios::trunc);
    file.exceptions(std::ios::badbit | std::ios::failbit);
    Archive().write_to(file, named_grids(grids), file_metadata(grids, scene.scene_box_m));
    set_identifier(file);
    file.close();
  } catch (const openvdb::Exception& failure) {
    fail(failure.what());
  } catch (const std::ios_base::failure&) {
    fail(errno != 0 ? std::strerror(errno) : "the write failed");
  }
  files.commit();
}

}  // namespace sarnerf

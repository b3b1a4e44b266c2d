// SPDX-License-Identifier: Apache-2.0
#include <openvdb/io/File.h>

#include <string>

#include "sarnerf/core/atomic_file.h"
#include "vdb_grids.h"

namespace sarnerf {
namespace {

std::string basis_name(SourceBasis basis, int degree) {
  if (basis == SourceBasis::cosine) return "cosine";
  return degree == 0 ? "isotropic" : "sh";
}

}  // namespace

void write_vdb(const VdbScene& scene, const std::filesystem::path& path) {
  const VdbScene::Grids& grids = scene.grids();
  openvdb::MetaMap metadata;
  metadata.insertMeta("format", openvdb::StringMetadata("sarnerf-volume"));
  metadata.insertMeta("version", openvdb::Int32Metadata(1));
  metadata.insertMeta("units", openvdb::StringMetadata("m"));
  metadata.insertMeta("up_axis", openvdb::StringMetadata("y"));
  if (grids.basis != SourceBasis::scattering) {
    metadata.insertMeta("brightness_basis",
                        openvdb::StringMetadata(basis_name(grids.basis, grids.harmonics_degree)));
  }
  if (const Box& box = scene.scene_box_m; !box.empty()) {
    metadata.insertMeta("scene_box_min_m", openvdb::Vec3DMetadata({box.min.x, box.min.y, box.min.z}));
    metadata.insertMeta("scene_box_max_m", openvdb::Vec3DMetadata({box.max.x, box.max.y, box.max.z}));
  }
  AtomicFiles files;
  const std::filesystem::path temporary = files.reserve(path);
  try {
    openvdb::io::File file(temporary.string());
    file.setCompression(openvdb::io::COMPRESS_ZIP | openvdb::io::COMPRESS_ACTIVE_MASK);
    const auto all = grids.all();
    file.write(openvdb::GridPtrVec(all.begin(), all.end()), metadata);
    file.close();
  } catch (const openvdb::Exception& failure) {
    throw Error(path.string() + ": the volume cannot be written (" + failure.what() +
                "); free some space or write elsewhere");
  }
  files.commit();
}

}  // namespace sarnerf

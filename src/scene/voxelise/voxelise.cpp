// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <map>
#include <span>
#include <string>
#include <vector>

#include <glm/glm.hpp>

#include "sarnerf/core/error.h"
#include "sarnerf/core/parallel.h"
#include "sarnerf/core/text.h"
#include "sarnerf/field/brick_grid.h"
#include "sarnerf/scene/vdb_scene.h"
#include "vdb/vdb_grids.h"
#include "voxelise/voxel_brick.h"

namespace sarnerf {

namespace {

/// Bricks that surfaces may reach, each with the surfaces that may reach it.
class CandidateBricks {
 public:
  explicit CandidateBricks(const GridTransform& transform) : transform_(transform) {}

  /// Adds all bricks with a voxel within `margin` voxels of a triangle, and some others. Cost: proportional to
  /// the triangle's area over that of a brick's face.
  void add_triangle(const glm::dvec3& a_m, const glm::dvec3& b_m, const glm::dvec3& c_m,
                    double margin, std::uint32_t surface);
  void add(const glm::ivec3& brick, std::uint32_t surface);

  const BrickTopology& bricks() const { return bricks_; }
  const std::vector<std::uint32_t>& surfaces(std::uint32_t brick) const { return surfaces_[brick]; }

 private:
  void add_part(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c, double margin,
                std::uint32_t surface);

  GridTransform transform_;
  BrickTopology bricks_;
  std::vector<std::vector<std::uint32_t>> surfaces_;  ///< per brick
};

void CandidateBricks::add(const glm::ivec3& brick, std::uint32_t surface) {
  const std::uint32_t number = bricks_.insert(brick);
  if (number == surfaces_.size()) surfaces_.emplace_back();
  // Surfaces are added one after another, so a surface that is listed already is the last entry.
  std::vector<std::uint32_t>& known = surfaces_[number];
  if (known.empty() || known.back() != surface) known.push_back(surface);
}

void CandidateBricks::add_triangle(const glm::dvec3& a_m, const glm::dvec3& b_m,
                                   const glm::dvec3& c_m, double margin, std::uint32_t surface) {
  add_part(transform_.index_from_world(a_m), transform_.index_from_world(b_m),
           transform_.index_from_world(c_m), margin, surface);
}

void CandidateBricks::add_part(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c,
                               double margin, std::uint32_t surface) {
  const double ab = glm::length(b - a), bc = glm::length(c - b), ca = glm::length(a - c);
  const double longest = std::max({ab, bc, ca});
  if (longest > kBrickSide) {  // cut in half: boxes of oblique triangles are mostly empty
    const glm::dvec3 p = longest == ab ? a : longest == bc ? b : c;
    const glm::dvec3 q = longest == ab ? b : longest == bc ? c : a;
    const glm::dvec3 r = longest == ab ? c : longest == bc ? a : b;
    const glm::dvec3 middle = 0.5 * (p + q);
    add_part(p, middle, r, margin, surface);
    add_part(middle, q, r, margin, surface);
    return;
  }
  const glm::ivec3 low = brick_of_voxel(glm::ivec3(glm::ceil(glm::min(a, glm::min(b, c)) - margin)));
  const glm::ivec3 high = brick_of_voxel(glm::ivec3(glm::floor(glm::max(a, glm::max(b, c)) + margin)));
  for (int x = low.x; x <= high.x; ++x) {
    for (int y = low.y; y <= high.y; ++y) {
      for (int z = low.z; z <= high.z; ++z) add({x, y, z}, surface);
    }
  }
}

/// Bytes per brick at the peak: the leaves of all grids and the bricks of the volume made from them.
constexpr double kBytesPerBrick = kBrickVoxels * 2.0 * 7.0 * sizeof(float);

/// A leaf of one grid with a brick's values where `active`; null if no voxel is active.
template <class Grid, class ValueOf>
std::unique_ptr<typename Grid::TreeType::LeafNodeType> make_leaf(
    const glm::ivec3& brick, const std::bitset<kBrickVoxels>& active, ValueOf&& value_of) {
  using Leaf = typename Grid::TreeType::LeafNodeType;
  if (active.none()) return nullptr;
  const openvdb::Coord origin(brick.x * kBrickSide, brick.y * kBrickSide, brick.z * kBrickSide);
  auto leaf = std::make_unique<Leaf>(origin, openvdb::zeroVal<typename Grid::ValueType>(), false);
  for (openvdb::Index n = 0; n < kBrickVoxels; ++n) {
    if (active[n]) leaf->setValueOn(n, value_of(n));
  }
  return leaf;
}

/// All leaves of one brick.
struct Leaves {
  using Float = std::unique_ptr<openvdb::FloatTree::LeafNodeType>;
  Float extinction, extinction_back, source, exponent;
  std::unique_ptr<openvdb::Vec3STree::LeafNodeType> normal;
  std::unique_ptr<openvdb::Int32Tree::LeafNodeType> component;
};

template <class Grid>
typename Grid::Ptr make_grid(const char* name, const GridTransform& transform) {
  auto grid = Grid::create(openvdb::zeroVal<typename Grid::ValueType>());
  grid->setName(name);
  grid->setTransform(vdb_transform(transform));
  return grid;
}

/// Properties of a scene's materials that determine which grids it needs.
struct Matter {
  bool opaque = false, media = false, two_extinctions = false;
};

Matter matter_of(const std::vector<VoxelSurface>& surfaces) {
  Matter matter;
  for (const VoxelSurface& surface : surfaces) {
    matter.opaque |= surface.medium == nullptr;
    matter.media |= surface.medium != nullptr;
    matter.two_extinctions |= surface.medium != nullptr && surface.medium->extinction_per_m !=
                                                               surface.medium->extinction_back_per_m;
  }
  return matter;
}

Leaves make_leaves(const glm::ivec3& brick, const VoxelBrick& v, const Matter& matter) {
  Leaves leaves;
  const auto floats = [&](const std::bitset<kBrickVoxels>& active, const auto& values) {
    return make_leaf<openvdb::FloatGrid>(brick, active, [&](openvdb::Index n) { return values[n]; });
  };
  leaves.extinction = floats(v.occupied, v.extinction_per_m);
  if (matter.two_extinctions) leaves.extinction_back = floats(v.occupied, v.extinction_back_per_m);
  if (!matter.opaque) {
    leaves.source = floats(v.occupied, v.scattering_per_m);
    return leaves;
  }
  leaves.source = floats(v.attributes, v.gamma0);
  leaves.exponent = floats(v.attributes, v.exponent);
  leaves.normal = make_leaf<openvdb::Vec3SGrid>(brick, v.attributes, [&](openvdb::Index n) {
    return openvdb::Vec3s(v.normal[n].x, v.normal[n].y, v.normal[n].z);
  });
  leaves.component = make_leaf<openvdb::Int32Grid>(
      brick, v.attributes, [&](openvdb::Index n) { return static_cast<std::int32_t>(v.component[n]); });
  return leaves;
}

/// Bricks wholly inside a medium: they lie between bricks of its surface along z.
std::vector<glm::ivec3> interior_bricks(const CandidateBricks& candidates, std::uint32_t surface,
                                        const BrickVoxeliser& voxeliser) {
  std::map<std::pair<int, int>, std::vector<int>> columns;
  for (std::uint32_t b = 0; b < candidates.bricks().n_bricks(); ++b) {
    const auto& reaching = candidates.surfaces(b);
    if (std::find(reaching.begin(), reaching.end(), surface) == reaching.end()) continue;
    const glm::ivec3& at = candidates.bricks().coordinate(b);
    columns[{at.x, at.y}].push_back(at.z);
  }
  std::vector<glm::ivec3> interior;
  for (auto& [xy, z] : columns) {
    std::sort(z.begin(), z.end());
    for (std::size_t n = 1; n < z.size(); ++n) {
      if (z[n] - z[n - 1] < 2) continue;
      const glm::ivec3 first(xy.first, xy.second, z[n - 1] + 1);
      if (!voxeliser.holds(surface, first * kBrickSide)) continue;
      for (int k = z[n - 1] + 1; k < z[n]; ++k) interior.emplace_back(xy.first, xy.second, k);
    }
  }
  return interior;
}

double surface_area_m2(const Scene& scene) {
  double area = 0.0;
  for (const glm::uvec3& c : scene.mesh.triangles) {
    area += 0.5 * glm::length(glm::cross(scene.mesh.vertices_m[c.y] - scene.mesh.vertices_m[c.x],
                                         scene.mesh.vertices_m[c.z] - scene.mesh.vertices_m[c.x]));
  }
  return area;
}

/// Of the closed translucent solids, whose interiors are filled (divergence theorem; repair has turned their faces outward).
double translucent_volume_m3(const Scene& scene) {
  double volume = 0.0;
  for (std::size_t t = 0; t < scene.mesh.triangles.size(); ++t) {
    if (scene.materials[scene.mesh.material[t]].opaque || !scene.pieces[scene.mesh.piece[t]].closed) continue;
    const glm::uvec3& c = scene.mesh.triangles[t];
    const auto corner = [&](std::uint32_t n) { return scene.mesh.vertices_m[n] - scene.box.min; };
    volume += glm::dot(corner(c.x), glm::cross(corner(c.y), corner(c.z))) / 6.0;
  }
  return std::abs(volume);
}

std::string rounded_text(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g", value);
  return text;
}

void check_lattice(const Scene& scene, double voxel_size_m) {
  if (!(voxel_size_m > 0.0) || !std::isfinite(voxel_size_m)) {
    throw UsageError("expected a voxel size above 0 m, found " + number_text(voxel_size_m));
  }
  const glm::dvec3 size = scene.box.size();
  const double longest = std::max({size.x, size.y, size.z});
  if (longest / voxel_size_m > double(kBrickSide) * kMaxBrick) {
    throw UsageError("voxels of " + number_text(voxel_size_m) + " m are too small for a scene of " +
                     number_text(longest) + " m: expected at most 2^30 along a side; use larger ones");
  }
}

}  // namespace

std::uint64_t expected_voxel_memory_bytes(const Scene& scene, double voxel_size_m) {
  const double side = kBrickSide * voxel_size_m;
  // A plane of an area of n brick faces crosses 1.5 n bricks, and its reach adds as many again.
  const double of_surface = 2.0 * 1.5 * surface_area_m2(scene) / (side * side) + 27.0;
  const double bricks = of_surface + translucent_volume_m3(scene) / (side * side * side);
  return static_cast<std::uint64_t>(std::min(bricks * kBytesPerBrick, 1e18));
}

VdbScene voxelise(const Scene& scene, const VoxeliseOptions& options) {
  check_lattice(scene, options.voxel_size_m);
  const std::uint64_t expected = expected_voxel_memory_bytes(scene, options.voxel_size_m);
  if (options.max_memory_bytes > 0 && expected > options.max_memory_bytes) {
    double fits = options.voxel_size_m;
    while (expected_voxel_memory_bytes(scene, fits) > options.max_memory_bytes && fits < glm::length(scene.box.size())) fits *= 1.05;
    throw UsageError("voxels of " + number_text(options.voxel_size_m) + " m need about " +
                     std::to_string(expected >> 20) + " MiB, more than the " +
                     std::to_string(options.max_memory_bytes >> 20) +
                     " MiB that are available; use --voxel-size " + rounded_text(fits) +
                     " or larger, or raise --max-memory");
  }
  openvdb::initialize();
  const Monitor& monitor = options.monitor;
  const GridTransform transform{scene.box.empty() ? glm::dvec3(0.0) : scene.box.min,
                                options.voxel_size_m};
  std::vector<VoxelSurface> surfaces = make_voxel_surfaces(scene, options.voxel_size_m, monitor);
  const std::vector<Component> component = components_of_triangles(scene);
  const Matter matter = matter_of(surfaces);
  const BrickVoxeliser voxeliser(scene, surfaces, component, transform);

  CandidateBricks candidates(transform);
  for (std::uint32_t s = 0; s < surfaces.size(); ++s) {
    for (const std::uint32_t t : surfaces[s].triangles) {
      monitor.check();  // one triangle may reach a million bricks
      const glm::uvec3& c = scene.mesh.triangles[t];
      candidates.add_triangle(scene.mesh.vertices_m[c.x], scene.mesh.vertices_m[c.y],
                              scene.mesh.vertices_m[c.z], BrickVoxeliser::kReach, s);
    }
  }
  if (matter.media) {
    for (std::uint32_t s = 0; s < surfaces.size(); ++s) {
      if (surfaces[s].medium == nullptr) continue;
      for (const glm::ivec3& brick : interior_bricks(candidates, s, voxeliser)) {
        candidates.add(brick, s);
      }
    }
  }

  const std::size_t n_bricks = candidates.bricks().n_bricks();
  std::vector<Leaves> leaves(n_bricks);
  std::atomic<std::uint64_t> n_done{0};
  parallel_for(n_bricks, 4, [&](std::size_t begin, std::size_t end, int worker) {
    for (std::size_t b = begin; b < end; ++b) {
      monitor.check();
      VoxelBrick voxels;
      const auto number = static_cast<std::uint32_t>(b);
      const glm::ivec3& brick = candidates.bricks().coordinate(number);
      if (voxeliser.fill(brick, candidates.surfaces(number), voxels)) {
        leaves[b] = make_leaves(brick, voxels, matter);
      }
      const std::uint64_t done = ++n_done;
      if (worker == 0) monitor.report("voxelising bricks", done, n_bricks);
    }
  });

  auto grids = std::make_unique<VdbScene::Grids>();
  grids->basis = matter.opaque ? SourceBasis::cosine : SourceBasis::scattering;
  grids->extinction = make_grid<openvdb::FloatGrid>("extinction", transform);
  if (matter.two_extinctions) {
    grids->extinction_back = make_grid<openvdb::FloatGrid>("extinction_back", transform);
  }
  if (matter.opaque) {
    grids->brightness.push_back(make_grid<openvdb::FloatGrid>("brightness", transform));
    grids->normal = make_grid<openvdb::Vec3SGrid>("normal", transform);
    grids->exponent = make_grid<openvdb::FloatGrid>("exponent", transform);
    grids->component = make_grid<openvdb::Int32Grid>("component", transform);
  } else {
    grids->scattering = make_grid<openvdb::FloatGrid>("scattering", transform);
  }
  for (const auto& grid : {grids->extinction, grids->extinction_back, grids->scattering}) {
    if (grid) grid->setGridClass(openvdb::GRID_FOG_VOLUME);
  }
  const auto take = [](auto& grid, auto& leaf) {
    if (grid && leaf) grid->tree().addLeaf(leaf.release());
  };
  for (Leaves& brick : leaves) {
    take(grids->extinction, brick.extinction);
    take(grids->extinction_back, brick.extinction_back);
    take(matter.opaque ? grids->brightness.front() : grids->scattering, brick.source);
    take(grids->normal, brick.normal);
    take(grids->exponent, brick.exponent);
    take(grids->component, brick.component);
  }
  // Leaves with a single value (the interiors of media) become tiles.
  if (matter.media) {
    for (const openvdb::GridBase::Ptr& grid : grids->all()) grid->pruneGrid();
  }
  VdbScene voxels(std::move(grids));
  voxels.scene_box_m = scene.box;
  return voxels;
}

}  // namespace sarnerf

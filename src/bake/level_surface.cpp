// SPDX-License-Identifier: Apache-2.0
#include "level_surface.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <limits>
#include <memory>
#include <numeric>
#include <string>
#include <vector>

#include <openvdb/tools/VolumeToMesh.h>

#include "sarnerf/bake/extract.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/parallel.h"
#include "sarnerf/field/brick_grid.h"

namespace sarnerf {

namespace {

using Leaf = openvdb::FloatTree::LeafNodeType;
static_assert(Leaf::DIM == kBrickSide);

/// Pixels up to this fraction of the peak count as 0: space is carved although an image's zeros were rounded to a small
/// number. The same as for carving before training.
constexpr double kZero = 1e-6;

/// The table of leaves then takes 8 GiB.
constexpr double kMaxVoxelsPerSide = 8192.0;

enum class Evidence { none, maybe, empty };

/// A view, and the range up to which each of its rows is empty. A range R is stored as R² − r², with the aim point's r:
/// that needs no square root, grows with R, and loses no digits for a distant radar.
class MeasuredView {
 public:
  MeasuredView(const PosedImage& image, double zero_level) {
    const Acquisition& a = image.acquisition;
    validate(a);
    const RadarFrame frame = radar_frame(a);
    aim_m_ = a.aim_m;
    row_of_ = frame.h / a.azimuth_spacing_m;
    first_row_ = 0.5 * (a.n_azimuth - 1) + 0.5;  // ½ more, for rounding to the nearest row
    v_ = frame.v;
    k_ = frame.k;
    twice_range_m_ = 2.0 * a.slant_range_m;
    near_m2_ = square_offset_m2(a.bin_offset_m(-0.5));
    far_m2_ = square_offset_m2(a.bin_offset_m(a.n_range - 0.5));
    for (int i = 0; i < a.n_azimuth; ++i) {
      const std::span<const float> row = image.power.row(i);
      const auto first = std::find_if(row.begin(), row.end(), [&](float p) { return double{p} > zero_level; });
      // A row without any return is empty at all ranges.
      first_m2_.push_back(first == row.end() ? std::numeric_limits<double>::infinity()
                                             : square_offset_m2(a.bin_offset_m(double(first - row.begin()) - 0.5)));
    }
  }

  Evidence about(const glm::dvec3& point_m) const {
    const glm::dvec3 d = point_m - aim_m_;
    const double row = glm::dot(row_of_, d) + first_row_;
    if (!(row >= 0.0 && row < static_cast<double>(first_m2_.size()))) return Evidence::none;
    const double along_k = glm::dot(k_, d), along_v = glm::dot(v_, d);
    const double square_m2 = along_k * (twice_range_m_ + along_k) + along_v * along_v;
    if (square_m2 < near_m2_ || square_m2 > far_m2_) return Evidence::none;
    return square_m2 < first_m2_[static_cast<std::size_t>(row)] ? Evidence::empty : Evidence::maybe;
  }

 private:
  double square_offset_m2(double offset_m) const { return offset_m * (twice_range_m_ + offset_m); }

  glm::dvec3 aim_m_{0.0}, row_of_{0.0}, v_{0.0}, k_{0.0};
  double first_row_ = 0.0, twice_range_m_ = 0.0, near_m2_ = 0.0, far_m2_ = 0.0;
  std::vector<double> first_m2_;  ///< [n_azimuth] near edge of the first return
};

std::vector<MeasuredView> measured_views(std::span<const PosedImage> images) {
  float peak = 0.0f;
  for (const PosedImage& image : images)
    for (const float power : image.power.pixels()) peak = std::max(peak, power);
  std::vector<MeasuredView> views;
  for (const PosedImage& image : images) views.emplace_back(image, kZero * double{peak});
  return views;
}

/// Whether some view sees the point, and none shows it to be empty. `last` is the view that showed the last empty point: it
/// is tested first, since neighbours are mostly empty in the same view.
bool is_full(std::span<const MeasuredView> views, const glm::dvec3& point_m, std::size_t& last) {
  if (views[last].about(point_m) == Evidence::empty) return false;
  bool seen = false;
  for (std::size_t v = 0; v < views.size(); ++v) {
    const Evidence evidence = views[v].about(point_m);
    if (evidence == Evidence::empty) {
      last = v;
      return false;
    }
    seen |= evidence == Evidence::maybe;
  }
  return seen;
}

glm::ivec3 n_voxels(const CarvingLattice& lattice) {
  const glm::dvec3 size = lattice.box_m.size();
  if (lattice.box_m.empty() || !(lattice.voxel_size_m > 0.0)) {
    throw UsageError("carving: expected a box and voxels larger than 0, found a box of " + std::to_string(size.x) +
                     " x " + std::to_string(size.y) + " x " + std::to_string(size.z) + " m and voxels of " +
                     std::to_string(lattice.voxel_size_m) + " m");
  }
  // A box of whole voxels must not get another one due to the rounding of its size.
  constexpr double kRounding = 1e-6;
  const glm::dvec3 n = glm::max(glm::ceil(size / lattice.voxel_size_m - kRounding), 1.0);
  if (!(std::max({n.x, n.y, n.z}) <= kMaxVoxelsPerSide)) {
    throw UsageError("carving: expected at most 8192 voxels along a side, found " +
                     std::to_string(std::max({n.x, n.y, n.z})) + "; choose larger voxels");
  }
  return glm::ivec3(n);
}

}  // namespace

openvdb::FloatGrid::Ptr carved_occupancy(std::span<const PosedImage> images, const CarvingLattice& lattice,
                                         std::optional<double> ground_height_m, const Monitor& monitor) {
  const glm::ivec3 n = n_voxels(lattice);
  const glm::dvec3 centre_m = lattice.box_m.min + 0.5 * lattice.voxel_size_m;  // of the first voxel
  const auto grid = openvdb::FloatGrid::create(0.0f);
  const auto transform = openvdb::math::Transform::createLinearTransform(lattice.voxel_size_m);
  transform->postTranslate({centre_m.x, centre_m.y, centre_m.z});
  grid->setTransform(transform);
  grid->setName("occupancy");
  const std::vector<MeasuredView> views = measured_views(images);
  if (views.empty()) return grid;

  const glm::ivec3 n_leaves = (n + kBrickSide - 1) / kBrickSide;
  const auto count = static_cast<std::size_t>(n_leaves.x) * static_cast<std::size_t>(n_leaves.y) *
                     static_cast<std::size_t>(n_leaves.z);
  const auto n_z = static_cast<std::size_t>(n_leaves.z), n_yz = static_cast<std::size_t>(n_leaves.y) * n_z;
  std::vector<std::unique_ptr<Leaf>> leaves(count);
  std::atomic<std::size_t> n_done = 0;
  parallel_for(count, 64, [&](std::size_t begin, std::size_t end, int worker) {
    monitor.check();
    std::size_t last = 0;
    for (std::size_t l = begin; l < end; ++l) {
      const glm::ivec3 origin = kBrickSide * glm::ivec3(l / n_yz, l % n_yz / n_z, l % n_z);
      auto leaf = std::make_unique<Leaf>(openvdb::Coord(origin.x, origin.y, origin.z), 0.0f, false);
      for (int offset = 0; offset < kBrickVoxels; ++offset) {
        const glm::ivec3 voxel = origin + voxel_in_brick(offset);
        if (glm::any(glm::greaterThanEqual(voxel, n))) continue;
        const glm::dvec3 point_m = centre_m + lattice.voxel_size_m * glm::dvec3(voxel);
        if (ground_height_m && point_m.y < *ground_height_m) continue;
        if (is_full(views, point_m, last)) leaf->setValueOn(static_cast<openvdb::Index>(offset), 1.0f);
      }
      if (!leaf->isEmpty()) leaves[l] = std::move(leaf);
    }
    const std::size_t done = n_done += end - begin;
    if (worker == 0) monitor.report("carving", done, count);
  });
  for (std::unique_ptr<Leaf>& leaf : leaves) {
    if (leaf == nullptr) continue;
    if (leaf->isDense()) {
      grid->tree().addTile(1, leaf->origin(), 1.0f, true);
    } else {
      grid->tree().addLeaf(leaf.release());
    }
  }
  return grid;
}

SurfaceMesh carved_solid(std::span<const PosedImage> images, const CarvingLattice& lattice,
                         std::optional<double> ground_height_m, const Monitor& monitor) {
  return level_surface(*carved_occupancy(images, lattice, ground_height_m, monitor));
}

namespace {

/// Positions are integers in units of 1/1024 voxel: they are equal, or differ by far more than double rounds world
/// coordinates, and areas are exact.
constexpr double kPlacesPerVoxel = 1024.0;

using Place = glm::i64vec3;

struct Quads {
  std::vector<Place> places;
  std::vector<openvdb::Vec4I> corners;  ///< clockwise seen from outside
};

/// The tree, with its tiles above the level active: the mesher ignores the sides of inactive ones.
openvdb::FloatTree::ConstPtr with_active_solids(const openvdb::FloatGrid& occupancy, double level) {
  const auto solid_but_inactive = [&](const auto& tile) {
    return tile.isTileValue() && double{tile.getValue()} >= level;
  };
  bool any = false;
  auto tile = occupancy.tree().cbeginValueOff();
  tile.setMaxDepth(openvdb::FloatTree::ValueOffCIter::LEAF_DEPTH - 1);
  for (; tile && !any; ++tile) any = solid_but_inactive(tile);
  if (!any) return occupancy.constTreePtr();

  auto tree = std::make_shared<openvdb::FloatTree>(occupancy.tree());
  auto own = tree->beginValueOff();
  own.setMaxDepth(openvdb::FloatTree::ValueOffIter::LEAF_DEPTH - 1);
  for (; own; ++own)
    if (solid_but_inactive(own)) own.setActiveState(true);
  return tree;
}

/// The mesher's quads, in positions relative to the voxel `origin`, which keeps its float32 coordinates small.
Quads mesh_quads(const openvdb::FloatTree::ConstPtr& tree, const openvdb::Coord& origin, double level) {
  // A grid with its own class and transform. The tree is shared and never written.
  const auto grid = openvdb::FloatGrid::create(openvdb::ConstPtrCast<openvdb::FloatTree>(tree));
  const openvdb::math::Transform::Ptr transform = openvdb::math::Transform::createLinearTransform(1.0);
  transform->postTranslate(-origin.asVec3d());
  grid->setTransform(transform);
  grid->setGridClass(openvdb::GRID_FOG_VOLUME);  // larger is inside

  std::vector<openvdb::Vec3s> points;
  Quads quads;
  openvdb::tools::volumeToMesh(*grid, points, quads.corners, level);
  quads.places.reserve(points.size());
  const auto place = [](float voxels) { return std::llround(kPlacesPerVoxel * double{voxels}); };
  for (const openvdb::Vec3s& p : points) quads.places.emplace_back(place(p.x()), place(p.y()), place(p.z()));
  return quads;
}

/// For each position, the index of the first one that equals it, [n_places]. Merges coinciding vertices.
std::vector<std::uint32_t> first_at_place(const std::vector<Place>& places) {
  const auto before = [&](std::uint32_t a, std::uint32_t b) {
    const Place &p = places[a], &q = places[b];
    return p.x != q.x ? p.x < q.x : p.y != q.y ? p.y < q.y : p.z != q.z ? p.z < q.z : a < b;
  };
  std::vector<std::uint32_t> order(places.size()), first(places.size());
  std::iota(order.begin(), order.end(), 0u);
  std::sort(order.begin(), order.end(), before);
  for (std::size_t n = 0; n < order.size(); ++n)
    first[order[n]] = n > 0 && places[order[n]] == places[order[n - 1]] ? first[order[n - 1]] : order[n];
  return first;
}

/// Four times the squared area, in units of Place.
double squared_area(const Place& a, const Place& b, const Place& c) {
  const glm::dvec3 normal = glm::cross(glm::dvec3(b - a), glm::dvec3(c - a));
  return glm::dot(normal, normal);
}

/// The two triangles of a quad, cut so that the smaller one is as large as possible.
std::array<glm::uvec3, 2> halves(const std::array<std::uint32_t, 4>& q, const std::vector<Place>& places) {
  const std::array<glm::uvec3, 2> along_02 = {{{q[0], q[1], q[2]}, {q[0], q[2], q[3]}}};
  const std::array<glm::uvec3, 2> along_13 = {{{q[0], q[1], q[3]}, {q[1], q[2], q[3]}}};
  const auto smaller = [&](const std::array<glm::uvec3, 2>& cut) {
    const auto area = [&](const glm::uvec3& t) { return squared_area(places[t.x], places[t.y], places[t.z]); };
    return std::min(area(cut[0]), area(cut[1]));
  };
  return smaller(along_02) >= smaller(along_13) ? along_02 : along_13;
}

std::vector<glm::uvec3> triangles_of(const Quads& quads) {
  const std::vector<std::uint32_t> first = first_at_place(quads.places);
  std::vector<glm::uvec3> triangles;
  triangles.reserve(2 * quads.corners.size());
  for (const openvdb::Vec4I& corners : quads.corners) {
    // OpenVDB's are clockwise.
    const std::array<std::uint32_t, 4> q = {first[corners[3]], first[corners[2]], first[corners[1]], first[corners[0]]};
    for (const glm::uvec3& t : halves(q, quads.places))
      if (squared_area(quads.places[t.x], quads.places[t.y], quads.places[t.z]) > 0.0) triangles.push_back(t);
  }
  return triangles;
}

}  // namespace

SurfaceMesh level_surface(const openvdb::FloatGrid& occupancy, double level) {
  SurfaceMesh mesh;
  const openvdb::FloatTree::ConstPtr tree = with_active_solids(occupancy, level);
  openvdb::CoordBBox box;
  if (!tree->evalLeafBoundingBox(box)) return mesh;  // neither leaves nor tiles
  Quads quads;
  try {
    quads = mesh_quads(tree, box.min(), level);
  } catch (const openvdb::ValueError&) {
    throw NumericsError("the surface of an occupancy: expected finite values, found others; the field has diverged");
  } catch (const openvdb::Exception& failure) {
    throw Error(std::string("the surface of an occupancy: OpenVDB failed: ") + failure.what());
  }
  mesh.triangles = triangles_of(quads);

  // Vertices are renumbered in the order in which triangles first use them, as by readers that weld.
  constexpr std::uint32_t kUnused = 0xffffffffu;
  std::vector<std::uint32_t> number(quads.places.size(), kUnused);
  for (glm::uvec3& t : mesh.triangles) {
    for (int n = 0; n < 3; ++n) {
      std::uint32_t& own = number[t[n]];
      if (own == kUnused) {
        own = static_cast<std::uint32_t>(mesh.vertices_m.size());
        const glm::dvec3 place = glm::dvec3(quads.places[t[n]]) / kPlacesPerVoxel;
        const openvdb::Vec3d world =
            occupancy.transform().indexToWorld(box.min().asVec3d() + openvdb::Vec3d(place.x, place.y, place.z));
        mesh.vertices_m.emplace_back(world.x(), world.y(), world.z());
      }
      t[n] = own;
    }
  }
  return mesh;
}

std::vector<std::uint32_t> components_of(const SurfaceMesh& mesh) {
  std::vector<std::uint32_t> parent(mesh.vertices_m.size());
  std::iota(parent.begin(), parent.end(), 0u);
  const auto root = [&](std::uint32_t v) {
    while (parent[v] != v) v = parent[v] = parent[parent[v]];
    return v;
  };
  for (const glm::uvec3& t : mesh.triangles) {
    const std::uint32_t a = root(t.x);
    for (const std::uint32_t other : {t.y, t.z})
      if (const std::uint32_t b = root(other); a != b) parent[std::max(a, b)] = std::min(a, b);
  }
  std::vector<std::uint32_t> number(parent.size() + 1);
  std::uint32_t n = 0;
  for (std::uint32_t v = 0; v < parent.size(); ++v) number[v] = root(v) == v ? n++ : number[root(v)];
  number.back() = n;
  return number;
}

namespace {

constexpr double kFirst = 0.01, kLast = 0.99;  ///< percentiles of area

/// A triangle as a point of its area.
struct Facet {
  glm::dvec3 centre_m;
  double area_m2;
};

/// Between the percentiles of area along `axis`.
double extent_m(std::vector<Facet>& facets, const glm::dvec3& axis) {
  std::sort(facets.begin(), facets.end(), [&](const Facet& a, const Facet& b) { return glm::dot(a.centre_m, axis) < glm::dot(b.centre_m, axis); });
  double all_m2 = 0.0;
  for (const Facet& f : facets) all_m2 += f.area_m2;
  const auto at = [&](double fraction) {
    double sum_m2 = 0.0;
    for (const Facet& f : facets)
      if ((sum_m2 += f.area_m2) >= fraction * all_m2) return glm::dot(f.centre_m, axis);
    return glm::dot(facets.back().centre_m, axis);
  };
  return at(kLast) - at(kFirst);
}

}  // namespace

glm::dvec3 largest_component_m(const SurfaceMesh& mesh) {
  const std::vector<std::uint32_t> component = components_of(mesh);
  std::vector<std::vector<Facet>> facets(component.back());
  std::vector<double> area_m2(component.back(), 0.0);
  for (const glm::uvec3& t : mesh.triangles) {
    const glm::dvec3 &a = mesh.vertices_m[t.x], &b = mesh.vertices_m[t.y], &c = mesh.vertices_m[t.z];
    const Facet facet{(a + b + c) / 3.0, 0.5 * glm::length(glm::cross(b - a, c - a))};
    facets[component[t.x]].push_back(facet);
    area_m2[component[t.x]] += facet.area_m2;
  }
  const auto largest = std::max_element(area_m2.begin(), area_m2.end());
  if (largest == area_m2.end() || !(*largest > 0.0)) return glm::dvec3(0.0);
  std::vector<Facet>& of = facets[static_cast<std::size_t>(largest - area_m2.begin())];
  glm::dvec3 mean_m(0.0);
  for (const Facet& f : of) mean_m += f.centre_m * (f.area_m2 / *largest);
  double xx = 0.0, zz = 0.0, xz = 0.0;
  for (Facet& f : of) {
    f.centre_m -= mean_m;
    xx += f.area_m2 * f.centre_m.x * f.centre_m.x;
    zz += f.area_m2 * f.centre_m.z * f.centre_m.z;
    xz += f.area_m2 * f.centre_m.x * f.centre_m.z;
  }
  const double angle_rad = 0.5 * std::atan2(2.0 * xz, xx - zz);
  const glm::dvec3 along(std::cos(angle_rad), 0.0, std::sin(angle_rad)), across(-along.z, 0.0, along.x);
  return {extent_m(of, along), extent_m(of, across), extent_m(of, glm::dvec3(0.0, 1.0, 0.0))};
}

}  // namespace sarnerf

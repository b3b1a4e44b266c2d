// SPDX-License-Identifier: Apache-2.0
#include "enclosed.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "line_crossings.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/parallel.h"

namespace sarnerf {
namespace {

constexpr double kMostCells = 1u << 30;

/// In cells, per axis. Off the lattice by as little as no volume notices, centres do not lie on walls and roofs that
/// were drawn on round numbers: which side of a slope a centre on it belongs to depends on the axis along which one
/// looks, and air would get in.
constexpr glm::dvec3 kOffset{0.00271828, 0.00141421, 0.00314159};

/// In cells. A centre that lies closer to the surface all the same is walled in on both sides.
constexpr double kNear = 1e-6;

/// A cell's bits: whether air is there, and walls towards the next cell along each axis.
constexpr std::uint8_t kAir = 1, kWallX = 2, kWallY = 4, kWallZ = 8;

SurfaceMesh permuted(const SurfaceMesh& mesh, int x, int y, int z) {
  SurfaceMesh result = mesh;
  for (glm::dvec3& v : result.vertices_m) v = glm::dvec3(v[x], v[y], v[z]);
  return result;
}

/// Cubic cells about a box, with a layer of air on every side but below.
class Cells {
 public:
  Cells(const Box& box_m, const ColumnLattice& inner, const Monitor& monitor)
      : spacing_m_(inner.spacing_m),
        bottom_m_(box_m.min.y),
        corner_m_(glm::dvec3(inner.x_m - spacing_m_, bottom_m_, inner.z_m - spacing_m_) + spacing_m_ * kOffset),
        n_x_(inner.n_x + 2),
        n_z_(inner.n_z + 2),
        monitor_(monitor) {
    const double layers = std::ceil(box_m.size().y / spacing_m_) + 1.0;
    const double cells = layers * n_x_ * n_z_;
    if (!(cells <= kMostCells)) {
      throw UsageError("filling the truth at a spacing of " + std::to_string(spacing_m_) + " m takes " +
                       std::to_string(cells) + " cells, at most " + std::to_string(kMostCells) +
                       " are allowed: raise the spacing of the columns");
    }
    n_y_ = static_cast<std::uint32_t>(layers);
    bits_.assign(std::size_t{n_x_} * n_y_ * n_z_, 0);
  }

  void raise_walls(const SurfaceMesh& mesh) {
    // Whatever the axis, rows are far apart in memory and each belongs to one thread.
    walls(permuted(mesh, 1, 0, 2), {corner_m_.y, corner_m_.z, spacing_m_, n_y_, n_z_}, corner_m_.x, n_x_, kWallX,
          [this](std::uint32_t j, std::uint32_t i, std::uint32_t k) { return index(i, j, k); });
    walls(mesh, columns(), corner_m_.y, n_y_, kWallY,
          [this](std::uint32_t i, std::uint32_t j, std::uint32_t k) { return index(i, j, k); });
    walls(permuted(mesh, 0, 2, 1), {corner_m_.x, corner_m_.y, spacing_m_, n_x_, n_y_}, corner_m_.z, n_z_, kWallZ,
          [this](std::uint32_t i, std::uint32_t k, std::uint32_t j) { return index(i, j, k); });
  }

  void let_air_in() {
    for (std::uint32_t k = 0; k < n_z_; ++k) {
      for (std::uint32_t j = 0; j < n_y_; ++j) {
        const bool all = k == 0 || k + 1 == n_z_ || j + 1 == n_y_;
        for (std::uint32_t i = 0; i < n_x_; i += all ? 1 : n_x_ - 1) reach(index(i, j, k));
      }
    }
    const std::size_t layer = std::size_t{n_x_} * n_y_;
    for (std::size_t n_steps = 0; !front_.empty(); ++n_steps) {
      if (n_steps % (1u << 20) == 0) monitor_.check();
      const std::size_t at = front_.back();
      front_.pop_back();
      const auto i = static_cast<std::uint32_t>(at % n_x_), j = static_cast<std::uint32_t>(at / n_x_ % n_y_);
      const std::size_t k = at / layer;
      pass(i > 0, at, 1, kWallX, false);
      pass(i + 1 < n_x_, at, 1, kWallX, true);
      pass(j > 0, at, n_x_, kWallY, false);
      pass(j + 1 < n_y_, at, n_x_, kWallY, true);
      pass(k > 0, at, layer, kWallZ, false);
      pass(k + 1 < n_z_, at, layer, kWallZ, true);
    }
  }

  bool air(std::uint32_t i, std::uint32_t j, std::uint32_t k) const { return bits_[index(i, j, k)] & kAir; }
  double centre_y_m(std::uint32_t j) const { return corner_m_.y + (j + 0.5) * spacing_m_; }
  double bottom_m() const { return bottom_m_; }
  double near_m() const { return kNear * spacing_m_; }
  std::uint32_t n_y() const { return n_y_; }
  ColumnLattice columns() const { return {corner_m_.x, corner_m_.z, spacing_m_, n_x_, n_z_}; }

 private:
  std::size_t index(std::uint32_t i, std::uint32_t j, std::uint32_t k) const {
    return (std::size_t{k} * n_y_ + j) * n_x_ + i;
  }

  /// Marks walls between the n cells along each line of a lattice.
  template <class Index>
  void walls(const SurfaceMesh& mesh, const ColumnLattice& lines, double corner_m, std::uint32_t n, std::uint8_t wall,
             const Index& index_of) {
    const LineCrossings crossings_of(mesh, lines);
    parallel_for(lines.n_z, 4, [&](std::size_t begin, std::size_t end, int /*worker*/) {
      std::vector<LineCrossing> crossings;
      for (std::size_t row = begin; row < end; ++row) {
        monitor_.check();
        const auto k = static_cast<std::uint32_t>(row);
        crossings_of.collect(k, crossings);
        for (const LineCrossing& crossing : crossings) {
            // Between the last centre before it and the first behind it, and beyond one that is as good as on it.
          const std::uint32_t first = first_line(crossing.y_m - near_m(), corner_m, spacing_m_, n);
          const std::uint32_t last = first_line(crossing.y_m + near_m(), corner_m, spacing_m_, n);
          for (std::uint32_t j = std::max(first, 1u); j <= last; ++j) {
            bits_[index_of(crossing.i, j - 1, k)] |= wall;
          }
        }
      }
    });
  }

  void reach(std::size_t at) {
    if (bits_[at] & kAir) return;
    bits_[at] |= kAir;
    front_.push_back(at);
  }

  void pass(bool inside, std::size_t at, std::size_t step, std::uint8_t wall, bool onward) {
    if (!inside) return;
    const std::size_t to = onward ? at + step : at - step;
    if (!(bits_[std::min(at, to)] & wall)) reach(to);
  }

  double spacing_m_;
  double bottom_m_;
  glm::dvec3 corner_m_;
  std::uint32_t n_x_, n_y_ = 0, n_z_;
  const Monitor& monitor_;
  std::vector<std::uint8_t> bits_;  ///< [n_z, n_y, n_x]
  std::vector<std::size_t> front_;  ///< air whose neighbours were not looked at
};

/// Runs of cells without air in one column, ended by the outermost crossings between them and the air.
void fill(const Cells& cells, std::uint32_t i, std::uint32_t k, std::span<const LineCrossing> crossings,
          std::vector<Columns::Interval>& intervals) {
  for (std::uint32_t j = 0; j < cells.n_y(); ++j) {
    if (cells.air(i, j, k)) continue;
    const std::uint32_t first = j;
    while (!cells.air(i, j + 1, k)) ++j;  // the topmost layer is air
    const double below_m = first > 0 ? cells.centre_y_m(first - 1) - cells.near_m() : cells.bottom_m();
    const double above_m = cells.centre_y_m(j + 1) + cells.near_m();
    // Between a cell with air and one without there is a crossing; below the lowest cell, perhaps only the ground.
    double bottom_m = cells.centre_y_m(first), top_m = cells.centre_y_m(j);
    bool on_ground = first == 0;
    for (const LineCrossing& crossing : crossings) {
      if (crossing.y_m >= below_m && crossing.y_m <= bottom_m) {
        bottom_m = crossing.y_m;
        on_ground = false;
      }
      if (crossing.y_m >= top_m && crossing.y_m <= above_m) top_m = crossing.y_m;
    }
    if (on_ground) bottom_m = cells.bottom_m();
    if (top_m > bottom_m) intervals.push_back({i - 1, bottom_m, top_m});
  }
}

}  // namespace

Columns enclosed_columns(const SurfaceMesh& mesh, const Box& box_m, const ColumnLattice& lattice,
                         const Monitor& monitor) {
  Columns columns;
  columns.lattice = lattice;
  columns.row_begin.assign(lattice.n_z + std::size_t{1}, 0);
  if (mesh.triangles.empty()) return columns;

  Cells cells(box_m, lattice, monitor);
  cells.raise_walls(mesh);
  cells.let_air_in();

  const ColumnLattice padded = cells.columns();
  const LineCrossings crossings_of(mesh, padded);
  std::vector<LineCrossing> crossings;
  for (std::uint32_t k = 1; k <= lattice.n_z; ++k) {
    monitor.check();
    crossings_of.collect(k, crossings);
    auto next = crossings.begin();
    for (std::uint32_t i = 1; i <= lattice.n_x; ++i) {
      const auto begin = std::find_if(next, crossings.end(), [i](const LineCrossing& c) { return c.i >= i; });
      next = std::find_if(begin, crossings.end(), [i](const LineCrossing& c) { return c.i > i; });
      fill(cells, i, k, {begin, next}, columns.intervals);
    }
    columns.row_begin[k] = columns.intervals.size();
  }
  return columns;
}

}  // namespace sarnerf

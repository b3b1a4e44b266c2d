// SPDX-License-Identifier: Apache-2.0
#include "columns.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include <glm/glm.hpp>

#include "sarnerf/core/error.h"
#include "sarnerf/core/parallel.h"

namespace sarnerf {

namespace {

constexpr double kDefaultCells = 512.0;
constexpr double kMostCells = 8192.0;

}  // namespace

ColumnLattice column_lattice(const Box& box, double spacing_m) {
  if (!(std::isfinite(spacing_m) && spacing_m >= 0.0)) {
    throw UsageError("the spacing of the columns must be a positive length in metres, or 0 to choose one; it is " +
                     std::to_string(spacing_m));
  }
  if (box.empty()) return {};
  const double longest_m = std::max(box.size().x, box.size().z);
  if (spacing_m == 0.0) spacing_m = longest_m > 0.0 ? longest_m / kDefaultCells : 1.0;
  const double most = longest_m / spacing_m;
  if (!(most <= kMostCells)) {
    throw UsageError("columns of " + std::to_string(spacing_m) + " m over " + std::to_string(longest_m) +
                     " m are too many: at most 8192 a side, so at least " +
                     std::to_string(longest_m / kMostCells) + " m");
  }
  // Without the tolerance, 512.0000001 cells would become 513.
  const auto count = [&](double side_m) {
    return static_cast<std::uint32_t>(std::max(1.0, std::ceil(side_m / spacing_m - 1e-6)));
  };
  return {box.min.x, box.min.z, spacing_m, count(box.size().x), count(box.size().z)};
}

std::uint32_t first_line(double coordinate_m, double corner_m, double spacing_m, std::uint32_t n) {
  const double line = std::ceil((coordinate_m - corner_m) / spacing_m - 0.5);
  return static_cast<std::uint32_t>(std::clamp(line, 0.0, static_cast<double>(n)));
}

namespace {

/// Where one row of lines enters or leaves a triangle's projection.
struct EdgeCrossing {
  double x_m;
  double y_m;
};

/// Where an edge crosses the row at z_m. Always from the end of lower z, so that both its triangles get the same result.
EdgeCrossing edge_crossing(const glm::dvec3& low, const glm::dvec3& high, double z_m) {
  const double part = std::clamp((z_m - low.z) / (high.z - low.z), 0.0, 1.0);
  return {low.x + part * (high.x - low.x), low.y + part * (high.y - low.y)};
}

}  // namespace

LineCrossings::LineCrossings(const SurfaceMesh& mesh, const ColumnLattice& lattice) : mesh_(mesh), lattice_(lattice) {
  row_of_vertex_.reserve(mesh.vertices_m.size());
  for (const glm::dvec3& v : mesh.vertices_m) {
    row_of_vertex_.push_back(first_line(v.z, lattice.z_m, lattice.spacing_m, lattice.n_z));
  }
  sort_into_rows();
}

void LineCrossings::collect(std::uint32_t k, std::vector<LineCrossing>& crossings) const {
  crossings.clear();
  for (std::size_t n = begin_[k]; n < begin_[k + 1]; ++n) add(k, mesh_.triangles[triangles_[n]], crossings);
  std::sort(crossings.begin(), crossings.end(), [](const LineCrossing& a, const LineCrossing& b) {
    if (a.i != b.i) return a.i < b.i;
    if (a.y_m != b.y_m) return a.y_m < b.y_m;
    return a.turn > b.turn;  // entries first: touching solids become one
  });
}

void LineCrossings::sort_into_rows() {
  begin_.assign(lattice_.n_z + std::size_t{1}, 0);
  const auto rows_of = [&](const glm::uvec3& t) {
    return std::minmax({row_of_vertex_[t.x], row_of_vertex_[t.y], row_of_vertex_[t.z]});
  };
  for (const glm::uvec3& t : mesh_.triangles) {
    const auto [first, end] = rows_of(t);
    for (std::uint32_t k = first; k < end; ++k) ++begin_[k + 1];
  }
  for (std::size_t k = 0; k < lattice_.n_z; ++k) begin_[k + 1] += begin_[k];
  triangles_.resize(begin_.back());
  std::vector<std::size_t> next(begin_.begin(), begin_.end() - 1);
  for (std::uint32_t n = 0; n < mesh_.triangles.size(); ++n) {
    const auto [first, end] = rows_of(mesh_.triangles[n]);
    for (std::uint32_t k = first; k < end; ++k) triangles_[next[k]++] = n;
  }
}

/// A row crosses no edge of a triangle, or two: one that goes up in z and one that goes down.
void LineCrossings::add(std::uint32_t k, const glm::uvec3& triangle, std::vector<LineCrossing>& crossings) const {
  const double z_m = lattice_.z_m + (k + 0.5) * lattice_.spacing_m;
  EdgeCrossing up{}, down{};
  for (int corner = 0; corner < 3; ++corner) {
    const std::uint32_t a = triangle[corner], b = triangle[(corner + 1) % 3];
    const bool a_passed = row_of_vertex_[a] <= k, b_passed = row_of_vertex_[b] <= k;
    if (a_passed == b_passed) continue;
    const EdgeCrossing at = edge_crossing(mesh_.vertices_m[a_passed ? a : b], mesh_.vertices_m[a_passed ? b : a], z_m);
    (a_passed ? up : down) = at;
  }
  const std::uint32_t i_up = first_line(up.x_m, lattice_.x_m, lattice_.spacing_m, lattice_.n_x);
  const std::uint32_t i_down = first_line(down.x_m, lattice_.x_m, lattice_.spacing_m, lattice_.n_x);
  // If the edge that goes up in z is at the smaller x, the triangle faces up: a line going up leaves the solid there.
  const int turn = i_up < i_down ? -1 : 1;
  const double width_m = down.x_m - up.x_m;
  for (std::uint32_t i = std::min(i_up, i_down); i < std::max(i_up, i_down); ++i) {
    const double x_m = lattice_.x_m + (i + 0.5) * lattice_.spacing_m;
    const double part = width_m != 0.0 ? std::clamp((x_m - up.x_m) / width_m, 0.0, 1.0) : 0.5;
    crossings.push_back({i, turn, up.y_m + part * (down.y_m - up.y_m)});
  }
}

namespace {

/// Intervals and counts of one row.
struct Row {
  std::vector<Columns::Interval> intervals;
  std::uint64_t n_met = 0;
  std::uint64_t n_open = 0;
};

void wind(std::span<const LineCrossing> crossings, Row& row) {
  for (std::size_t n = 0; n < crossings.size();) {
    const std::uint32_t i = crossings[n].i;
    int winding = 0;
    double bottom_m = 0.0;
    for (; n < crossings.size() && crossings[n].i == i; ++n) {
      const int before = winding;
      winding += crossings[n].turn;
      if (before <= 0 && winding > 0) bottom_m = crossings[n].y_m;
      if (before > 0 && winding <= 0 && crossings[n].y_m > bottom_m) {
        row.intervals.push_back({i, bottom_m, crossings[n].y_m});
      }
    }
    ++row.n_met;
    if (winding != 0) ++row.n_open;
  }
}

}  // namespace

Columns columns_of(const SurfaceMesh& mesh, const ColumnLattice& lattice, const Monitor& monitor) {
  const LineCrossings crossings_of(mesh, lattice);
  std::vector<Row> rows(lattice.n_z);
  parallel_for(rows.size(), 4, [&](std::size_t begin, std::size_t end, int /*worker*/) {
    std::vector<LineCrossing> crossings;
    for (std::size_t k = begin; k < end; ++k) {
      monitor.check();
      crossings_of.collect(static_cast<std::uint32_t>(k), crossings);
      wind(crossings, rows[k]);
    }
  });

  Columns columns;
  columns.lattice = lattice;
  columns.row_begin.reserve(rows.size() + 1);
  columns.row_begin.push_back(0);
  for (const Row& row : rows) {
    columns.intervals.insert(columns.intervals.end(), row.intervals.begin(), row.intervals.end());
    columns.row_begin.push_back(columns.intervals.size());
    columns.n_met += row.n_met;
    columns.n_open += row.n_open;
  }
  return columns;
}

double Columns::volume_m3() const {
  double length_m = 0.0;
  for (const Interval& interval : intervals) length_m += interval.top_m - interval.bottom_m;
  return length_m * lattice.spacing_m * lattice.spacing_m;
}

double common_volume_m3(const Columns& a, const Columns& b) {
  double length_m = 0.0;
  for (std::size_t k = 0; k < a.lattice.n_z; ++k) {
    std::size_t n = a.row_begin[k], m = b.row_begin[k];
    while (n < a.row_begin[k + 1] && m < b.row_begin[k + 1]) {
      const Columns::Interval &p = a.intervals[n], &q = b.intervals[m];
      if (p.i == q.i) length_m += std::max(0.0, std::min(p.top_m, q.top_m) - std::max(p.bottom_m, q.bottom_m));
      // The interval that ends first has no further intersections.
      const bool p_first = p.i != q.i ? p.i < q.i : p.top_m <= q.top_m;
      ++(p_first ? n : m);
    }
  }
  return length_m * a.lattice.spacing_m * a.lattice.spacing_m;
}

namespace {

constexpr double kMostEnclosedCells = 1u << 30;

/// Offset of the cells' centres in cells, per axis: too small to affect volumes. It keeps centres off walls and roofs that
/// were drawn on round numbers. Air would get in at centres on a slope, whose side depends on the axis along which it
/// is tested.
constexpr glm::dvec3 kOffset{0.00271828, 0.00141421, 0.00314159};

/// In cells. A centre that is still closer to the surface than this gets walls on both sides.
constexpr double kNear = 1e-6;

/// A cell's bits: whether air is there, and walls towards the next cell along each axis.
constexpr std::uint8_t kAir = 1, kWallX = 2, kWallY = 4, kWallZ = 8;

SurfaceMesh permuted(const SurfaceMesh& mesh, int x, int y, int z) {
  SurfaceMesh result = mesh;
  for (glm::dvec3& v : result.vertices_m) v = glm::dvec3(v[x], v[y], v[z]);
  return result;
}

/// Cubic cells around a box, with a layer of air on every side but below.
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
    if (!(cells <= kMostEnclosedCells)) {
      throw UsageError("filling the truth at a spacing of " + std::to_string(spacing_m_) + " m takes " +
                       std::to_string(cells) + " cells, at most " + std::to_string(kMostEnclosedCells) +
                       " are allowed: raise the spacing of the columns");
    }
    n_y_ = static_cast<std::uint32_t>(layers);
    bits_.assign(std::size_t{n_x_} * n_y_ * n_z_, 0);
  }

  void raise_walls(const SurfaceMesh& mesh) {
    // For each axis, rows are far apart in memory, and each is written by one thread.
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
          // From the last centre before the crossing to the first one behind it, and past a centre within near_m().
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
  std::vector<std::size_t> front_;  ///< cells with air whose neighbours are not yet visited
};

/// Appends the runs of cells without air in one column, ended by the outermost crossings between them and the air.
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

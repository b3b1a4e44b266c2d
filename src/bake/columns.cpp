// SPDX-License-Identifier: Apache-2.0
#include "columns.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <string>

#include "sarnerf/core/error.h"
#include "sarnerf/core/parallel.h"

namespace sarnerf {
namespace {

constexpr double kDefaultCells = 512.0;
constexpr double kMostCells = 8192.0;

/// Where one row of lines enters or leaves a triangle's projection.
struct Border {
  double x_m;
  double y_m;
};

struct Crossing {
  std::uint32_t i;
  int turn;  ///< change of the winding number on the way up
  double y_m;
};

/// The first of n lines at or beyond a coordinate, n when there is none. Monotonic in the coordinate and a function
/// of it alone: all that must agree between neighbouring triangles goes through here.
std::uint32_t first_line(double coordinate_m, double corner_m, double spacing_m, std::uint32_t n) {
  const double line = std::ceil((coordinate_m - corner_m) / spacing_m - 0.5);
  return static_cast<std::uint32_t>(std::clamp(line, 0.0, static_cast<double>(n)));
}

/// Crossings of one mesh with the lattice's lines, row by row.
class RowCrossings {
 public:
  RowCrossings(const SurfaceMesh& mesh, const ColumnLattice& lattice) : mesh_(mesh), lattice_(lattice) {
    row_of_vertex_.reserve(mesh.vertices_m.size());
    for (const glm::dvec3& v : mesh.vertices_m) {
      row_of_vertex_.push_back(first_line(v.z, lattice.z_m, lattice.spacing_m, lattice.n_z));
    }
    sort_into_rows();
  }

  /// Crossings of row k by column, then by height.
  void collect(std::uint32_t k, std::vector<Crossing>& crossings) const {
    crossings.clear();
    for (std::size_t n = begin_[k]; n < begin_[k + 1]; ++n) add(k, mesh_.triangles[triangles_[n]], crossings);
    std::sort(crossings.begin(), crossings.end(), [](const Crossing& a, const Crossing& b) {
      if (a.i != b.i) return a.i < b.i;
      if (a.y_m != b.y_m) return a.y_m < b.y_m;
      return a.turn > b.turn;  // solids that touch are one
    });
  }

 private:
  void sort_into_rows() {
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

  /// Where an edge crosses row k. Always from the end of lower z, so that both its triangles get the same.
  Border border(const glm::dvec3& low, const glm::dvec3& high, double z_m) const {
    const double part = std::clamp((z_m - low.z) / (high.z - low.z), 0.0, 1.0);
    return {low.x + part * (high.x - low.x), low.y + part * (high.y - low.y)};
  }

  /// Of a triangle's edges a row crosses none, or one up and one down in z.
  void add(std::uint32_t k, const glm::uvec3& triangle, std::vector<Crossing>& crossings) const {
    const double z_m = lattice_.z_m + (k + 0.5) * lattice_.spacing_m;
    Border up{}, down{};
    for (int corner = 0; corner < 3; ++corner) {
      const std::uint32_t a = triangle[corner], b = triangle[(corner + 1) % 3];
      const bool a_passed = row_of_vertex_[a] <= k, b_passed = row_of_vertex_[b] <= k;
      if (a_passed == b_passed) continue;
      const Border at = border(mesh_.vertices_m[a_passed ? a : b], mesh_.vertices_m[a_passed ? b : a], z_m);
      (a_passed ? up : down) = at;
    }
    const std::uint32_t i_up = first_line(up.x_m, lattice_.x_m, lattice_.spacing_m, lattice_.n_x);
    const std::uint32_t i_down = first_line(down.x_m, lattice_.x_m, lattice_.spacing_m, lattice_.n_x);
    // A triangle seen from above goes up at its smaller x: there a line on its way up leaves the solid.
    const int turn = i_up < i_down ? -1 : 1;
    const double width_m = down.x_m - up.x_m;
    for (std::uint32_t i = std::min(i_up, i_down); i < std::max(i_up, i_down); ++i) {
      const double x_m = lattice_.x_m + (i + 0.5) * lattice_.spacing_m;
      const double part = width_m != 0.0 ? std::clamp((x_m - up.x_m) / width_m, 0.0, 1.0) : 0.5;
      crossings.push_back({i, turn, up.y_m + part * (down.y_m - up.y_m)});
    }
  }

  const SurfaceMesh& mesh_;
  const ColumnLattice& lattice_;
  std::vector<std::uint32_t> row_of_vertex_;  ///< the first row that lies at or beyond the vertex
  std::vector<std::size_t> begin_;            ///< [n_z + 1], into triangles_
  std::vector<std::uint32_t> triangles_;      ///< by row
};

/// Intervals and counts of one row.
struct Row {
  std::vector<Columns::Interval> intervals;
  std::uint64_t n_met = 0;
  std::uint64_t n_open = 0;
};

void wind(std::span<const Crossing> crossings, Row& row) {
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
  // Without the tolerance, 512.0000001 cells would be 513 of them.
  const auto count = [&](double side_m) {
    return static_cast<std::uint32_t>(std::max(1.0, std::ceil(side_m / spacing_m - 1e-6)));
  };
  return {box.min.x, box.min.z, spacing_m, count(box.size().x), count(box.size().z)};
}

Columns columns_of(const SurfaceMesh& mesh, const ColumnLattice& lattice, const Monitor& monitor) {
  const RowCrossings crossings_of(mesh, lattice);
  std::vector<Row> rows(lattice.n_z);
  parallel_for(rows.size(), 4, [&](std::size_t begin, std::size_t end, int /*worker*/) {
    std::vector<Crossing> crossings;
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
      // The one that ends first meets nothing more.
      const bool p_first = p.i != q.i ? p.i < q.i : p.top_m <= q.top_m;
      ++(p_first ? n : m);
    }
  }
  return length_m * a.lattice.spacing_m * a.lattice.spacing_m;
}

}  // namespace sarnerf

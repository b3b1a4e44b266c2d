// SPDX-License-Identifier: Apache-2.0
#include "columns.h"

#include <algorithm>
#include <span>

#include "line_crossings.h"
#include "sarnerf/core/parallel.h"

namespace sarnerf {
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
      // The one that ends first meets nothing more.
      const bool p_first = p.i != q.i ? p.i < q.i : p.top_m <= q.top_m;
      ++(p_first ? n : m);
    }
  }
  return length_m * a.lattice.spacing_m * a.lattice.spacing_m;
}

}  // namespace sarnerf

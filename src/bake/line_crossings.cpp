// SPDX-License-Identifier: Apache-2.0
#include "line_crossings.h"

#include <algorithm>
#include <glm/glm.hpp>

namespace sarnerf {
namespace {

/// Where one row of lines enters or leaves a triangle's projection.
struct Border {
  double x_m;
  double y_m;
};

/// Where an edge crosses row k. Always from the end of lower z, so that both its triangles get the same.
Border border(const glm::dvec3& low, const glm::dvec3& high, double z_m) {
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
    return a.turn > b.turn;  // solids that touch are one
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

/// Of a triangle's edges a row crosses none, or one up and one down in z.
void LineCrossings::add(std::uint32_t k, const glm::uvec3& triangle, std::vector<LineCrossing>& crossings) const {
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

}  // namespace sarnerf

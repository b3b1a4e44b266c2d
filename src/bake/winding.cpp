// SPDX-License-Identifier: Apache-2.0
#include "winding.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <span>
#include <tuple>
#include <utility>

#include "columns.h"
#include "sarnerf/core/parallel.h"

namespace sarnerf {
namespace {

constexpr double kSeenSmall = 5.0;      ///< distance over radius above which a piece of border is a dipole
constexpr std::uint32_t kLeafEdges = 4;
constexpr double kInside = 0.5;
constexpr int kSteps = 16;              ///< along a column of the box
constexpr double kRootTolerance = 1e-3; ///< in spacings of the columns

/// Solid angle (sr) of the spherical triangle a, b, zenith as seen from the origin.
double curtain_angle(const glm::dvec3& a, const glm::dvec3& b) {
  const double length_a = glm::length(a), length_b = glm::length(b);
  // a · (b × z) with z = (0, 1, 0).
  const double volume = a.z * b.x - a.x * b.z;
  return 2.0 * std::atan2(volume, length_a * length_b + glm::dot(a, b) + b.y * length_a + a.y * length_b);
}

/// For each vertex, the index of one vertex with its coordinates, the same for all that have them.
std::vector<std::uint32_t> welded(const std::vector<glm::dvec3>& vertices_m) {
  std::vector<std::uint32_t> order(vertices_m.size()), place(vertices_m.size());
  for (std::uint32_t v = 0; v < order.size(); ++v) order[v] = v;
  const auto key = [&](std::uint32_t v) { return std::tie(vertices_m[v].x, vertices_m[v].y, vertices_m[v].z); };
  std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) { return key(a) < key(b); });
  for (std::size_t n = 0; n < order.size(); ++n)
    place[order[n]] = n > 0 && key(order[n]) == key(order[n - 1]) ? place[order[n - 1]] : order[n];
  return place;
}

/// Edges that triangles traverse more often one way than the other, by that excess, keyed by their first vertex.
std::multimap<std::uint32_t, std::uint32_t> border_edges(const SurfaceMesh& mesh) {
  const std::vector<std::uint32_t> place = welded(mesh.vertices_m);
  std::vector<std::tuple<std::uint32_t, std::uint32_t, int>> edges;  // ends, ascending, and the direction
  edges.reserve(3 * mesh.triangles.size());
  for (const glm::uvec3& t : mesh.triangles) {
    for (int corner = 0; corner < 3; ++corner) {
      const std::uint32_t a = place[t[corner]], b = place[t[(corner + 1) % 3]];
      if (a != b) edges.emplace_back(std::min(a, b), std::max(a, b), a < b ? 1 : -1);
    }
  }
  std::sort(edges.begin(), edges.end());
  std::multimap<std::uint32_t, std::uint32_t> border;
  for (std::size_t n = 0; n < edges.size();) {
    const auto [a, b, first_way] = edges[n];
    int net = 0;
    for (; n < edges.size() && std::get<0>(edges[n]) == a && std::get<1>(edges[n]) == b; ++n) net += std::get<2>(edges[n]);
    for (int m = 0; m < std::abs(net); ++m) net > 0 ? border.emplace(a, b) : border.emplace(b, a);
  }
  return border;
}

void add_interval(std::vector<Columns::Interval>& intervals, std::uint32_t i, double bottom_m, double top_m) {
  if (!(top_m > bottom_m)) return;
  if (!intervals.empty() && intervals.back().i == i && intervals.back().top_m == bottom_m) {
    intervals.back().top_m = top_m;
  } else {
    intervals.push_back({i, bottom_m, top_m});
  }
}

/// One vertical line through a mesh's box.
struct Line {
  const BorderWinding& border;
  double x_m, z_m, bottom_m, top_m, spacing_m;

  double border_at(double y_m) const { return border.empty() ? 0.0 : border.at({x_m, y_m, z_m}); }

  /// Height between `inside_m` and `outside_m` where turns + border passes 1/2, by bisection.
  double passed_m(int turns, double inside_m, double outside_m) const {
    while (std::abs(outside_m - inside_m) > kRootTolerance * spacing_m) {
      const double middle_m = 0.5 * (inside_m + outside_m);
      if (middle_m == inside_m || middle_m == outside_m) break;
      (turns + border_at(middle_m) > kInside ? inside_m : outside_m) = middle_m;
    }
    return 0.5 * (inside_m + outside_m);
  }

  void collect(std::uint32_t i, std::span<const LineCrossing> crossings, std::vector<Columns::Interval>& intervals) const {
    int turns = 0;
    double from_m = bottom_m, border_from = border_at(bottom_m);
    const double step_m = (top_m - bottom_m) / kSteps;
    const auto go_up = [&](double end_m) {
      const int n = border.empty() ? 1 : std::max(1, static_cast<int>(std::ceil((end_m - from_m) / step_m)));
      const double begin_m = from_m;
      for (int s = 1; s <= n && end_m > begin_m; ++s) {
        const double to_m = s == n ? end_m : begin_m + (end_m - begin_m) * s / n;
        const double border_to = border_at(to_m);
        const bool from_inside = turns + border_from > kInside, to_inside = turns + border_to > kInside;
        if (from_inside && to_inside) {
          add_interval(intervals, i, from_m, to_m);
        } else if (from_inside) {
          add_interval(intervals, i, from_m, passed_m(turns, from_m, to_m));
        } else if (to_inside) {
          add_interval(intervals, i, passed_m(turns, to_m, from_m), to_m);
        }
        from_m = to_m, border_from = border_to;
      }
    };
    for (const LineCrossing& crossing : crossings) {
      go_up(std::clamp(crossing.y_m, from_m, top_m));
      turns += crossing.turn;
    }
    go_up(top_m);
  }
};

/// Calls visit(line i, its crossings) for every line of a row.
template <class Visit>
void for_each_line(std::uint32_t n_x, std::span<const LineCrossing> crossings, const Visit& visit) {
  std::size_t next = 0;
  for (std::uint32_t i = 0; i < n_x; ++i) {
    const std::size_t begin = next;
    while (next < crossings.size() && crossings[next].i == i) ++next;
    visit(i, crossings.subspan(begin, next - begin));
  }
}

}  // namespace

BorderWinding::BorderWinding(const SurfaceMesh& mesh) {
  std::multimap<std::uint32_t, std::uint32_t> edges = border_edges(mesh);
  n_edges_ = edges.size();
  std::vector<Loop> loops;
  // As many edges end at a vertex as begin there: following them leads back to the first vertex.
  while (!edges.empty()) {
    Loop loop;
    loop.first = static_cast<std::uint32_t>(points_m_.size());
    Box box_m;
    const std::uint32_t begin = edges.begin()->first;
    std::uint32_t at = begin;
    points_m_.push_back(mesh.vertices_m[at]);
    do {
      const auto next = edges.find(at);
      at = next->second;
      edges.erase(next);
      points_m_.push_back(mesh.vertices_m[at]);
      box_m.include(points_m_.back());
    } while (at != begin);
    loop.last = static_cast<std::uint32_t>(points_m_.size()) - 1;
    loop.middle_m = box_m.centre();
    loops.push_back(loop);
  }
  if (!loops.empty()) build_group(loops);
}

std::uint32_t BorderWinding::build_group(std::span<Loop> loops) {
  if (loops.size() == 1) return build_piece(loops.front().first, loops.front().last);
  Box middles_m;
  for (const Loop& loop : loops) middles_m.include(loop.middle_m);
  const glm::dvec3 size_m = middles_m.size();
  const int axis = size_m.x >= size_m.y && size_m.x >= size_m.z ? 0 : size_m.y >= size_m.z ? 1 : 2;
  const std::size_t half = loops.size() / 2;
  std::nth_element(loops.begin(), loops.begin() + static_cast<std::ptrdiff_t>(half), loops.end(),
                   [axis](const Loop& a, const Loop& b) {
                     return std::tie(a.middle_m[axis], a.first) < std::tie(b.middle_m[axis], b.first);
                   });
  const auto number = static_cast<std::uint32_t>(nodes_.size());
  nodes_.emplace_back();
  const std::uint32_t first = build_group(loops.first(half)), second = build_group(loops.subspan(half));
  Node node;
  node.second_child = second;
  const Node &a = nodes_[first], &b = nodes_[second];
  node.box_m = {glm::min(a.box_m.min, b.box_m.min), glm::max(a.box_m.max, b.box_m.max)};
  node.area_m2 = a.area_m2 + b.area_m2;
  node.weight_m2 = a.weight_m2 + b.weight_m2;
  node.centre_m = node.weight_m2 > 0.0 ? (a.weight_m2 * a.centre_m + b.weight_m2 * b.centre_m) / node.weight_m2
                                       : node.box_m.centre();
  node.radius_m = std::max(glm::distance(node.centre_m, a.centre_m) + a.radius_m,
                           glm::distance(node.centre_m, b.centre_m) + b.radius_m);
  nodes_[number] = node;
  return number;
}

std::uint32_t BorderWinding::build_piece(std::uint32_t first, std::uint32_t last) {
  const auto number = static_cast<std::uint32_t>(nodes_.size());
  Node node;
  node.first = first, node.last = last;
  const glm::dvec3 apex_m = points_m_[first];
  for (std::uint32_t n = first; n <= last; ++n) node.box_m.include(points_m_[n]);
  glm::dvec3 weighted(0.0);
  for (std::uint32_t n = first; n < last; ++n) {
    const glm::dvec3 &a = points_m_[n], &b = points_m_[n + 1];
    const glm::dvec3 area_m2 = 0.5 * glm::cross(a - apex_m, b - apex_m);
    node.area_m2 += area_m2;
    node.weight_m2 += glm::length(area_m2);
    weighted += glm::length(area_m2) * (apex_m + a + b) / 3.0;
  }
  node.centre_m = node.weight_m2 > 0.0 ? weighted / node.weight_m2 : node.box_m.centre();
  for (std::uint32_t n = first; n <= last; ++n)
    node.radius_m = std::max(node.radius_m, glm::distance(points_m_[n], node.centre_m));
  nodes_.push_back(node);
  if (last - first > kLeafEdges) {
    const std::uint32_t middle = first + (last - first) / 2;
    build_piece(first, middle);
    const std::uint32_t second = build_piece(middle, last);
    nodes_[number].second_child = second;
  }
  return number;
}

bool BorderWinding::seen_small(const Node& node, const glm::dvec3& p) const {
  // Above the dipole's triangles, the edges' curtains and that of the straight edge may pass p on different sides.
  const Box& box = node.box_m;
  const bool above = p.y >= box.min.y && p.x >= box.min.x && p.x <= box.max.x && p.z >= box.min.z && p.z <= box.max.z;
  const glm::dvec3 away_m = node.centre_m - p;
  return !above && glm::dot(away_m, away_m) > kSeenSmall * kSeenSmall * node.radius_m * node.radius_m;
}

double BorderWinding::at(const glm::dvec3& p) const {
  if (nodes_.empty()) return 0.0;
  double angle = 0.0;
  // Groups and loops are halved repeatedly: fewer than 2³² loops take 32 levels, and fewer than 2³² edges another 32.
  std::uint32_t open[65];
  int n_open = 0;
  open[n_open++] = 0;
  while (n_open > 0) {
    const std::uint32_t number = open[--n_open];
    const Node& node = nodes_[number];
    if (seen_small(node, p)) {
      const glm::dvec3 away_m = node.centre_m - p;
      const double distance_m = glm::length(away_m);
      angle += glm::dot(node.area_m2, away_m) / (distance_m * distance_m * distance_m);
      if (node.first != node.last) angle += curtain_angle(points_m_[node.first] - p, points_m_[node.last] - p);
    } else if (node.second_child != 0) {
      open[n_open++] = node.second_child;
      open[n_open++] = number + 1;
    } else {
      for (std::uint32_t n = node.first; n < node.last; ++n)
        angle += curtain_angle(points_m_[n] - p, points_m_[n + 1] - p);
    }
  }
  return angle / (4.0 * std::numbers::pi);
}

Columns wound_columns(const SurfaceMesh& mesh, const Box& box_m, const ColumnLattice& lattice, const Monitor& monitor) {
  const LineCrossings crossings_of(mesh, lattice);
  const BorderWinding border(mesh);
  std::vector<std::vector<Columns::Interval>> rows(lattice.n_z);
  parallel_for(mesh.triangles.empty() ? 0 : rows.size(), 1, [&](std::size_t begin, std::size_t end, int /*worker*/) {
    std::vector<LineCrossing> crossings;
    for (std::size_t k = begin; k < end; ++k) {
      monitor.check();
      const double z_m = lattice.z_m + (static_cast<double>(k) + 0.5) * lattice.spacing_m;
      if (z_m < box_m.min.z || z_m > box_m.max.z) continue;
      crossings_of.collect(static_cast<std::uint32_t>(k), crossings);
      for_each_line(lattice.n_x, crossings, [&](std::uint32_t i, std::span<const LineCrossing> of_line) {
        const double x_m = lattice.x_m + (i + 0.5) * lattice.spacing_m;
        if (x_m < box_m.min.x || x_m > box_m.max.x) return;
        if (of_line.empty() && border.empty()) return;
        const Line line{border, x_m, z_m, box_m.min.y, box_m.max.y, lattice.spacing_m};
        line.collect(i, of_line, rows[k]);
      });
    }
  });
  Columns columns;
  columns.lattice = lattice;
  columns.row_begin.push_back(0);
  for (const auto& row : rows) {
    columns.intervals.insert(columns.intervals.end(), row.begin(), row.end());
    columns.row_begin.push_back(columns.intervals.size());
  }
  return columns;
}

std::vector<WindingSample> winding_samples(const SurfaceMesh& mesh, const Box& box_m, int n, const Monitor& monitor) {
  if (mesh.triangles.empty()) return {};
  const glm::dvec3 size_m = box_m.size();
  const double longest_m = std::max({size_m.x, size_m.y, size_m.z});
  const ColumnLattice lattice = column_lattice(box_m, longest_m > 0.0 ? longest_m / n : 0.0);
  const auto n_y = static_cast<std::size_t>(std::max(1.0, std::ceil(size_m.y / lattice.spacing_m - 1e-6)));
  const LineCrossings crossings_of(mesh, lattice);
  const BorderWinding border(mesh);
  const std::size_t of_row = lattice.n_x * n_y;
  std::vector<WindingSample> samples(lattice.n_z * of_row);
  parallel_for(lattice.n_z, 1, [&](std::size_t begin, std::size_t end, int /*worker*/) {
    std::vector<LineCrossing> crossings;
    for (std::size_t k = begin; k < end; ++k) {
      monitor.check();
      crossings_of.collect(static_cast<std::uint32_t>(k), crossings);
      for_each_line(lattice.n_x, crossings, [&](std::uint32_t i, std::span<const LineCrossing> of_line) {
        int turns = 0;
        std::size_t below = 0;
        for (std::size_t j = 0; j < n_y; ++j) {
          WindingSample& sample = samples[k * of_row + i * n_y + j];
          sample.point_m = {lattice.x_m + (i + 0.5) * lattice.spacing_m,
                            box_m.min.y + (static_cast<double>(j) + 0.5) * size_m.y / static_cast<double>(n_y),
                            lattice.z_m + (static_cast<double>(k) + 0.5) * lattice.spacing_m};
          while (below < of_line.size() && of_line[below].y_m < sample.point_m.y) turns += of_line[below++].turn;
          sample.winding = turns + (border.empty() ? 0.0 : border.at(sample.point_m));
        }
      });
    }
  });
  return samples;
}

}  // namespace sarnerf

// SPDX-License-Identifier: Apache-2.0
#include "components.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

namespace sarnerf {

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

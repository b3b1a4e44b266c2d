// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/trace/ray_tracer.h"

#include <cmath>
#include <limits>
#include <random>

#include "catch.h"

using namespace sarnerf;

namespace {

/// A bumpy sheet of n × n squares over [0, 1]², seen from above (z).
struct Sheet {
  explicit Sheet(std::uint32_t n) {
    for (std::uint32_t y = 0; y <= n; ++y) {
      for (std::uint32_t x = 0; x <= n; ++x) {
        const float u = float(x) / float(n), v = float(y) / float(n);
        vertices.emplace_back(u, v, 0.1f * std::sin(20.0f * u) * std::cos(17.0f * v));
      }
    }
    for (std::uint32_t y = 0; y < n; ++y) {
      for (std::uint32_t x = 0; x < n; ++x) {
        const std::uint32_t a = y * (n + 1) + x, b = a + 1, c = a + n + 1, d = c + 1;
        triangles.emplace_back(a, b, d);
        triangles.emplace_back(a, d, c);
      }
    }
    vertices.emplace_back(0.0f);  // padding
  }
  std::span<const glm::vec3> points() const { return std::span(vertices).first(vertices.size() - 1); }
  std::vector<glm::vec3> vertices;
  std::vector<glm::uvec3> triangles;
};

/// Rays straight down.
struct Rays {
  std::vector<float> x, y, z, dx, dy, dz;
  void add(float px, float py) {
    x.push_back(px);
    y.push_back(py);
    z.push_back(5.0f);
    dx.push_back(0.0f);
    dy.push_back(0.0f);
    dz.push_back(-1.0f);
  }
  RayRow row() const { return {x, y, z, dx, dy, dz, 100.0f}; }
};

struct Hits {
  explicit Hits(std::size_t n) : distance(n), nx(n), ny(n), nz(n), triangle(n, 12345u) {}
  HitRow row() { return {distance, nx, ny, nz, triangle}; }
  std::vector<float> distance, nx, ny, nz;
  std::vector<std::uint32_t> triangle;
};

}  // namespace

TEST_CASE("blocks of any size agree with tracing ray by ray", "[trace]") {
  const Sheet sheet(20);
  const RayTracer tracer(sheet.points(), sheet.triangles);
  std::mt19937 random(5);
  std::uniform_real_distribution<float> anywhere(-0.3f, 1.3f);
  for (const std::size_t n_rays : {1u, 3u, 4u, 16u, 17u, 61u}) {
    for (std::size_t n_rows = 1; n_rows <= RayTracer::kRowsPerBlock; ++n_rows) {
      std::vector<Rays> rays(n_rows);
      std::vector<Hits> hits(n_rows, Hits(n_rays)), expected(n_rows, Hits(n_rays));
      std::vector<RayRow> ray_rows;
      std::vector<HitRow> hit_rows;
      for (std::size_t r = 0; r < n_rows; ++r) {
        for (std::size_t n = 0; n < n_rays; ++n) rays[r].add(anywhere(random), anywhere(random));
        ray_rows.push_back(rays[r].row());
        hit_rows.push_back(hits[r].row());
        tracer.first_hits_one_by_one(rays[r].row(), expected[r].row());
      }
      tracer.first_hits(ray_rows, hit_rows);
      for (std::size_t r = 0; r < n_rows; ++r) {
        for (std::size_t n = 0; n < n_rays; ++n) {
          const bool inside = rays[r].x[n] > 0.0f && rays[r].x[n] < 1.0f && rays[r].y[n] > 0.0f &&
                              rays[r].y[n] < 1.0f;
          CHECK((hits[r].triangle[n] != kNoTriangle) == inside);
          CHECK(hits[r].triangle[n] == expected[r].triangle[n]);
          if (inside) CHECK(hits[r].distance[n] == Approx(expected[r].distance[n]).epsilon(1e-5));
          if (inside) CHECK(hits[r].nz[n] > 0.0f);  // counter-clockwise seen from above
        }
      }
    }
  }
}

TEST_CASE("rays onto shared edges and corners never leak", "[trace]") {
  const Sheet sheet(37);
  const RayTracer tracer(sheet.points(), sheet.triangles);
  Rays rays;
  for (const glm::uvec3& t : sheet.triangles) {
    for (int c = 0; c < 3; ++c) {
      const glm::vec3 p = sheet.vertices[t[c]], q = sheet.vertices[t[(c + 1) % 3]];
      for (const float s : {0.0f, 0.25f, 0.5f, 0.777f}) {
        const glm::vec3 on_edge = p + s * (q - p);
        if (on_edge.x > 0.01f && on_edge.x < 0.99f && on_edge.y > 0.01f && on_edge.y < 0.99f) {
          rays.add(on_edge.x, on_edge.y);
        }
      }
    }
  }
  Hits hits(rays.x.size());
  const RayRow row = rays.row();
  const HitRow found = hits.row();
  tracer.first_hits({&row, 1}, {&found, 1});
  for (const std::uint32_t triangle : hits.triangle) CHECK(triangle != kNoTriangle);
}

TEST_CASE("all hits come in order of distance, each triangle once", "[trace]") {
  // Five horizontal sheets above one another.
  std::vector<glm::vec3> vertices;
  std::vector<glm::uvec3> triangles;
  for (std::uint32_t n = 0; n < 5; ++n) {
    const float z = float((n * 3) % 5);  // stored out of order
    vertices.insert(vertices.end(), {{0, 0, z}, {1, 0, z}, {0, 1, z}});
    triangles.emplace_back(3 * n, 3 * n + 1, 3 * n + 2);
  }
  vertices.emplace_back(0.0f);
  const RayTracer tracer(std::span<const glm::vec3>(vertices).first(15), triangles);
  std::vector<Crossing> crossings;
  tracer.all_hits({0.2f, 0.2f, 10.0f}, {0, 0, -1}, 100.0f, crossings);
  REQUIRE(crossings.size() == 5);
  for (std::size_t n = 0; n < 5; ++n) {
    CHECK(crossings[n].distance_m == Approx(10.0 - double(4 - n)));
    CHECK(crossings[n].normal.z > 0.0f);
  }
  tracer.all_hits({0.2f, 0.2f, 10.0f}, {0, 0, -1}, 7.5f, crossings);
  CHECK(crossings.size() == 2);
  tracer.all_hits({0.9f, 0.9f, 10.0f}, {0, 0, -1}, 100.0f, crossings);
  CHECK(crossings.empty());
}

TEST_CASE("a ray meets something just where it has a first hit", "[trace]") {
  const Sheet sheet(20);
  const RayTracer tracer(sheet.points(), sheet.triangles);
  std::mt19937 random(9);
  std::uniform_real_distribution<float> anywhere(-0.3f, 1.3f);
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  for (int n = 0; n < 200; ++n) {
    const float x = anywhere(random), y = anywhere(random);
    const bool inside = x > 0.0f && x < 1.0f && y > 0.0f && y < 1.0f;
    CHECK(tracer.meets_any({x, y, 5.0f}, {0, 0, -1}, kInfinity) == inside);
    CHECK_FALSE(tracer.meets_any({x, y, 5.0f}, {0, 0, -1}, 4.5f));  // ends above the sheet
    CHECK_FALSE(tracer.meets_any({x, y, 5.0f}, {0, 0, 1}, kInfinity));
  }
}

TEST_CASE("a tracer without triangles hits nothing", "[trace]") {
  const std::vector<glm::vec3> padding(1);
  const RayTracer tracer(std::span<const glm::vec3>(padding).first(0), {});
  Rays rays;
  rays.add(0.5f, 0.5f);
  Hits hits(1);
  const RayRow row = rays.row();
  const HitRow found = hits.row();
  tracer.first_hits({&row, 1}, {&found, 1});
  CHECK(hits.triangle[0] == kNoTriangle);
  CHECK_FALSE(tracer.meets_any({0.5f, 0.5f, 5.0f}, {0, 0, -1}, 100.0f));
}

// SPDX-License-Identifier: Apache-2.0
// What rays see first, against looking at every line.
#include "reference/lower_envelope.h"

#include <cmath>
#include <random>

#include "catch.h"

using namespace sarnerf;

namespace {

SliceLine line_between(double across_p, double depth_p, double across_q, double depth_q, double r) {
  double first = across_p / (r + depth_p), last = across_q / (r + depth_q);
  if (first > last) {
    std::swap(first, last);
    std::swap(across_p, across_q);
    std::swap(depth_p, depth_q);
  }
  return {first, last, depth_p, across_p, depth_q - depth_p, across_q - across_p, 0};
}

/// Depth at which a ray meets the nearest line, by intersecting it with all of them; infinite if it misses all.
/// The arithmetic is not the one under test: two equations by Cramer's rule, in quadruple-width doubles.
double nearest_depth_m(const std::vector<SliceLine>& lines, double tangent, double r) {
  double best = std::numeric_limits<double>::infinity();
  for (const SliceLine& l : lines) {
    // (r + s) τ = y with s = s₀ + f Δs, y = y₀ + f Δy.
    const long double t = tangent;
    const long double determinant = l.depth_step_m * t - l.across_step_m;
    const long double f = (l.across_m - (static_cast<long double>(r) + l.depth_m) * t) / determinant;
    if (f < 0.0L || f > 1.0L) continue;
    best = std::min(best, static_cast<double>(l.depth_m + f * l.depth_step_m));
  }
  return best;
}

void compare(const std::vector<SliceLine>& lines, double r, std::mt19937& random) {
  std::vector<VisiblePiece> pieces;
  LowerEnvelope(r).find(lines, pieces);
  for (std::size_t n = 0; n < pieces.size(); ++n) {
    CHECK(pieces[n].first < pieces[n].last);
    if (n > 0) CHECK(pieces[n - 1].last <= pieces[n].first);
  }
  std::uniform_real_distribution<double> across(-12.0, 12.0);
  for (int n = 0; n < 2000; ++n) {
    const double tangent = across(random) / r;
    const double expected = nearest_depth_m(lines, tangent, r);
    double seen = std::numeric_limits<double>::infinity();
    for (const VisiblePiece& p : pieces) {
      if (p.first <= tangent && tangent <= p.last) seen = std::min(seen, lines[p.line].depth_at(tangent, r));
    }
    if (std::isinf(expected)) {
      CHECK(std::isinf(seen));
    } else {
      CHECK(seen == within_margin(expected, 1e-7));
    }
  }
}

}  // namespace

TEST_CASE("the nearest of many crossing lines is found for every ray", "[envelope]") {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> place(-10.0, 10.0), step(-4.0, 4.0);
  for (const double r : {50.0, 1e4, 7e5}) {
    for (const int n_lines : {1, 2, 5, 40, 300}) {
      INFO("r " << r << " lines " << n_lines);
      std::vector<SliceLine> lines;
      for (int n = 0; n < n_lines; ++n) {
        const double across = place(random), depth = place(random);
        lines.push_back(line_between(across, depth, across + step(random), depth + step(random), r));
      }
      compare(lines, r, random);
    }
  }
}

TEST_CASE("lines that share ends, coincide or run along the rays do no harm", "[envelope]") {
  const double r = 1e4;
  std::mt19937 random(11);
  // A fan from one point, twice; a chain; a line almost along its rays.
  std::vector<SliceLine> lines;
  for (int n = 0; n < 12; ++n) {
    const double angle = 0.26 * n;
    for (int twice = 0; twice < 2; ++twice) {
      lines.push_back(line_between(-3.0, 1.0, -3.0 + 6.0 * std::cos(angle), 1.0 + 6.0 * std::sin(angle) + 1e-3, r));
    }
  }
  for (int n = -8; n < 8; ++n) lines.push_back(line_between(n, n % 2, n + 1.0, (n + 1) % 2, r));
  lines.push_back(line_between(6.0, -5.0, 6.0 + 0.006 + 1e-6, 5.0, r));
  compare(lines, r, random);
}

TEST_CASE("two lines change places where they cross", "[envelope]") {
  for (const double r : {100.0, 1e4, 7e5}) {
    // Crossing at across 1, depth 0.5 by construction.
    const std::vector<SliceLine> lines{line_between(-1.0, -0.5, 3.0, 1.5, r), line_between(-1.0, 2.5, 3.0, -1.5, r)};
    std::vector<VisiblePiece> pieces;
    LowerEnvelope(r).find(lines, pieces);
    // Before and behind both lines are alone for a while, as their ends are at different depths.
    double change = 0.0;
    for (std::size_t n = 1; n < pieces.size(); ++n) {
      if (pieces[n - 1].line == 0 && pieces[n].line == 1) change = pieces[n].first;
    }
    CHECK(change * (r + 0.5) == Approx(1.0).epsilon(1e-12));
  }
}

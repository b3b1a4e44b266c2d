// SPDX-License-Identifier: Apache-2.0
#include "scene_checks.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "sarnerf/core/error.h"
#include "text.h"

namespace sarnerf {
namespace {

constexpr double kSmallest_m = 0.05;
constexpr double kLargest_m = 200'000.0;
/// Part of the scene's height below the ground from which on the user is told: cellars are less.
constexpr double kBuried = 1.0 / 3.0;

/// Of a number in single precision.
constexpr double kHalfRounding = 0x1p-24;
/// Part of a mesh's diagonal from which on the rounding of its vertices shows.
constexpr double kVisibleRounding = 1e-5;

std::string rounded_text(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g", value);
  return text;
}

}  // namespace

void require_reach(const MeshEntry& entry, const TriangleSoup& soup) {
  for (const glm::dvec3& vertex : soup.vertices) {
    const glm::dvec3 size = glm::abs(vertex) * entry.metres_per_unit;
    if (glm::all(glm::lessThan(size, glm::dvec3(kFarthest_m)))) continue;
    throw InputError(entry.file.string() + ": expected coordinates within " +
                     number_text(kFarthest_m) + " m, found a vertex at (" + number_text(vertex.x) +
                     ", " + number_text(vertex.y) + ", " + number_text(vertex.z) +
                     ") in units of " + number_text(entry.metres_per_unit) +
                     " m; correct it, or choose other --units");
  }
}

void warn_about_precision(const MeshEntry& entry, const TriangleSoup& soup, SceneReport& report) {
  if (!soup.single_precision) return;
  Box box;
  double farthest = 0.0;
  for (const glm::dvec3& v : soup.vertices) {
    box.include(v);
    farthest = std::max({farthest, std::abs(v.x), std::abs(v.y), std::abs(v.z)});
  }
  const double rounding = kHalfRounding * farthest;
  if (!(rounding > kVisibleRounding * glm::length(box.size()))) return;
  report.warnings.push_back(entry.file.filename().string() + ": its vertices, " +
                            rounded_text(farthest * entry.metres_per_unit) +
                            " m from the origin, are stored in single precision, rounded by up to " +
                            rounded_text(rounding * entry.metres_per_unit) +
                            " m; export them relative to a point nearby, or as text");
}

void warn_about_size(Scene& scene) {
  if (scene.box.empty()) return;
  const double diagonal_m = glm::length(scene.box.size());
  if (diagonal_m < kSmallest_m || diagonal_m > kLargest_m) {
    scene.report.warnings.push_back(std::string("the scene measures ") + rounded_text(diagonal_m) +
                                    " m from corner to corner, which is suspiciously " +
                                    (diagonal_m < kSmallest_m ? "small" : "large") +
                                    "; set its units with --units or --scale");
  }
  if (!scene.ground) return;
  const double height_m = scene.box.size().y;
  const double buried = height_m > 0.0 ? (scene.ground->height_m - scene.box.min.y) / height_m : 0.0;
  if (buried >= kBuried && buried < 1.0) {
    scene.report.warnings.push_back(
        "the ground at " + number_text(scene.ground->height_m) + " m hides the lower " +
        std::to_string(static_cast<int>(100.0 * buried)) +
        " % of the scene's height; check --ground-height");
  }
  if (scene.ground->height_m >= scene.box.max.y) {
    scene.report.warnings.push_back("the ground at " + number_text(scene.ground->height_m) +
                                    " m lies above the whole scene, whose top is at " +
                                    number_text(scene.box.max.y) + " m, and hides it");
  }
}

}  // namespace sarnerf

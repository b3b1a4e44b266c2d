// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstdint>
#include <vector>

#include "readers.h"

namespace sarnerf {

/// Reports progress and honours a stop now and then; cheap enough for every line.
class ReadProgress {
 public:
  explicit ReadProgress(const MeshSource& source) : source_(source) {}
  void at(std::size_t position) {
    if (position < next_) return;
    next_ = position + kStep;
    source_.monitor.check();
    source_.monitor.report("reading", position, source_.bytes.size());
  }

 private:
  static constexpr std::size_t kStep = std::size_t{4} << 20;
  const MeshSource& source_;
  std::size_t next_ = 0;
};

/// The same source without UTF-8's byte-order mark. Throws InputError for UTF-16 and UTF-32.
MeshSource text_source(MeshSource source);

/// Throws unless vertex indices fit 32 bits.
void require_countable(const MeshSource& source, std::uint64_t n_vertices);

/// Throws when a soup holds no triangle; passes it on otherwise.
TriangleSoup with_triangles(const MeshSource& source, TriangleSoup soup);

/// Words for a vertex that is not finite.
std::string not_finite(const glm::dvec3& vertex);

inline bool is_finite(const glm::dvec3& v) {
  // One comparison that fails for infinities and NaN alike, on any coordinate.
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

}  // namespace sarnerf

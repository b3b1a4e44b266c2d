// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

namespace sarnerf {

/// Refuses a mesh before it is allocated. Estimates are of the peak, with the file in memory; they were
/// measured on meshes of 1.2 million triangles and rounded up.
class MemoryBudget {
 public:
  /// `limit_bytes`: 0 for no limit.
  explicit MemoryBudget(std::uint64_t limit_bytes = 0) : limit_bytes_(limit_bytes) {}

  /// What the process keeps from now on: the bytes of a file, or the meshes read before.
  void add_kept(std::uint64_t bytes) { kept_bytes_ += bytes; }

  /// Throws UsageError, with what is needed and what fits, when a file of this many bytes is too large.
  void require_file(std::uint64_t bytes, const std::string& name) const;

  /// The same for reading and cleaning a mesh of this many vertices and triangles.
  void require_mesh(std::uint64_t n_vertices, std::uint64_t n_triangles,
                    const std::string& name) const;

  /// The same for orienting triangles whose neighbours disagree, which takes several times as much.
  void require_orientation(std::uint64_t n_triangles, const std::string& name) const;

  /// Bytes that a mesh keeps occupied in a scene.
  static std::uint64_t mesh_bytes(std::uint64_t n_vertices, std::uint64_t n_triangles);

 private:
  std::uint64_t limit_bytes_;
  std::uint64_t kept_bytes_ = 0;
};

}  // namespace sarnerf

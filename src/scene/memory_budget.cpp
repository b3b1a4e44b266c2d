// SPDX-License-Identifier: Apache-2.0
#include "memory_budget.h"

#include <algorithm>

#include "sarnerf/core/error.h"
#include "text.h"

namespace sarnerf {
namespace {

constexpr std::uint64_t kPerVertex = 50;
constexpr std::uint64_t kPerTriangle = 90;
constexpr std::uint64_t kPerOrientedTriangle = 350;

[[noreturn]] void refuse(const std::string& name, const std::string& what, std::uint64_t needed,
                         std::uint64_t limit, const std::string& fits) {
  throw UsageError(name + ": " + what + " needs about " + human_bytes(needed) +
                   " of memory, but --max-memory allows " + human_bytes(limit) + fits);
}

}  // namespace

std::uint64_t MemoryBudget::mesh_bytes(std::uint64_t n_vertices, std::uint64_t n_triangles) {
  return 24 * n_vertices + 24 * n_triangles;
}

void MemoryBudget::require_file(std::uint64_t bytes, const std::string& name) const {
  if (limit_bytes_ == 0 || kept_bytes_ + bytes <= limit_bytes_) return;
  refuse(name, "holding the file", kept_bytes_ + bytes, limit_bytes_,
         "; raise it, or store the mesh as binary PLY, which is half the size of text");
}

void MemoryBudget::require_mesh(std::uint64_t n_vertices, std::uint64_t n_triangles,
                                const std::string& name) const {
  if (limit_bytes_ == 0) return;
  const std::uint64_t needed = kept_bytes_ + kPerVertex * n_vertices + kPerTriangle * n_triangles;
  if (needed <= limit_bytes_) return;
  const std::uint64_t available = limit_bytes_ - std::min(kept_bytes_, limit_bytes_);
  // The same mesh with fewer triangles, and as many vertices to each.
  const double share = static_cast<double>(available) / static_cast<double>(needed - kept_bytes_);
  const auto fits = static_cast<std::uint64_t>(share * static_cast<double>(n_triangles));
  refuse(name,
         "reading " + counted(n_triangles, "triangle", "triangles") + " on " +
             counted(n_vertices, "vertex", "vertices"),
         needed, limit_bytes_,
         ", enough for about " + counted(fits, "triangle", "triangles") +
             "; raise it or use a coarser mesh");
}

void MemoryBudget::require_orientation(std::uint64_t n_triangles, const std::string& name) const {
  if (limit_bytes_ == 0) return;
  const std::uint64_t needed = kept_bytes_ + kPerOrientedTriangle * n_triangles;
  if (needed <= limit_bytes_) return;
  const std::uint64_t available = limit_bytes_ - std::min(kept_bytes_, limit_bytes_);
  refuse(name,
         "orienting " + counted(n_triangles, "triangle", "triangles") +
             " whose neighbours look the other way",
         needed, limit_bytes_,
         ", enough for about " +
             counted(available / kPerOrientedTriangle, "triangle", "triangles") +
             "; raise it, or orient the mesh where it was made");
}

}  // namespace sarnerf

// SPDX-License-Identifier: Apache-2.0
#include "repair/repair.h"

#include <span>
#include <unordered_map>

#include "cgal/cgal_surface.h"
#include "repair/mesh_edges.h"
#include "sarnerf/core/text.h"

namespace sarnerf {

namespace {

/// Triangles of the components in which some inner edge is not smooth. All other triangles are oriented already
/// and never copied: CGAL's structures take several hundred bytes a triangle.
std::vector<std::uint32_t> troubled_triangles(std::span<const glm::uvec3> triangles,
                                              std::size_t n_vertices, RepairCounts& counts) {
  Components components(triangles.size());
  std::vector<std::uint32_t> trouble;
  {
    const EdgeTable edges(triangles, n_vertices);
    edges.for_each([&](std::span<const EdgeUse> edge) {
      for (const EdgeUse& use : edge) components.join(edge[0].triangle(), use.triangle());
      if (edge.size() > 1 && !is_smooth(edge)) trouble.push_back(edge[0].triangle());
      if (edge.size() > 2) ++counts.split_edges;
    });
  }
  std::vector<bool> is_troubled(triangles.size(), false);
  for (const std::uint32_t t : trouble) is_troubled[components.root(t)] = true;
  std::vector<std::uint32_t> chosen;
  for (std::uint32_t t = 0; t < triangles.size(); ++t) {
    if (is_troubled[components.root(t)]) chosen.push_back(t);
  }
  return chosen;
}

/// Orients the components that need it; returns which triangles were reversed.
std::vector<bool> orient(std::vector<glm::dvec3>& vertices, std::vector<glm::uvec3>& triangles,
                         const RepairSetup& setup, RepairCounts& counts) {
  std::vector<bool> turned(triangles.size(), false);
  const std::vector<std::uint32_t> chosen = troubled_triangles(triangles, vertices.size(), counts);
  if (chosen.empty()) return turned;
  setup.budget.require_orientation(chosen.size(), setup.name);

  std::unordered_map<std::uint32_t, std::uint32_t> local_of;
  std::vector<std::uint32_t> global_of;
  std::vector<glm::dvec3> local_vertices;
  std::vector<glm::uvec3> local_triangles;
  local_triangles.reserve(chosen.size());
  for (const std::uint32_t t : chosen) {
    glm::uvec3 corners;
    for (int c = 0; c < 3; ++c) {
      const auto [entry, is_new] =
          local_of.try_emplace(triangles[t][c], static_cast<std::uint32_t>(global_of.size()));
      if (is_new) {
        global_of.push_back(triangles[t][c]);
        local_vertices.push_back(vertices[triangles[t][c]]);
      }
      corners[c] = entry->second;
    }
    local_triangles.push_back(corners);
  }
  orient_with_cgal(local_vertices, local_triangles);

  for (std::size_t n = global_of.size(); n < local_vertices.size(); ++n) {
    global_of.push_back(static_cast<std::uint32_t>(vertices.size()));
    vertices.push_back(local_vertices[n]);
  }
  for (std::size_t n = 0; n < chosen.size(); ++n) {
    glm::uvec3& triangle = triangles[chosen[n]];
    const glm::dvec3 first_before = vertices[triangle.x];
    for (int c = 0; c < 3; ++c) triangle[c] = global_of[local_triangles[n][c]];
    turned[chosen[n]] = vertices[triangle.x] != first_before;
    counts.turned_faces += turned[chosen[n]] ? 1 : 0;
  }
  return turned;
}

/// Reverses solids that face inward, joins cavities to the pieces around them, and renumbers the pieces.
void face_outward(RepairedMesh& mesh, std::vector<PieceShape>& pieces,
                  std::span<const std::uint32_t> medium_of_material, const Monitor& monitor,
                  RepairCounts& counts) {
  const std::vector<std::uint32_t> container =
      find_cavities(mesh, pieces, medium_of_material, monitor);
  std::vector<bool> turn(pieces.size(), false);
  for (std::size_t p = 0; p < pieces.size(); ++p) {
    if (container[p] != kNoPiece) {
      ++counts.cavities;
    } else if (pieces[p].closed && pieces[p].signed_volume < 0.0) {
      turn[p] = true;
      ++counts.turned_pieces;
    }
  }
  if (counts.cavities + counts.turned_pieces == 0) return;

  std::vector<std::uint32_t> renumbered(pieces.size());
  std::vector<PieceShape> kept;
  for (std::size_t p = 0; p < pieces.size(); ++p) {
    if (container[p] != kNoPiece) continue;
    renumbered[p] = static_cast<std::uint32_t>(kept.size());
    kept.push_back(pieces[p]);
  }
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const std::uint32_t p = mesh.piece[t];
    if (turn[p]) std::swap(mesh.triangles[t].y, mesh.triangles[t].z);
    mesh.piece[t] = renumbered[container[p] == kNoPiece ? p : container[p]];
  }
  pieces = std::move(kept);
}

/// Drops faces without area, and pieces that have no other faces.
void drop_flat_faces(RepairedMesh& mesh, std::vector<PieceShape>& pieces, RepairCounts& counts) {
  std::vector<std::uint32_t> renumbered(pieces.size(), kNoPiece);
  std::vector<PieceShape> kept_pieces;
  std::size_t kept = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const glm::uvec3 v = mesh.triangles[t];
    if (on_one_line(mesh.vertices[v.x], mesh.vertices[v.y], mesh.vertices[v.z])) {
      ++counts.flat_faces;
      continue;
    }
    std::uint32_t& piece = renumbered[mesh.piece[t]];
    if (piece == kNoPiece) {
      piece = static_cast<std::uint32_t>(kept_pieces.size());
      kept_pieces.push_back(pieces[mesh.piece[t]]);
    }
    mesh.triangles[kept] = v;
    mesh.material[kept] = mesh.material[t];
    mesh.group[kept] = mesh.group[t];
    mesh.piece[kept] = piece;
    ++kept;
  }
  mesh.triangles.resize(kept);
  mesh.material.resize(kept);
  mesh.group.resize(kept);
  mesh.piece.resize(kept);
  pieces = std::move(kept_pieces);
}

/// Drops vertices that no triangle uses any more.
void drop_unused_vertices(RepairedMesh& mesh) {
  constexpr std::uint32_t kUnused = 0xffffffffu;
  std::vector<std::uint32_t> renumbered(mesh.vertices.size(), kUnused);
  for (const glm::uvec3& t : mesh.triangles)
    renumbered[t.x] = renumbered[t.y] = renumbered[t.z] = 0;
  std::uint32_t kept = 0;
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    if (renumbered[v] == kUnused) continue;
    mesh.vertices[kept] = mesh.vertices[v];
    renumbered[v] = kept++;
  }
  if (kept == mesh.vertices.size()) return;
  mesh.vertices.resize(kept);
  for (glm::uvec3& t : mesh.triangles) t = {renumbered[t.x], renumbered[t.y], renumbered[t.z]};
}

}  // namespace

RepairedMesh repair_mesh(TriangleSoup soup, const RepairSetup& setup, RepairCounts& counts) {
  const std::span<const std::uint32_t> medium_of_material(setup.medium_of_material);
  constexpr std::uint64_t kSteps = 4;
  const auto step = [&](std::uint64_t n) {
    setup.monitor.check();
    setup.monitor.report("repairing", n, kSteps);
  };
  step(0);
  counts.merged_vertices = weld_vertices(soup, medium_of_material);
  step(1);
  if (setup.mend) {
    counts.repeated_corner_faces = drop_repeated_corners(soup);
    counts.stitched_vertices = stitch_borders(soup, medium_of_material);
    if (counts.stitched_vertices > 0) counts.repeated_corner_faces += drop_repeated_corners(soup);
    drop_coincident_faces(soup, counts);
  }
  step(2);
  RepairedMesh mesh;
  mesh.vertices = std::move(soup.vertices);
  mesh.triangles = std::move(soup.triangles);
  mesh.material = std::move(soup.material);
  mesh.group = std::move(soup.group);
  const std::vector<bool> turned = setup.mend ? orient(mesh.vertices, mesh.triangles, setup, counts)
                                              : std::vector<bool>(mesh.triangles.size(), false);
  step(3);
  std::vector<PieceShape> pieces = find_pieces(mesh, turned);
  if (setup.mend) {
    face_outward(mesh, pieces, medium_of_material, setup.monitor, counts);
    drop_flat_faces(mesh, pieces, counts);
    drop_unused_vertices(mesh);
  } else {
    for (PieceShape& piece : pieces) piece.closed &= piece.signed_volume > 0.0;
  }

  for (const PieceShape& piece : pieces) mesh.closed.push_back(piece.closed);
  for (const bool closed : mesh.closed) ++(closed ? counts.solids : counts.shell_pieces);
  for (const std::uint32_t p : mesh.piece) counts.shell_faces += mesh.closed[p] ? 0 : 1;
  setup.monitor.report("repairing", kSteps, kSteps);
  return mesh;
}

std::vector<std::string> repair_notes(const RepairCounts& counts, const std::string& prefix) {
  std::vector<std::string> notes;
  const auto note = [&](std::uint64_t count, const std::string& text) {
    if (count > 0) notes.push_back(prefix + text);
  };
  const auto faces = [](std::uint64_t count) { return counted(count, "face", "faces"); };
  note(counts.merged_vertices,
       "merged " + counted(counts.merged_vertices, "duplicate vertex", "duplicate vertices"));
  note(counts.stitched_vertices, "joined " +
                                     counted(counts.stitched_vertices, "vertex", "vertices") +
                                     " of open borders across gaps caused by rounding");
  note(counts.repeated_corner_faces, "dropped " + faces(counts.repeated_corner_faces) +
                                         " with fewer than three different corners");
  note(counts.flat_faces, "dropped " + faces(counts.flat_faces) + " without area");
  note(counts.duplicate_faces,
       "dropped " + counted(counts.duplicate_faces, "duplicate face", "duplicate faces"));
  note(counts.interior_faces, "dropped " + faces(counts.interior_faces) +
                                  " inside, where solids touch: the solids become one");
  note(counts.split_edges,
       "split " + counted(counts.split_edges, "edge", "edges") + " shared by more than two faces");
  note(counts.turned_faces,
       "turned " + faces(counts.turned_faces) + " to agree with their neighbours");
  note(counts.turned_pieces,
       "turned " + counted(counts.turned_pieces, "piece", "pieces") + " outward");
  note(counts.cavities, "kept " + counted(counts.cavities, "piece", "pieces") +
                            " as drawn: inside out within another one, so a cavity");
  note(counts.shell_pieces, faces(counts.shell_faces) + " in " +
                                counted(counts.shell_pieces, "open piece", "open pieces") +
                                (counts.shell_faces == 1 ? " is treated as a thin shell"
                                                         : " are treated as thin shells"));
  return notes;
}

}  // namespace sarnerf

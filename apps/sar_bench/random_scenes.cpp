// SPDX-License-Identifier: Apache-2.0
#include "random_scenes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <span>
#include <utility>

#include <nlohmann/json.hpp>

#include "sarnerf/core/text.h"
#include "sarnerf/core/units.h"
#include "sarnerf/geometry/acquisition.h"
#include "scene_pieces.h"

namespace sarnerf::bench {

namespace {

/// Rounds to multiples of 1 / n_steps, so that differences between mathematics libraries do not reach the files.
double rounded(double value, double n_steps) { return std::round(value * n_steps) / n_steps; }

// Solids.

/// An ellipsoid that touches y = 0, or the upper half of one; horizontal half-axes of 1 to 2, as high as a prism.
ScenePiece round_solid(Random& random, const std::string& group) {
  constexpr int kAround = 32, kBands = 16;
  const glm::dvec3 half{random.uniform(1.0, 2.0), random.uniform(1.0, 2.5), random.uniform(1.0, 2.0)};
  const bool dome = random.chance(0.5);
  const double lowest = dome ? 0.0 : -0.5 * kPi, half_y = dome ? half.y : 0.5 * half.y, centre_y = dome ? 0.0 : half_y;
  std::vector<Ring> rings;
  for (int band = 0; band <= kBands; ++band) {
    const double latitude = lowest + (0.5 * kPi - lowest) * band / kBands, across = std::cos(latitude);
    const glm::dvec3 centre{0.0, centre_y + half_y * std::sin(latitude), 0.0};
    const bool tip = band == kBands || (band == 0 && !dome);
    rings.push_back(tip ? Ring{centre} : polygon(centre, {0, 0, across * half.z}, {across * half.x, 0, 0}, kAround));
  }
  return loft(group, group, rings);
}

/// A prism that narrows or widens upward.
ScenePiece tapered_prism(Random& random, const std::string& group) {
  const glm::dvec3 half{random.uniform(1.0, 2.0), random.uniform(1.0, 2.5), random.uniform(1.0, 2.0)};
  const double taper = random.uniform(0.5, 1.5);
  const int n_corners = random.whole(3, 8);
  const glm::dvec3 u{0, 0, half.z}, v{half.x, 0, 0};
  return loft(group, group, {polygon({0, 0, 0}, u, v, n_corners), polygon({0, half.y, 0}, taper * u, taper * v, n_corners)});
}

/// One to three solids, each beside the first or on the one before it.
Pieces random_solids(Random& random) {
  Pieces pieces;
  glm::dvec3 foot{0.0};
  const int n_solids = random.whole(1, 3);
  for (int n = 1; n <= n_solids; ++n) {
    const std::string group = "solid_" + std::to_string(n);
    ScenePiece solid = random.chance(0.3) ? round_solid(random, group) : tapered_prism(random, group);
    turn_about_y(solid, random.angle_rad());
    if (n > 1 && random.chance(0.5)) {
      // Sunk into the solid below, since a dome ends in a tip; off the axis by less than the slimmest top is wide.
      foot += glm::dvec3{random.uniform(-0.1, 0.1), 0.0, random.uniform(-0.1, 0.1)};
      foot.y = box_of(std::span(pieces).last(1)).max.y * random.uniform(0.8, 0.95);
    } else if (n > 1) {
      const double away = random.uniform(1.5, 3.5), around = random.angle_rad();
      foot = {away * std::cos(around), 0.0, away * std::sin(around)};
    }
    move(solid, foot);
    pieces.push_back(std::move(solid));
  }
  const double length_m = random.uniform(7.5, 11.5), height_m = random.uniform(2.5, 7.5);
  fit(pieces, length_m, height_m);
  return pieces;
}

// Buildings.

constexpr double kEaves_m = 0.3;

/// The roof over a rectangle of eaves. The ridge runs along the longer side and ends `hip` before either end of the eaves;
/// 0 makes gables.
ScenePiece pitched_roof(const glm::dvec3& centre, glm::dvec2 half_xz, double rise, double hip) {
  const bool along_x = half_xz.x >= half_xz.y;
  const double half_length = std::max(half_xz.x, half_xz.y), half_width = std::min(half_xz.x, half_xz.y);
  const auto corner = [&](double along, double up, double across) {
    return centre + (along_x ? glm::dvec3(along, up, across) : glm::dvec3(-across, up, along));
  };
  const auto end = [&](double eaves, double ridge) {
    return Ring{corner(ridge, rise, 0.0), corner(eaves, 0.0, half_width), corner(eaves, 0.0, -half_width)};
  };
  return loft("roof", "roofs", {end(-half_length, hip - half_length), end(half_length, half_length - hip)});
}

/// Walls and roof over a rectangle. Returns the height of the ridge.
double add_block(Pieces& pieces, Random& random, const glm::dvec2& min_xz, const glm::dvec2& max_xz) {
  const double walls_m = random.uniform(3.0, 6.0);
  pieces.push_back(box("wall", "walls", {min_xz.x, 0.0, min_xz.y}, {max_xz.x, walls_m, max_xz.y}));
  const glm::dvec2 middle = 0.5 * (min_xz + max_xz), half = 0.5 * (max_xz - min_xz) + kEaves_m;
  const int roof = random.whole(0, 2);
  if (roof == 0) {
    const double top_m = walls_m + random.uniform(0.25, 0.4);
    pieces.push_back(box("roof", "roofs", {middle.x - half.x, walls_m, middle.y - half.y},
                         {middle.x + half.x, top_m, middle.y + half.y}));
    return top_m;
  }
  const double half_width = std::min(half.x, half.y), rise_m = half_width * random.uniform(0.25, 0.45);
  const double hip_m = roof == 1 ? 0.0 : half_width * random.uniform(0.5, 0.9);
  pieces.push_back(pitched_roof({middle.x, walls_m, middle.y}, half, rise_m, hip_m));
  return walls_m + rise_m;
}

/// A main block along X with a wing at one end (L), near the middle (T) or at both ends (U).
Pieces random_building(Random& random) {
  const double length_m = random.uniform(7.0, 11.0), width_m = random.uniform(4.0, 5.0);
  Pieces pieces;
  const double ridge_m = add_block(pieces, random, {-0.5 * length_m, -0.5 * width_m}, {0.5 * length_m, 0.5 * width_m});

  // Set back from the main block's ends and begun inside it: no wall lies in the plane of another.
  const double half_wing_m = length_m * random.uniform(0.13, 0.18), at_end_m = 0.5 * length_m - half_wing_m - 0.25;
  const int shape = random.whole(0, 2);
  std::vector<double> places_m;
  if (shape == 0) places_m = {random.chance(0.5) ? at_end_m : -at_end_m};
  if (shape == 1) places_m = {at_end_m * random.uniform(-0.3, 0.3)};
  if (shape == 2) places_m = {-at_end_m, at_end_m};
  for (const double x : places_m) {
    const double far_m = 0.5 * width_m + random.uniform(2.0, 4.2);
    add_block(pieces, random, {x - half_wing_m, -0.15 * width_m}, {x + half_wing_m, far_m});
  }

  if (random.chance(0.5)) {
    const glm::dvec3 centre{length_m * random.uniform(-0.3, 0.3), 0.0, width_m * random.uniform(-0.15, 0.15)};
    const double half_m = random.uniform(0.25, 0.45), top_m = ridge_m + random.uniform(0.3, 0.5);
    pieces.push_back(box("chimney", "extras", centre + glm::dvec3(-half_m, 0.5 * ridge_m, -half_m),
                         centre + glm::dvec3(half_m, top_m, half_m)));
  }
  if (random.chance(0.35)) {
    const double x = length_m * random.uniform(-0.25, 0.25), half_m = random.uniform(0.8, 1.3);
    const double depth_m = random.uniform(1.0, 1.6), height_m = random.uniform(2.2, 2.8);
    pieces.push_back(box("porch", "extras", {x - half_m, 0.0, -0.5 * width_m - depth_m},
                         {x + half_m, height_m, -0.3 * width_m}));
  }
  return pieces;
}

// Vehicles.

/// A vehicle with its bow toward +X.
Pieces random_vehicle(Random& random) {
  const double length_m = random.uniform(7.2, 9.8), half_width_m = random.uniform(1.2, 1.6);
  const bool has_turret = random.chance(0.5), has_barrel = has_turret && random.chance(0.7);
  const double rear = -0.5 * length_m, bow = 0.5 * length_m - (has_barrel ? random.uniform(0.3, 1.8) : 0.0);
  const double radius_m = random.uniform(0.4, 0.7);
  const double bottom = radius_m * random.uniform(0.9, 1.1), top = bottom + random.uniform(1.2, 1.6);

  // The outermost line of bow and stern lies between bottom and deck; from there both slope inward, down and up.
  const double edge = bottom + (top - bottom) * random.uniform(0.3, 0.7);
  const double stern_below = random.uniform(0.2, 0.8), stern_above = random.uniform(0.1, 0.6);
  const double bow_below = random.uniform(0.3, 1.0), bow_above = random.uniform(0.2, 1.2);
  const auto profile = [&](double z) {
    return Ring{{rear + stern_below, bottom, z}, {bow - bow_below, bottom, z}, {bow, edge, z},
                {bow - bow_above, top, z},       {rear + stern_above, top, z}, {rear, edge, z}};
  };
  Pieces pieces{loft("hull", "hull", {profile(-half_width_m), profile(half_width_m)})};

  const double first = rear + 0.5 * stern_below + radius_m, last = bow - 0.5 * bow_below - radius_m;
  const int most_axles = 1 + static_cast<int>((last - first) / (2.1 * radius_m));
  const int n_axles = random.whole(2, std::min(4, most_axles)), n_facets = 2 * random.whole(8, 12);
  const double tread_m = random.uniform(0.3, 0.45);
  for (int axle = 0; axle < n_axles; ++axle) {
    const double x = first + (last - first) * axle / (n_axles - 1);
    for (const double side : {-1.0, 1.0}) {
      const double z = side * half_width_m;
      pieces.push_back(cylinder("wheel", "tyres", {x, radius_m, z - 0.5 * tread_m}, {x, radius_m, z + 0.5 * tread_m}, radius_m,
                                n_facets));
    }
  }

  const double sunk = top - 0.05;  // no face of a part on the deck lies in the deck's plane
  if (has_turret) {
    const double x = 0.5 * (rear + bow) + (bow - rear) * random.uniform(-0.1, 0.1);
    const double base_m = half_width_m * random.uniform(0.7, 0.95), taper = random.uniform(0.6, 0.9);
    const double height_m = random.uniform(0.6, 1.0);
    const int n_corners = random.whole(6, 12);
    const glm::dvec3 u{0, 0, base_m}, v{base_m, 0, 0};
    pieces.push_back(loft("turret", "cabin", {polygon({x, sunk, 0}, u, v, n_corners),
                                              polygon({x, sunk + height_m, 0}, taper * u, taper * v, n_corners)}));
    if (has_barrel) {
      const double elevation_rad = rad_from_deg(random.uniform(0.0, 8.0)), barrel_m = random.uniform(0.08, 0.15);
      const glm::dvec3 from{x, sunk + 0.55 * height_m, 0.0};
      const double reach_m = 0.5 * length_m - x;
      pieces.push_back(cylinder("barrel", "steel", from, from + glm::dvec3(reach_m, reach_m * std::tan(elevation_rad), 0.0),
                                barrel_m, 16));
    }
  } else {
    const double front = bow - bow_above - random.uniform(0.0, 0.5), back = front - random.uniform(1.6, 2.6);
    const double half_m = half_width_m * random.uniform(0.8, 0.95), height_m = random.uniform(1.0, 1.6);
    const double narrower = half_m * random.uniform(0.1, 0.25), windscreen_m = random.uniform(0.1, 0.6);
    pieces.push_back(loft("cabin", "cabin", {rectangle(sunk, {back, -half_m}, {front, half_m}),
                                             rectangle(sunk + height_m, {back + 0.1, narrower - half_m},
                                                       {front - windscreen_m, half_m - narrower})}));
  }
  if (!has_barrel && random.chance(0.4)) {
    const glm::dvec3 foot{rear + stern_above + random.uniform(0.3, 0.8), sunk, half_width_m * random.uniform(-0.6, 0.6)};
    const double height_m = random.uniform(1.5, 3.0), mast_m = random.uniform(0.08, 0.12);
    pieces.push_back(cylinder("mast", "steel", foot, foot + glm::dvec3(0.0, height_m, 0.0), mast_m, 16));
  }
  return pieces;
}

// Free forms.

/// An icosahedron whose triangles are cut into four `n_cuts` times, corners on the unit sphere.
ScenePiece icosphere(const std::string& group, int n_cuts) {
  const double g = 0.5 * (1.0 + std::sqrt(5.0));
  ScenePiece sphere{group, group, {}, {}};
  sphere.vertices_m = {{-1, g, 0},  {1, g, 0},  {-1, -g, 0}, {1, -g, 0}, {0, -1, g},  {0, 1, g},
                       {0, -1, -g}, {0, 1, -g}, {g, 0, -1},  {g, 0, 1},  {-g, 0, -1}, {-g, 0, 1}};
  sphere.triangles = {{0, 11, 5}, {0, 5, 1},  {0, 1, 7},   {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
                      {11, 10, 2}, {10, 7, 6}, {7, 1, 8},   {3, 9, 4},  {3, 4, 2},   {3, 2, 6}, {3, 6, 8},
                      {3, 8, 9},  {4, 9, 5},  {2, 4, 11},  {6, 2, 10}, {8, 6, 7},   {9, 8, 1}};
  for (int cut = 0; cut < n_cuts; ++cut) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
    const auto middle = [&](std::uint32_t a, std::uint32_t b) {
      const auto [at, is_new] =
          middles.try_emplace(std::minmax(a, b), static_cast<std::uint32_t>(sphere.vertices_m.size()));
      if (is_new) sphere.vertices_m.push_back(0.5 * (sphere.vertices_m[a] + sphere.vertices_m[b]));
      return at->second;
    };
    std::vector<glm::uvec3> finer;
    for (const glm::uvec3& t : sphere.triangles) {
      const std::uint32_t a = middle(t.x, t.y), b = middle(t.y, t.z), c = middle(t.z, t.x);
      for (const glm::uvec3& part : {glm::uvec3(t.x, a, c), {t.y, b, a}, {t.z, c, b}, {a, b, c}}) finer.push_back(part);
    }
    sphere.triangles = std::move(finer);
  }
  for (glm::dvec3& p : sphere.vertices_m) p = glm::normalize(p);
  return sphere;
}

/// A star-shaped body, r(d) = 1 + Σ h exp(s (d·c − 1)) along the direction d, whose bumps and dents of height h lie around the
/// directions c; stretched along the axes, and cut off flat at y = 0.
ScenePiece free_form(Random& random, const std::string& group) {
  struct Bump {
    glm::dvec3 direction;
    double height, sharpness;
  };
  // Eight of the deepest dents in one place leave 4 % of the radius.
  std::vector<Bump> bumps(static_cast<std::size_t>(random.whole(4, 8)));
  for (Bump& bump : bumps) bump = {random.direction(), random.uniform(-0.12, 0.6), random.uniform(4.0, 16.0)};
  const glm::dvec3 stretch{random.uniform(0.8, 1.6), random.uniform(0.6, 1.2), random.uniform(0.8, 1.6)};
  ScenePiece body = icosphere(group, 4);
  for (glm::dvec3& p : body.vertices_m) {
    double radius = 1.0;
    for (const auto& [direction, height, sharpness] : bumps)
      radius += height * std::exp(sharpness * (glm::dot(p, direction) - 1.0));
    p *= radius * stretch;
  }

  // The ground cuts off up to a third of the vertices. Half of them lie below the centre, which stays above ground.
  std::vector<double> heights;
  for (const glm::dvec3& p : body.vertices_m) heights.push_back(p.y);
  std::sort(heights.begin(), heights.end());
  const double ground = heights[static_cast<std::size_t>(random.uniform(0.1, 0.33) * static_cast<double>(heights.size()))];
  for (glm::dvec3& p : body.vertices_m) {
    // Toward the centre, not upward: the body stays star-shaped, so no triangle folds or loses its area.
    if (p.y < ground) p *= ground / p.y;
    p.y -= ground;
  }
  return body;
}

/// One free form, or two side by side.
Pieces random_free_forms(Random& random) {
  Pieces pieces{free_form(random, "body_1")};
  if (random.chance(0.5)) {
    pieces.push_back(free_form(random, "body_2"));
    const double away = random.uniform(1.5, 3.0), around = random.angle_rad();
    move(pieces.back(), {away * std::cos(around), 0.0, away * std::sin(around)});
  }
  const double length_m = random.uniform(7.5, 11.5), height_m = random.uniform(2.5, 7.5);
  fit(pieces, length_m, height_m);
  return pieces;
}

// Scenes.

/// One material for each name in the pieces; in half of all scenes one of them is checkered.
std::vector<Material> random_materials(Random& random, const Pieces& pieces) {
  std::vector<Material> materials;
  for (const ScenePiece& piece : pieces) {
    if (std::any_of(materials.begin(), materials.end(), [&](const Material& m) { return m.name == piece.material; })) continue;
    Material material;
    material.name = piece.material;
    material.gamma0 = rounded(random.log_uniform(0.3, 1.5), 1000.0);
    material.exponent = rounded(random.uniform(0.5, 2.5), 100.0);
    materials.push_back(material);
  }
  if (random.chance(0.5)) {
    const int chosen = random.whole(0, static_cast<int>(materials.size()) - 1);
    Texture& texture = materials[static_cast<std::size_t>(chosen)].texture;
    texture.kind = Texture::Kind::checker;
    texture.period_m = rounded(random.uniform(0.6, 1.5), 100.0);
    texture.contrast = rounded(random.uniform(0.2, 0.5), 100.0);
  }
  return materials;
}

/// Centres the pieces over the origin, and rounds coordinates to whole tenths of a millimetre, none below y = 0.
void place(Pieces& pieces) {
  constexpr double kPerMetre = 1e4;
  const glm::dvec3 centre = box_of(pieces).centre();
  for (ScenePiece& piece : pieces) {
    move(piece, {-centre.x, 0.0, -centre.z});
    for (glm::dvec3& p : piece.vertices_m) {
      p = glm::round(kPerMetre * p) / kPerMetre + 0.0;  // −0 would be printed with its sign
      p.y = std::max(p.y, 0.0);
    }
  }
}

Pieces random_pieces(Random& random, SceneKind kind) {
  switch (kind) {
    case SceneKind::free_form: return random_free_forms(random);
    case SceneKind::solid: return random_solids(random);
    case SceneKind::building: return random_building(random);
    case SceneKind::vehicle: return random_vehicle(random);
    default: break;
  }
  return random_shape(random, kind);
}

}  // namespace

SceneKind kind_of(std::uint64_t seed) {
  const bool shape = seed >= kFirstShape && seed < kEndOfShapes;
  return static_cast<SceneKind>(shape ? 4 + seed % 5 : seed % 4);
}

std::string_view name(SceneKind kind) {
  constexpr std::array<std::string_view, 9> kNames{"free_form", "solid", "building", "vehicle", "ring",
                                                   "overhang", "thin", "slanted", "smooth"};
  return kNames[static_cast<std::size_t>(kind)];
}

RandomScene random_scene(std::uint64_t seed) {
  Random random(seed);
  RandomScene scene;
  scene.name = std::to_string(seed) + "_" + std::string(name(kind_of(seed)));
  scene.pieces = random_pieces(random, kind_of(seed));
  place(scene.pieces);
  scene.materials = random_materials(random, scene.pieces);
  scene.turn_deg = random.whole(0, 359);
  return scene;
}

std::string obj_text(const RandomScene& scene) {
  std::string text = "# " + scene.name + ", written by sar_bench scenes. Metres, Y up.\n";
  std::size_t before = 1;  // OBJ counts from one
  for (const ScenePiece& piece : scene.pieces) {
    text += "g " + piece.group + "\nusemtl " + piece.material + "\n";
    for (const glm::dvec3& p : piece.vertices_m) text += format("v %.4f %.4f %.4f\n", p.x, p.y, p.z);
    for (const glm::uvec3& t : piece.triangles) text += format("f %zu %zu %zu\n", before + t.x, before + t.y, before + t.z);
    before += piece.vertices_m.size();
  }
  return text;
}

std::string scene_json_text(const RandomScene& scene) {
  using Json = nlohmann::ordered_json;
  const Json mesh{{"file", "scene.obj"}, {"rotate_deg", {0, scene.turn_deg, 0}}};
  Json materials;
  for (const Material& material : scene.materials) {
    Json& entry = materials[material.name] = {{"gamma0", material.gamma0}, {"exponent", material.exponent}};
    const Texture& texture = material.texture;
    if (texture.kind == Texture::Kind::checker)
      entry["texture"] = {{"kind", "checker"}, {"period_m", texture.period_m}, {"contrast", texture.contrast}};
  }
  const Json file{
      {"format", "sarnerf-scene"}, {"version", 1}, {"meshes", Json::array({mesh})}, {"materials", materials}};
  return file.dump(2) + "\n";
}

}  // namespace sarnerf::bench

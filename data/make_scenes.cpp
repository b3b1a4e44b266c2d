// SPDX-License-Identifier: Apache-2.0
// Writes the scenes of this folder: the buildings and platforms of the SAR-NeRF paper, an L-shaped
// building and a street of several materials. Sizes can be varied; without options it writes exactly the
// files that stand here.
#include <CLI/CLI.hpp>
#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <glm/glm.hpp>
#include <map>
#include <nlohmann/json.hpp>
#include <numbers>
#include <sstream>
#include <string>
#include <vector>

namespace {

using Json = nlohmann::ordered_json;
using Corners = std::vector<std::size_t>;

/// Micrometres are kept, no more: files come out the same whatever the mathematics library.
std::string decimal(double value) {
  const long long micrometres = std::llround(value * 1e6);
  std::array<char, 48> text;
  std::snprintf(text.data(), text.size(), "%s%lld.%06lld", micrometres < 0 ? "-" : "",
                std::abs(micrometres) / 1000000, std::abs(micrometres) % 1000000);
  std::string trimmed = text.data();
  trimmed.erase(trimmed.find_last_not_of('0') + 1);
  if (trimmed.back() == '.') trimmed.pop_back();
  return trimmed;
}

/// Text of an OBJ file under construction. Faces are counter-clockwise seen from outside.
class ObjText {
 public:
  std::size_t vertex(const glm::dvec3& p) {
    vertices_ += "v " + decimal(p.x) + " " + decimal(p.y) + " " + decimal(p.z) + "\n";
    return ++n_vertices_;
  }
  void face(const std::string& group, const std::string& material, const Corners& corners) {
    if (group != group_) faces_ += "g " + (group_ = group) + "\n";
    if (material != material_) faces_ += "usemtl " + (material_ = material) + "\n";
    faces_ += "f";
    for (const std::size_t corner : corners) faces_ += " " + std::to_string(corner);
    faces_ += "\n";
  }
  std::string text() const {
    return "# Written by sar_make_scenes. Metres, Y up. SPDX-License-Identifier: Apache-2.0\n" +
           vertices_ + faces_;
  }

 private:
  std::string vertices_, faces_, group_, material_;
  std::size_t n_vertices_ = 0;
};

struct Look {
  std::string wall, roof;  ///< materials; groups are called "wall", "roof" and "floor"
  std::string group = "";  ///< one group for all faces instead
};

/// Solid between two rectangles with sides along X and Z, centred over `foot`.
void add_frustum(ObjText& obj, glm::dvec3 foot, glm::dvec2 base, glm::dvec2 top, double height,
                 const Look& look) {
  std::array<std::size_t, 8> v;
  for (std::size_t n = 0; n < 8; ++n) {
    const glm::dvec2 half = 0.5 * (n < 4 ? base : top);
    const double x = n % 4 == 0 || n % 4 == 3 ? -half.x : half.x;
    v[n] = obj.vertex(foot + glm::dvec3(x, n < 4 ? 0.0 : height, n % 4 < 2 ? -half.y : half.y));
  }
  const auto group = [&](const char* own) { return look.group.empty() ? own : look.group; };
  obj.face(group("floor"), look.wall, {v[0], v[1], v[2], v[3]});
  obj.face(group("wall"), look.wall, {v[3], v[2], v[6], v[7]});
  obj.face(group("wall"), look.wall, {v[1], v[0], v[4], v[5]});
  obj.face(group("wall"), look.wall, {v[2], v[1], v[5], v[6]});
  obj.face(group("wall"), look.wall, {v[0], v[3], v[7], v[4]});
  obj.face(group("roof"), look.roof, {v[4], v[7], v[6], v[5]});
}

void add_box(ObjText& obj, glm::dvec3 foot, glm::dvec3 size, const Look& look) {
  add_frustum(obj, foot, {size.x, size.z}, {size.x, size.z}, size.y, look);
}

/// L-shaped block: a wing along the back (−Z) and one along the left (−X) of a square centred over `foot`, one outline
/// from floor to roof, so that no wall stands inside.
void add_angle(ObjText& obj, glm::dvec3 foot, double side, double wing, double height, const Look& look) {
  const double far = 0.5 * side, inner = wing - far;
  // Against the clock seen from below; the fourth corner is the concave one.
  const std::array<glm::dvec2, 6> outline = {
      {{-far, -far}, {far, -far}, {far, inner}, {inner, inner}, {inner, far}, {-far, far}}};
  Corners floor, roof;
  for (const glm::dvec2& p : outline) floor.push_back(obj.vertex(foot + glm::dvec3(p.x, 0.0, p.y)));
  for (const glm::dvec2& p : outline) roof.push_back(obj.vertex(foot + glm::dvec3(p.x, height, p.y)));
  obj.face("floor", look.wall, floor);
  for (std::size_t n = 0; n < outline.size(); ++n) {
    const std::size_t next = (n + 1) % outline.size();
    obj.face("wall", look.wall, {floor[next], floor[n], roof[n], roof[next]});
  }
  obj.face("roof", look.roof, {roof.rbegin(), roof.rend()});
}

/// House whose ridge runs along X.
void add_house(ObjText& obj, glm::dvec3 foot, glm::dvec3 size, double ridge_height,
               const Look& look) {
  std::array<std::size_t, 10> v;
  for (std::size_t n = 0; n < 8; ++n) {
    const double x = n % 4 == 0 || n % 4 == 3 ? -0.5 * size.x : 0.5 * size.x;
    v[n] = obj.vertex(
        foot + glm::dvec3(x, n < 4 ? 0.0 : size.y, n % 4 < 2 ? -0.5 * size.z : 0.5 * size.z));
  }
  v[8] = obj.vertex(foot + glm::dvec3(-0.5 * size.x, ridge_height, 0.0));
  v[9] = obj.vertex(foot + glm::dvec3(0.5 * size.x, ridge_height, 0.0));
  obj.face("floor", look.wall, {v[0], v[1], v[2], v[3]});
  obj.face("wall", look.wall, {v[3], v[2], v[6], v[7]});
  obj.face("wall", look.wall, {v[1], v[0], v[4], v[5]});
  obj.face("wall", look.wall, {v[2], v[1], v[5], v[9], v[6]});
  obj.face("wall", look.wall, {v[0], v[3], v[7], v[8], v[4]});
  obj.face("roof", look.roof, {v[7], v[6], v[9], v[8]});
  obj.face("roof", look.roof, {v[5], v[4], v[8], v[9]});
}

/// Ellipsoid of flat faces: `n_round` around the vertical, half as many from pole to pole.
void add_crown(ObjText& obj, glm::dvec3 centre, glm::dvec3 radii, std::size_t n_round,
               const std::string& group, const std::string& material) {
  const std::size_t n_rings = n_round / 2 - 1;
  const auto point = [&](double from_top, double around) {
    return centre + radii * glm::dvec3(std::sin(from_top) * std::cos(around), std::cos(from_top),
                                       std::sin(from_top) * std::sin(around));
  };
  const std::size_t top = obj.vertex(point(0.0, 0.0));
  std::vector<Corners> rings(n_rings);
  for (std::size_t r = 0; r < n_rings; ++r) {
    for (std::size_t n = 0; n < n_round; ++n) {
      rings[r].push_back(obj.vertex(point(std::numbers::pi * double(r + 1) / double(n_rings + 1),
                                          2.0 * std::numbers::pi * double(n) / double(n_round))));
    }
  }
  const std::size_t bottom = obj.vertex(point(std::numbers::pi, 0.0));
  for (std::size_t n = 0; n < n_round; ++n) {
    const std::size_t next = (n + 1) % n_round;
    obj.face(group, material, {top, rings.front()[next], rings.front()[n]});
    for (std::size_t r = 0; r + 1 < n_rings; ++r) {
      // Two triangles: four points of an ellipsoid lie in no plane.
      obj.face(group, material, {rings[r][n], rings[r][next], rings[r + 1][next]});
      obj.face(group, material, {rings[r][n], rings[r + 1][next], rings[r + 1][n]});
    }
    obj.face(group, material, {bottom, rings.back()[n], rings.back()[next]});
  }
}

struct Sizes {
  double building_length_m = 16.0;
  std::vector<std::string> buildings = {"14x8", "10x10", "8x14"};
  double coinciding_incidence_deg = 35.0;
  double coinciding_height_m = 10.0;
  std::vector<double> cuboid_m = {12.0, 8.0};
  double platform_wide_m = 10.0, platform_narrow_m = 5.0;
  double height_m = 6.0;
  double angle_side_m = 10.0, angle_wing_m = 4.0, angle_height_m = 5.0;
  double checker_period_m = 1.0, checker_contrast = 0.25, exponent = 2.0;
  unsigned n_houses = 3;
  unsigned crown_faces = 12;
};

using Files = std::map<std::string, std::string>;

Json scene_of(const Json& meshes) {
  return {{"format", "sarnerf-scene"}, {"version", 1}, {"meshes", meshes}};
}

void write_scene(Files& files, const std::string& name, const Json& scene) {
  files[name + ".json"] = scene.dump(2) + "\n";
}

/// Wall, roof and ground of Fig. 7: three brightnesses, so that each can be told from the others.
void write_building(Files& files, const std::string& name, double length, double width,
                    double height) {
  ObjText obj;
  add_box(obj, {0, 0, 0}, {length, height, width}, {"wall", "roof"});
  files[name + ".obj"] = obj.text();
  Json scene = scene_of(Json::array({Json{{"file", name + ".obj"}}}));
  scene["materials"] = {{"wall", {{"gamma0", 1.0}, {"exponent", 1.0}}},
                        {"roof", {{"gamma0", 0.5}, {"exponent", 1.0}}},
                        {"field", {{"gamma0", 0.1}, {"exponent", 1.0}}}};
  scene["ground"] = {{"material", "field"}, {"height_m", 0.0}};
  write_scene(files, name, scene);
}

/// Look of the targets of Fig. 8.
const Look kCheckered = {"checkered", "checkered"};

/// No ground, checkered so that views from different sides differ.
void write_target(Files& files, const std::string& name, const Sizes& s, const ObjText& obj) {
  files[name + ".obj"] = obj.text();
  Json scene = scene_of(Json::array({Json{{"file", name + ".obj"}}}));
  scene["materials"] = {{"checkered",
                         {{"gamma0", 1.0},
                          {"exponent", s.exponent},
                          {"texture",
                           {{"kind", "checker"},
                            {"period_m", s.checker_period_m},
                            {"contrast", s.checker_contrast}}}}}};
  write_scene(files, name, scene);
}

void write_platform(Files& files, const std::string& name, const Sizes& s, glm::dvec2 base, glm::dvec2 top) {
  ObjText obj;
  add_frustum(obj, {0, 0, 0}, base, top, s.height_m, kCheckered);
  write_target(files, name, s, obj);
}

/// The concave one among the targets, which the paper has not: what lies in its angle no outline shows.
void write_l_building(Files& files, const Sizes& s) {
  ObjText obj;
  add_angle(obj, {0, 0, 0}, s.angle_side_m, s.angle_wing_m, s.angle_height_m, kCheckered);
  write_target(files, "l_building", s, obj);
}

void write_street(Files& files, const Sizes& s) {
  constexpr double kPlot_m = 14.0;
  const double length = kPlot_m * s.n_houses;
  ObjText street;
  add_box(street, {0, 0, 0}, {length, 0.1, 6.0}, {"asphalt", "asphalt", "road"});
  add_box(street, {0, 0, -4.0}, {length, 0.2, 1.5}, {"concrete", "concrete", "pavement"});
  for (unsigned n = 0; n < s.n_houses; ++n) {
    const double x = kPlot_m * (n + 0.5) - 0.5 * length;
    add_house(street, {x, 0, -11.0}, {9.0, 5.0 + 0.5 * n, 8.0}, 8.0 + 0.5 * n, {"brick", "roof"});
    add_box(street, {x, 0, 5.0}, {kPlot_m - 4.0, 1.5, 0.8}, {"hedge", "hedge", "hedge"});
  }
  files["street.obj"] = street.text();

  ObjText truck;
  add_box(truck, {-1.0, 0.9, 0}, {5.0, 2.2, 2.3}, {"metal", "metal", "truck"});
  add_box(truck, {2.6, 0.5, 0}, {1.8, 2.0, 2.2}, {"metal", "metal", "truck"});
  files["truck.obj"] = truck.text();

  ObjText tree;
  add_box(tree, {0, 0, 0}, {0.4, 2.0, 0.4}, {"wood", "wood", "trunk"});
  add_crown(tree, {0, 4.5, 0}, {2.5, 3.0, 2.5}, s.crown_faces, "crown", "canopy");
  files["tree.obj"] = tree.text();

  Json meshes = Json::array();
  meshes.push_back(Json{{"file", "street.obj"}});
  meshes.push_back(Json{{"file", "truck.obj"}, {"translate_m", {-4, 0.1, 1.5}}});
  meshes.push_back(
      Json{{"file", "truck.obj"}, {"rotate_deg", {0, 180, 0}}, {"translate_m", {6, 0.1, -1.5}}});
  for (unsigned n = 0; n + 1 < s.n_houses; ++n) {
    meshes.push_back(Json{{"file", "tree.obj"},
                          {"rotate_deg", {{"axis", {0, 1, 0}}, {"angle", 40 * n}}},
                          {"translate_m", {kPlot_m * (n + 1.0) - 0.5 * length, 0, -7}}});
  }
  Json scene = scene_of(meshes);
  scene["ground"] = {{"material", "grass"}, {"height_m", 0.0}};
  write_scene(files, "street", scene);
}

Files make_files(const Sizes& s) {
  Files files;
  for (const std::string& building : s.buildings) {
    double width = 0.0, height = 0.0;
    char times = 0;
    std::istringstream(building) >> width >> times >> height;
    if (!(width > 0.0 && height > 0.0 && times == 'x')) {
      throw CLI::ValidationError("--buildings",
                                 "expected WIDTHxHEIGHT such as 14x8, found " + building);
    }
    write_building(files, "building_" + building, s.building_length_m, width, height);
  }
  // Wall and roof fill the same ranges when width / height = cot of the incidence (printed 32–34).
  const double incidence_rad = s.coinciding_incidence_deg * std::numbers::pi / 180.0;
  write_building(files, "building_coinciding_" + decimal(s.coinciding_incidence_deg),
                 s.building_length_m, s.coinciding_height_m / std::tan(incidence_rad),
                 s.coinciding_height_m);
  const glm::dvec2 cuboid(s.cuboid_m[0], s.cuboid_m[1]);
  const glm::dvec2 wide(s.platform_wide_m), narrow(s.platform_narrow_m);
  write_platform(files, "cuboid", s, cuboid, cuboid);
  write_platform(files, "platform_upright", s, wide, narrow);
  write_platform(files, "platform_inverted", s, narrow, wide);
  if (!(s.angle_wing_m < s.angle_side_m)) {
    throw CLI::ValidationError("--l-wing", "expected less than --l-side, " + decimal(s.angle_side_m) + " m, found " +
                                               decimal(s.angle_wing_m) + " m");
  }
  write_l_building(files, s);
  write_street(files, s);
  return files;
}

std::string content(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

/// Number of files in `folder` that differ from what would be written.
int n_differing(const Files& files, const std::filesystem::path& folder) {
  int count = 0;
  for (const auto& [name, text] : files) {
    if (content(folder / name) == text) continue;
    std::fprintf(stderr, "%s: differs from what sar_make_scenes writes; run it again\n",
                 (folder / name).c_str());
    ++count;
  }
  return count;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Writes the scenes of the paper, an L-shaped building and a street as OBJ meshes with JSON scenes.");
  Sizes sizes;
  std::string folder = ".";
  bool check = false;
  app.add_option("folder", folder, "Where to write")->capture_default_str();
  app.add_flag("--check", check, "Write nothing; fail when a file of the folder differs");
  app.add_option("--building-length", sizes.building_length_m,
                 "Length of the buildings along X (m)")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--buildings", sizes.buildings, "Buildings as WIDTHxHEIGHT (m)")
      ->capture_default_str();
  app.add_option("--coinciding-incidence", sizes.coinciding_incidence_deg,
                 "Incidence at which wall and roof of the fourth building coincide (deg)")
      ->check(CLI::Range(1.0, 89.0))
      ->capture_default_str();
  app.add_option("--coinciding-height", sizes.coinciding_height_m, "Height of that building (m)")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--cuboid", sizes.cuboid_m, "Sides of the cuboid along X and Z (m)")
      ->expected(2)
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--platform-wide", sizes.platform_wide_m, "Wide side of the platforms (m)")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--platform-narrow", sizes.platform_narrow_m, "Narrow side of the platforms (m)")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--height", sizes.height_m, "Height of cuboid and platforms (m)")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--l-side", sizes.angle_side_m, "Side of the square around the L-shaped building (m)")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--l-wing", sizes.angle_wing_m, "Width of its wings (m)")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--l-height", sizes.angle_height_m, "Its height (m)")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--checker-period", sizes.checker_period_m,
                 "Side of a square of their texture (m)")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--checker-contrast", sizes.checker_contrast, "Contrast of their texture")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str();
  app.add_option("--exponent", sizes.exponent, "Exponent of their brightness")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  app.add_option("--houses", sizes.n_houses, "Houses of the street")
      ->check(CLI::Range(1u, 1000u))
      ->capture_default_str();
  app.add_option("--crown-faces", sizes.crown_faces, "Faces around a tree's crown, an even number")
      ->check(CLI::Range(6u, 1000u))
      ->capture_default_str();
  try {
    app.parse(argc, argv);
    const Files files = make_files(sizes);
    if (check) return n_differing(files, folder) == 0 ? 0 : 1;
    for (const auto& [name, text] : files) {
      std::ofstream file(std::filesystem::path(folder) / name, std::ios::binary);
      file << text;
      if (!file.flush()) {
        std::fprintf(stderr, "%s/%s: cannot be written\n", folder.c_str(), name.c_str());
        return 1;
      }
    }
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  return 0;
}

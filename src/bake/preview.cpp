// SPDX-License-Identifier: Apache-2.0
// Labels are four words and a few numbers: a font of dots makes a library for text unnecessary.
#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "sarnerf/bake/surface_mesh.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/image.h"
#include "sarnerf/core/numbers.h"
#include "sarnerf/core/parallel.h"
#include "sarnerf/dataset/image_file.h"
#include "sarnerf/geometry/acquisition.h"
#include "sarnerf/trace/ray_tracer.h"

namespace sarnerf {

namespace {

/// A letter is 5 × 7 dots, and 6 dots from the next.
constexpr int kLetterHeight = 7, kLetterPitch = 6;

struct Letter {
  char character;
  std::array<std::string_view, kLetterHeight> lines;
};

// clang-format off
constexpr Letter kLetters[] = {
    {'0', {" ### ", "#   #", "#   #", "#   #", "#   #", "#   #", " ### "}},
    {'1', {"  #  ", " ##  ", "  #  ", "  #  ", "  #  ", "  #  ", " ### "}},
    {'2', {" ### ", "#   #", "    #", "   # ", "  #  ", " #   ", "#####"}},
    {'5', {"#####", "#    ", "#### ", "    #", "    #", "#   #", " ### "}},
    {'.', {"     ", "     ", "     ", "     ", "     ", " ##  ", " ##  "}},
    {'a', {"     ", "     ", " ### ", "    #", " ####", "#   #", " ####"}},
    {'b', {"#    ", "#    ", "#### ", "#   #", "#   #", "#   #", "#### "}},
    {'d', {"    #", "    #", " ####", "#   #", "#   #", "#   #", " ####"}},
    {'e', {"     ", "     ", " ### ", "#   #", "#####", "#    ", " ### "}},
    {'f', {"  ## ", " #   ", "#### ", " #   ", " #   ", " #   ", " #   "}},
    {'i', {"  #  ", "     ", " ##  ", "  #  ", "  #  ", "  #  ", " ### "}},
    {'l', {" ##  ", "  #  ", "  #  ", "  #  ", "  #  ", "  #  ", " ### "}},
    {'m', {"     ", "     ", "## # ", "# # #", "# # #", "# # #", "# # #"}},
    {'n', {"     ", "     ", "#### ", "#   #", "#   #", "#   #", "#   #"}},
    {'o', {"     ", "     ", " ### ", "#   #", "#   #", "#   #", " ### "}},
    {'q', {"     ", " ####", "#   #", "#   #", " ####", "    #", "    #"}},
    {'r', {"     ", "     ", "# ## ", "##   ", "#    ", "#    ", "#    "}},
    {'s', {"     ", "     ", " ####", "#    ", " ### ", "    #", "#### "}},
    {'t', {" #   ", " #   ", "#### ", " #   ", " #   ", " #   ", "  ## "}},
    {'u', {"     ", "     ", "#   #", "#   #", "#   #", "#  ##", " ## #"}},
    {'v', {"     ", "     ", "#   #", "#   #", "#   #", " # # ", "  #  "}},
    {'X', {"#   #", "#   #", " # # ", "  #  ", " # # ", "#   #", "#   #"}},
    {'Y', {"#   #", "#   #", " # # ", "  #  ", "  #  ", "  #  ", "  #  "}},
    {'Z', {"#####", "    #", "   # ", "  #  ", " #   ", "#    ", "#####"}},
};
// clang-format on

/// Writes the letters, digits and full stops that previews need, each dot `scale` pixels square, with the first one's
/// upper left corner at (line, column); other characters are blanks. Pixels beyond the picture are skipped.
void draw_text(Image<Colour>& picture, int line, int column, std::string_view text, int scale, const Colour& colour) {
  for (std::size_t n = 0; n < text.size(); ++n) {
    const auto letter = std::find_if(std::begin(kLetters), std::end(kLetters),
                                     [&](const Letter& l) { return l.character == text[n]; });
    if (letter == std::end(kLetters)) continue;
    const int left = column + static_cast<int>(n) * kLetterPitch * scale;
    for (int i = 0; i < kLetterHeight * scale; ++i) {
      const std::string_view dots = letter->lines[static_cast<std::size_t>(i / scale)];
      for (int j = 0; j < static_cast<int>(dots.size()) * scale; ++j) {
        const int at_line = line + i, at_column = left + j;
        const bool inside =
            at_line >= 0 && at_line < picture.n_azimuth() && at_column >= 0 && at_column < picture.n_range();
        if (inside && dots[static_cast<std::size_t>(j / scale)] == '#') picture(at_line, at_column) = colour;
      }
    }
  }
}

constexpr int kRaysPerSide = 2;  ///< of a pixel
constexpr int kLeastSide = 200, kLargestSide = 16384;

/// Room for labels above and below the surface in a frame, in dots of the font.
constexpr int kLabelsAbove = 16, kLabelsBelow = 30;
constexpr int kMargin = 6;  ///< distance of labels from their frame, in dots

constexpr glm::dvec3 kWhite(255.0), kFront(124.0, 152.0, 186.0), kBack(205.0, 60.0, 50.0);
constexpr Colour kFrameColour = {205, 205, 205}, kTextColour = {70, 70, 70};
constexpr std::array<Colour, 3> kAxisColours = {{{200, 40, 40}, {40, 140, 40}, {40, 70, 200}}};
constexpr std::array<std::string_view, 3> kAxisNames = {"X", "Y", "Z"};

/// Pixels of a part of the picture.
struct Frame {
  int top = 0, left = 0, height = 0, width = 0;
};

/// An orthographic camera: unit vectors, right-handed.
struct Camera {
  std::string_view name;
  glm::dvec3 right, up, towards;  ///< `towards` leads from the surface to the viewer
};

/// A camera's picture. The centre of what it sees is drawn at the centre of its frame, without the room for labels.
struct View {
  Camera camera;
  Frame frame;
  Box seen_m;  ///< of the surface, along right, up and towards
  double pixel_m = 1.0;
  int dot = 1;  ///< pixels of a dot of the font

  double middle_line() const { return 0.5 * (frame.height + (kLabelsAbove - kLabelsBelow) * dot); }
};

/// The surface relative to the centre of its box, in float32; with one more vertex, which RayTracer needs.
struct Model {
  std::vector<glm::vec3> vertices_m;
  std::span<const glm::uvec3> triangles;

  explicit Model(const SurfaceMesh& mesh) : triangles(mesh.triangles) {
    Box box;
    for (const glm::dvec3& v : mesh.vertices_m) box.include(v);
    vertices_m.reserve(mesh.vertices_m.size() + 1);
    for (const glm::dvec3& v : mesh.vertices_m) vertices_m.emplace_back(v - box.centre());
    vertices_m.emplace_back(0.0f);
  }
  std::span<const glm::vec3> vertices() const { return std::span(vertices_m).first(vertices_m.size() - 1); }
};

Camera oblique_camera(const PreviewOptions& options) {
  const double sa = std::sin(options.azimuth_rad), ca = std::cos(options.azimuth_rad);
  const double se = std::sin(options.elevation_rad), ce = std::cos(options.elevation_rad);
  return {"oblique", {ca, 0.0, -sa}, {-sa * se, ce, -ca * se}, {sa * ce, se, ca * ce}};
}

Box seen_by(const Camera& camera, const Model& model) {
  Box seen;
  for (const glm::vec3& vertex : model.vertices()) {
    const glm::dvec3 v(vertex);
    seen.include({glm::dot(camera.right, v), glm::dot(camera.up, v), glm::dot(camera.towards, v)});
  }
  return seen;
}

/// The smallest pixel (m) at which the whole surface fits and labels have room.
double fitting_pixel_m(const View& view) {
  const glm::dvec3 size = view.seen_m.size();
  return std::max(size.x / (view.frame.width - 4 * kMargin * view.dot),
                  size.y / (view.frame.height - (kLabelsAbove + kLabelsBelow) * view.dot));
}

std::array<View, 4> layout(const Model& model, const PreviewOptions& options) {
  const int narrow = options.width * 3 / 10, wide = options.width - narrow, third = options.height / 3;
  std::array<View, 4> views = {{
      {oblique_camera(options), {0, 0, options.height, wide}, {}},
      {{"above", {1, 0, 0}, {0, 0, -1}, {0, 1, 0}}, {0, wide, third, narrow}, {}},
      {{"front", {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {third, wide, third, narrow}, {}},
      {{"side", {0, 0, -1}, {0, 1, 0}, {1, 0, 0}}, {2 * third, wide, options.height - 2 * third, narrow}, {}},
  }};
  double shared_m = 0.0;
  for (View& view : views) {
    view.dot = std::max(1, std::min(options.width / 600, options.height / 450));
    view.seen_m = seen_by(view.camera, model);
    view.pixel_m = fitting_pixel_m(view);
    if (&view != &views[0]) shared_m = std::max(shared_m, view.pixel_m);
  }
  for (std::size_t n = 1; n < views.size(); ++n) views[n].pixel_m = shared_m;
  return views;
}

/// Colour of a facet, `depth` from 0 at the nearest point of the surface to 1 at the farthest.
glm::dvec3 shade(const Camera& camera, glm::dvec3 normal, double depth) {
  const bool from_behind = glm::dot(normal, camera.towards) < 0.0;
  if (from_behind) normal = -normal;
  const glm::dvec3 light = glm::normalize(-0.45 * camera.right + 0.65 * camera.up + 0.75 * camera.towards);
  constexpr double kAmbient = 0.46, kPalest = 0.35;
  // The ambient light is stronger from the sky than from the ground.
  const double light_seen = kAmbient * (1.0 + 0.25 * normal.y) + 0.72 * std::max(0.0, glm::dot(normal, light));
  return glm::mix(glm::min(light_seen * (from_behind ? kBack : kFront), kWhite), kWhite, kPalest * depth);
}

/// Rays of one row, and their hits.
struct RayBlock {
  explicit RayBlock(std::size_t n_rays) {
    for (auto& array : arrays) array.resize(n_rays);
    triangle.resize(n_rays);
  }
  std::array<std::vector<float>, 10> arrays;  ///< origin, direction, distance, normal
  std::vector<std::uint32_t> triangle;
};

/// Draws picture lines [first, last) of a view, at most as many as fit one block of the tracer.
void draw_lines(const View& view, const RayTracer& tracer, int first, int last, Image<Colour>& picture) {
  const Camera& c = view.camera;
  const Frame& f = view.frame;
  const glm::dvec3 middle_m = view.seen_m.centre(), size_m = view.seen_m.size();
  // Rays begin in front of the nearest point, by more than the rounding of float32.
  const double start_m = view.seen_m.max.z + 0.01 * (size_m.x + size_m.y + size_m.z);
  const auto n_rays = static_cast<std::size_t>(f.width * kRaysPerSide);
  std::vector<RayBlock> blocks;
  std::vector<RayRow> rays;
  std::vector<HitRow> hits;
  const int n_rows = (last - first) * kRaysPerSide;
  for (int s = 0; s < n_rows; ++s) blocks.emplace_back(n_rays);
  for (int s = 0; s < n_rows; ++s) {
    auto& [a, triangle] = blocks[static_cast<std::size_t>(s)];
    const double y_m = middle_m.y - view.pixel_m * (first + (s + 0.5) / kRaysPerSide - view.middle_line());
    for (std::size_t n = 0; n < n_rays; ++n) {
      const double x_m = middle_m.x + view.pixel_m * ((static_cast<double>(n) + 0.5) / kRaysPerSide - 0.5 * f.width);
      const glm::vec3 origin(c.right * x_m + c.up * y_m + c.towards * start_m), direction(-c.towards);
      for (int axis = 0; axis < 3; ++axis) {
        a[static_cast<std::size_t>(axis)][n] = origin[axis];
        a[static_cast<std::size_t>(3 + axis)][n] = direction[axis];
      }
    }
    const auto far_m = static_cast<float>(2.0 * (start_m - view.seen_m.min.z));
    rays.push_back({a[0], a[1], a[2], a[3], a[4], a[5], far_m});
    hits.push_back({a[6], a[7], a[8], a[9], triangle});
  }
  tracer.first_hits(rays, hits);

  const auto colour_of = [&](const HitRow& hit, std::size_t n) {
    if (hit.triangle[n] == kNoTriangle) return kWhite;
    const glm::dvec3 normal(hit.normal_x[n], hit.normal_y[n], hit.normal_z[n]);
    const double depth_m = view.seen_m.max.z - (start_m - double{hit.distance_m[n]});
    const double depth = std::clamp(depth_m / std::max(size_m.z, 1e-30), 0.0, 1.0);
    return shade(c, normal / std::max(glm::length(normal), 1e-30), depth);
  };
  for (int i = first; i < last; ++i) {
    for (int j = 0; j < f.width; ++j) {
      glm::dvec3 sum(0.0);
      for (int n = 0; n < kRaysPerSide * kRaysPerSide; ++n)
        sum += colour_of(hits[static_cast<std::size_t>((i - first) * kRaysPerSide + n / kRaysPerSide)],
                         static_cast<std::size_t>(j * kRaysPerSide + n % kRaysPerSide));
      for (int channel = 0; channel < 3; ++channel)
        picture(f.top + i, f.left + j)[static_cast<std::size_t>(channel)] =
            static_cast<std::uint8_t>(std::lround(sum[channel] / (kRaysPerSide * kRaysPerSide)));
    }
  }
}

void draw_view(const View& view, const RayTracer& tracer, Image<Colour>& picture) {
  constexpr int kLines = static_cast<int>(RayTracer::kRowsPerBlock) / kRaysPerSide;
  const int n_blocks = (view.frame.height + kLines - 1) / kLines;
  parallel_for(static_cast<std::size_t>(n_blocks), 4, [&](std::size_t begin, std::size_t end, int) {
    for (auto block = static_cast<int>(begin); block < static_cast<int>(end); ++block)
      draw_lines(view, tracer, block * kLines, std::min(block * kLines + kLines, view.frame.height), picture);
  });
}

/// A straight line, `thickness` pixels square at each step.
void draw_line(Image<Colour>& picture, glm::dvec2 from, glm::dvec2 to, int thickness, const Colour& colour) {
  const int n = 1 + static_cast<int>(glm::length(to - from));
  for (int s = 0; s <= n; ++s) {
    const glm::dvec2 at = glm::mix(from, to, static_cast<double>(s) / n);
    for (int p = 0; p < thickness * thickness; ++p) {
      const int i = static_cast<int>(std::lround(at.y)) + p / thickness;
      const int j = static_cast<int>(std::lround(at.x)) + p % thickness;
      if (i >= 0 && i < picture.n_azimuth() && j >= 0 && j < picture.n_range()) picture(i, j) = colour;
    }
  }
}

/// Arrows along the axes, into the lower left corner of the view's frame.
void draw_axes(const View& view, Image<Colour>& picture) {
  const int dot = view.dot;
  const glm::dvec2 half_letter = 0.5 * dot * glm::dvec2(kLetterPitch - 1, kLetterHeight);
  std::array<glm::dvec2, 3> arrow, letter;  // from the origin, in pixels; y runs down
  glm::dvec2 least(0.0), most(0.0);
  for (int axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<std::size_t>(axis);
    arrow[a] = 14.0 * dot * glm::dvec2(view.camera.right[axis], -view.camera.up[axis]);
    const double length = glm::length(arrow[a]);
    if (length < dot) continue;  // towards the viewer
    letter[a] = arrow[a] * (1.0 + 6.0 * dot / length);
    least = glm::min(least, letter[a] - half_letter);
    most = glm::max(most, letter[a] + half_letter);
  }
  const Frame& f = view.frame;
  const glm::dvec2 origin(f.left + kMargin * dot - least.x, f.top + f.height - kMargin * dot - most.y);
  for (std::size_t a = 0; a < 3; ++a) {
    if (glm::length(arrow[a]) < dot) continue;
    draw_line(picture, origin, origin + arrow[a], dot, kAxisColours[a]);
    const glm::dvec2 corner = glm::round(origin + letter[a] - half_letter);
    draw_text(picture, static_cast<int>(corner.y), static_cast<int>(corner.x), kAxisNames[a], dot, kAxisColours[a]);
  }
}

/// The view's name, its axes and a scale bar, in the corners of its frame.
void draw_labels(const View& view, Image<Colour>& picture) {
  const Frame& f = view.frame;
  const int dot = view.dot, margin = kMargin * dot;
  draw_text(picture, f.top + margin, f.left + margin, view.camera.name, dot, kTextColour);
  draw_axes(view, picture);

  const RoundNumber length_m = round_below(0.3 * f.width * view.pixel_m);
  const std::string text = length_m.text() + " m";
  const double bar = length_m.value() / view.pixel_m, right = f.left + f.width - margin, tick = 2.0 * dot;
  const double line = f.top + f.height - margin - tick;
  draw_line(picture, {right - bar, line}, {right, line}, dot, kTextColour);
  for (const double x : {right - bar, right}) draw_line(picture, {x, line - tick}, {x, line + tick}, dot, kTextColour);
  const int text_width = (static_cast<int>(text.size()) * kLetterPitch - 1) * dot;
  const int text_line = static_cast<int>(line - tick) - (kLetterHeight + 2) * dot;
  draw_text(picture, text_line, static_cast<int>(right) - text_width, text, dot, kTextColour);
}

}  // namespace

Image<Colour> preview(const SurfaceMesh& mesh, const PreviewOptions& options) {
  const auto [least, most] = std::minmax(options.width, options.height);
  if (least < kLeastSide || most > kLargestSide) {
    throw UsageError("preview: expected 200 to 16384 pixels a side, found " + std::to_string(options.width) + " x " +
                     std::to_string(options.height));
  }
  if (!std::isfinite(options.azimuth_rad) || !std::isfinite(options.elevation_rad))
    throw UsageError("preview: expected finite angles of the oblique view; give azimuth and elevation anew");
  Image<Colour> picture(options.height, options.width, Colour{255, 255, 255});
  if (mesh.triangles.empty()) return picture;
  const Model model(mesh);
  const RayTracer tracer(model.vertices(), model.triangles);
  const std::array<View, 4> views = layout(model, options);
  if (!(views[0].pixel_m > 0.0)) return picture;  // all vertices coincide
  for (const View& view : views) {
    draw_view(view, tracer, picture);
    draw_labels(view, picture);
  }
  const auto left = static_cast<double>(views[1].frame.left);
  draw_line(picture, {left, 0.0}, {left, options.height - 1.0}, 1, kFrameColour);
  for (const std::size_t n : {2u, 3u}) {
    const auto top = static_cast<double>(views[n].frame.top);
    draw_line(picture, {left, top}, {options.width - 1.0, top}, 1, kFrameColour);
  }
  return picture;
}

}  // namespace sarnerf

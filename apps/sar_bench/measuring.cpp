// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include <sys/wait.h>

#include "app_main.h"
#include "revision.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/parallel.h"
#include "sarnerf/core/units.h"
#include "sarnerf/mpa/integrate.h"
#include "sarnerf/render/framing.h"
#include "studies.h"

namespace sarnerf::bench {

namespace {

std::string processor() {
  std::ifstream info("/proc/cpuinfo");
  for (std::string line; std::getline(info, line);) {
    if (line.rfind("model name", 0) == 0) return line.substr(line.find(':') + 2);
  }
  return "unknown";
}

}  // namespace

nlohmann::json environment() {
  return {{"processor", processor()},
          {"instruction_set", name(best_instruction_set())},
          {"threads", default_thread_count()},
          {"compiler", SARNERF_COMPILER},
          {"build_type", SARNERF_BUILD_TYPE},
          {"revision", SARNERF_REVISION}};
}

namespace {

/// Four significant digits: more would be noise.
double rounded(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.4g", value);
  return std::strtod(text, nullptr);
}

nlohmann::json spread(const Timing& t, double factor) {
  return {{"median", rounded(t.median() * factor)},
          {"quartiles", {rounded(t.quantile(0.25) * factor), rounded(t.quantile(0.75) * factor)}},
          {"runs", t.seconds.size()}};
}

Timing ratios(const Timing& a, const Timing& b) {
  Timing of_pairs;
  for (std::size_t n = 0; n < a.seconds.size(); ++n) of_pairs.seconds.push_back(a.seconds[n] / b.seconds[n]);
  return of_pairs;
}

}  // namespace

double Timing::quantile(double q) const {
  std::vector<double> sorted = seconds;
  std::sort(sorted.begin(), sorted.end());
  const double position = q * static_cast<double>(sorted.size() - 1);
  const auto below = static_cast<std::size_t>(position);
  const std::size_t above = std::min(below + 1, sorted.size() - 1);
  return std::lerp(sorted[below], sorted[above], position - std::floor(position));
}

std::vector<Timing> run_in_turn(const std::vector<std::function<void()>>& contenders, int rounds) {
  std::vector<Timing> timings(contenders.size());
  for (int round = -1; round < rounds; ++round) {
    for (std::size_t c = 0; c < contenders.size(); ++c) {
      const auto start = std::chrono::steady_clock::now();
      contenders[c]();
      const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start;
      if (round >= 0) timings[c].seconds.push_back(elapsed.count());
    }
  }
  return timings;
}

double ratio(const Timing& a, const Timing& b) { return ratios(a, b).median(); }

nlohmann::json ratio_json(const Timing& a, const Timing& b) { return spread(ratios(a, b), 1.0); }

nlohmann::json nanoseconds_json(const Timing& timing, double count) {
  return spread(timing, 1e9 / count);
}

std::vector<NamedScene> load_scenes(const StudyOptions& options) {
  std::vector<NamedScene> scenes;
  for (const std::string& file : options.scene_files) {
    scenes.push_back({std::filesystem::path(file).stem().string(), load_scene(file, options.load)});
  }
  if (scenes.empty()) {
    scenes.push_back({"sphere-1k", bumpy_sphere(1'000, 8.0)});
    scenes.push_back({"sphere-100k", bumpy_sphere(100'000, 8.0)});
  }
  return scenes;
}

Acquisition standard_view(const Scene& scene, const StudyOptions& options) {
  Acquisition a;
  a.azimuth_rad = rad_from_deg(options.azimuth_deg);
  a.incidence_rad = rad_from_deg(options.pitch_deg);
  a.slant_range_m = slant_range_from_altitude_m(10'000.0, a.incidence_rad);
  a.aim_m = default_aim_m(scene);
  a.n_azimuth = a.n_range = options.size;
  a.azimuth_spacing_m = a.range_spacing_m = options.spacing_m;
  return a;
}

namespace {

glm::dvec3 surface_point(double polar, double azimuth, double radius_m) {
  const double bumps = 1.0 + 0.06 * std::sin(7.0 * polar) * std::cos(9.0 * azimuth) +
                       0.02 * std::sin(31.0 * polar) * std::cos(28.0 * azimuth);
  return radius_m * (glm::dvec3(0.0, 1.1, 0.0) +
                     bumps * glm::dvec3(std::sin(polar) * std::cos(azimuth), std::cos(polar),
                                        std::sin(polar) * std::sin(azimuth)));
}

}  // namespace

Scene bumpy_sphere(std::uint64_t n_triangles, double radius_m) {
  Scene scene;
  scene.materials.emplace_back();
  scene.objects.push_back({"sphere", glm::dmat4(1.0)});
  scene.groups.emplace_back("sphere");
  scene.pieces.push_back({true, 0});

  // n rings of 2n points and the poles: about 4 n² triangles.
  const auto n_rings = static_cast<std::uint32_t>(std::sqrt(double(n_triangles) / 4.0));
  const std::uint32_t n_around = 2 * n_rings;
  Mesh& mesh = scene.mesh;
  for (std::uint32_t ring = 1; ring <= n_rings; ++ring) {
    for (std::uint32_t point = 0; point < n_around; ++point) {
      mesh.vertices_m.push_back(surface_point(kPi * ring / (n_rings + 1.0),
                                              2.0 * kPi * point / n_around, radius_m));
    }
  }
  const auto top = static_cast<std::uint32_t>(mesh.vertices_m.size());
  mesh.vertices_m.push_back(surface_point(0.0, 0.0, radius_m));
  mesh.vertices_m.push_back(surface_point(kPi, 0.0, radius_m));
  const auto at = [&](std::uint32_t ring, std::uint32_t point) {
    return ring * n_around + point % n_around;
  };
  for (std::uint32_t point = 0; point < n_around; ++point) {
    mesh.triangles.emplace_back(top, at(0, point + 1), at(0, point));
    mesh.triangles.emplace_back(top + 1, at(n_rings - 1, point), at(n_rings - 1, point + 1));
    for (std::uint32_t ring = 0; ring + 1 < n_rings; ++ring) {
      mesh.triangles.emplace_back(at(ring, point), at(ring, point + 1), at(ring + 1, point));
      mesh.triangles.emplace_back(at(ring, point + 1), at(ring + 1, point + 1), at(ring + 1, point));
    }
  }
  mesh.material.assign(mesh.triangles.size(), 0);
  mesh.piece.assign(mesh.triangles.size(), 0);
  mesh.group.assign(mesh.triangles.size(), 0);
  for (const glm::dvec3& v : mesh.vertices_m) scene.box.include(v);
  return scene;
}

std::filesystem::path program_beside(const std::string& name) {
  namespace fs = std::filesystem;
  const fs::path here = fs::read_symlink("/proc/self/exe").parent_path();
  for (const fs::path& place : {here / name, here / ".." / name / name})
    if (fs::is_regular_file(place)) return fs::weakly_canonical(place);
  throw Error(name + " is not beside sar_bench in " + here.string() + ": build it, or install both");
}

std::string quoted(const std::string& word) {
  std::string text = "'";
  for (const char c : word) text += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return text + "'";
}

int run_beside(const std::string& name, const std::vector<std::string>& arguments) {
  std::string line = quoted(program_beside(name).string());
  for (const std::string& argument : arguments) line += " " + quoted(argument);
  const int status = std::system((line + " > /dev/null").c_str());
  if (status == -1) throw Error(name + " could not be started");
  const int code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  if (code == app::kInterrupted) throw Interrupted("interrupted; what had ended is on disk");
  return code;
}

}  // namespace sarnerf::bench

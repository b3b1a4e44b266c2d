// SPDX-License-Identifier: Apache-2.0
#include "formation.h"

#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>

namespace sarnerf::app {
namespace {

ImpulseResponse response_of(const Options& o) {
  return impulse_response(o.formation, o.spacing_m.first, o.spacing_m.second);
}

}  // namespace

Border border_of(const Options& o) {
  if (!o.formation.resolution_m) return {};
  return border_of(response_of(o), o.size->first, o.size->second);
}

Json formation_request(const ImageFormation& f) {
  Json j;
  if (f.resolution_m) {
    j["resolution_m"] = {f.resolution_m->first, f.resolution_m->second};
    j["window"] = text_of(f.window);
  }
  if (f.speckle()) j["looks"] = f.looks;
  if (f.nesz_db) j["nesz_db"] = *f.nesz_db;
  if (f.speckle()) j["seed"] = f.seed;
  return j;
}

Json formation_resolved(const Options& o, const Border& border) {
  const ImpulseResponse response = response_of(o);
  const Taper taper(o.formation.window);
  return {{"bandwidth_per_m", {response.azimuth.bandwidth_per_m, response.range.bandwidth_per_m}},
          {"broadening", taper.broadening()},
          {"peak_sidelobe_db", taper.peak_sidelobe_db()},
          {"reach_pixels", {response.azimuth.reach(), response.range.reach()}},
          {"border_pixels", {border.azimuth, border.range}}};
}

std::vector<std::string> formation_lines(const Options& o, const Border& border) {
  const ImageFormation& f = o.formation;
  std::vector<std::string> lines;
  char text[320];
  if (f.resolution_m) {
    const ImpulseResponse response = response_of(o);
    const Taper taper(f.window);
    std::snprintf(text, sizeof text, "resolution %.6g x %.6g m (azimuth x range), window %s: highest sidelobe %.1f dB",
                  f.resolution_m->first, f.resolution_m->second, text_of(f.window).c_str(),
                  taper.peak_sidelobe_db());
    lines.push_back(text);
    std::snprintf(text, sizeof text,
                  "band %.4g x %.4g cycles/m, %.3g x %.3g of what the spacing holds; taps to %d x %d pixels",
                  response.azimuth.bandwidth_per_m, response.range.bandwidth_per_m,
                  response.azimuth.bandwidth_per_m * o.spacing_m.first,
                  response.range.bandwidth_per_m * o.spacing_m.second, response.azimuth.reach(),
                  response.range.reach());
    lines.push_back(text);
    std::snprintf(text, sizeof text,
                  "%d x %d pixels more are rendered on every side, for what leaks in from there, and cut off",
                  border.azimuth, border.range);
    lines.push_back(text);
  }
  if (f.speckle()) {
    std::snprintf(text, sizeof text, "speckle of %.6g look%s of the full resolution, %s; seed %llu", f.looks,
                  f.looks == 1.0 ? "" : "s",
                  f.resolution_m ? "correlated by the impulse response" : "independent from pixel to pixel",
                  static_cast<unsigned long long>(f.seed));
    lines.push_back(text);
  }
  if (f.nesz_db) {
    std::snprintf(text, sizeof text, "noise of %.6g dB in sigma0, %s", *f.nesz_db,
                  f.speckle() ? "speckle of its own" : "its mean is added");
    lines.push_back(text);
  }
  return lines;
}

std::string formation_left_out(const ImageFormation& f) {
  std::string unused;
  const auto add = [&](bool used, const char* what) {
    if (!used) unused += (unused.empty() ? "" : ", ") + std::string(what);
  };
  add(f.resolution_m.has_value(), "impulse response");
  add(f.speckle(), "speckle");
  add(f.nesz_db.has_value(), "noise");
  return unused.empty() ? unused : unused + ": not asked for";
}

}  // namespace sarnerf::app

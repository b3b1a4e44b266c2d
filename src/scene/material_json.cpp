// SPDX-License-Identifier: Apache-2.0
#include "material_json.h"

#include "scene_checks.h"

namespace sarnerf {
namespace {

/// Finer than any surface is: what such squares show is their mean.
constexpr double kFinestPeriod_m = 1e-9;

/// Most extinction and scattering (1/m): beyond anything that exists, and sums over solids that overlap stay
/// within single precision's 3e38.
constexpr double kMost_per_m = 1e30;

Texture parse_texture(const JsonView& json) {
  json.only_keys({"kind", "period_m", "contrast", "origin_m"});
  Texture texture;
  const JsonView kind = json.at("kind");
  if (kind.text() == "none") {
    if (json.has("period_m") || json.has("contrast") || json.has("origin_m")) {
      json.fail("the kind \"none\" takes no other keys; remove them, or choose \"checker\"");
    }
    return texture;
  }
  if (kind.text() != "checker") kind.expected("\"none\" or \"checker\"");
  texture.kind = Texture::Kind::checker;
  texture.period_m = json.at("period_m").number_at_least(kFinestPeriod_m);
  const JsonView contrast = json.at("contrast");
  texture.contrast = contrast.number_at_least(0.0);
  if (texture.contrast > 1.0) contrast.expected("a number between 0 and 1");
  if (const auto origin = json.find("origin_m")) texture.origin_m = origin->vector_within(kFarthest_m);
  return texture;
}

Material parse_material(const std::string& name, const JsonView& json) {
  json.only_keys({"opaque", "gamma0", "exponent", "texture", "extinction_per_m",
                  "extinction_back_per_m", "scattering_per_m"});
  Material material;
  material.name = name;
  const bool has_volume = json.has("extinction_per_m") || json.has("extinction_back_per_m") ||
                          json.has("scattering_per_m");
  const auto opaque = json.find("opaque");
  material.opaque = opaque ? opaque->boolean() : !has_volume;

  if (material.opaque) {
    if (has_volume) {
      json.fail(
          "an opaque material takes gamma0, exponent and texture, not extinction or scattering; "
          "for a translucent one write \"opaque\": false and only the latter");
    }
    if (const auto gamma0 = json.find("gamma0")) material.gamma0 = gamma0->number_at_least(0.0);
    if (const auto p = json.find("exponent")) material.exponent = p->number_at_least(0.0);
    if (const auto texture = json.find("texture")) material.texture = parse_texture(*texture);
    return material;
  }

  for (const char* key : {"gamma0", "exponent", "texture"}) {
    if (json.has(key)) {
      json.fail(
          std::string("a translucent material takes extinction_per_m and scattering_per_m, not ") +
          key + "; remove it, or the extinction and scattering for an opaque material");
    }
  }
  material.extinction_per_m = json.at("extinction_per_m").number_between(0.0, kMost_per_m);
  material.extinction_back_per_m = material.extinction_per_m;
  if (const auto back = json.find("extinction_back_per_m")) {
    material.extinction_back_per_m = back->number_between(0.0, kMost_per_m);
  }
  if (const auto p = json.find("scattering_per_m")) {
    material.scattering_per_m = p->number_between(0.0, kMost_per_m);
  }
  return material;
}

}  // namespace

std::vector<Material> parse_materials(const JsonView& materials) {
  std::vector<Material> parsed;
  for (const auto& [name, json] : materials.members()) {
    if (name.empty()) materials.fail("a material needs a name, found \"\"");
    parsed.push_back(parse_material(name, json));
  }
  return parsed;
}

}  // namespace sarnerf

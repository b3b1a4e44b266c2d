// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/render/layers.h"

#include <limits>

#include "sarnerf/core/error.h"

namespace sarnerf {
namespace {

constexpr std::array<std::string_view, kNumberOfLayers> kNames{
    "ground", "wall", "roof", "other", "mask", "incidence", "elevation", "scatterers", "error"};

Layer layer_from_name(std::string_view word) {
  if (word == "all" || word == "none")
    throw UsageError("--layers: '" + std::string(word) + "' stands alone: give it without other names, or leave it out");
  std::string known;
  for (std::size_t n = 0; n < kNumberOfLayers; ++n) {
    if (word == kNames[n]) return static_cast<Layer>(n);
    known += (n > 0 ? ", " : "") + std::string(kNames[n]);
  }
  throw UsageError("--layers: expected all, none, or some of " + known + ", found '" + std::string(word) + "'");
}

}  // namespace

std::string_view name(Layer layer) { return kNames[static_cast<std::size_t>(layer)]; }

LayerSet all_layers() {
  LayerSet all;
  for (std::size_t n = 0; n < kNumberOfLayers; ++n) all.add(static_cast<Layer>(n));
  return all;
}

LayerSet layers_from_text(std::string_view text) {
  if (text == "all") return all_layers();
  LayerSet set;
  if (text == "none") return set;
  for (std::size_t begin = 0;;) {
    const std::size_t end = text.find(',', begin);
    set.add(layer_from_name(text.substr(begin, end - begin)));
    if (end == std::string_view::npos) return set;
    begin = end + 1;
  }
}

Layers::Layers(const LayerSet& layers, int n_azimuth, int n_range) : set(layers) {
  for (std::size_t n = 0; n < kNumberOfLayers; ++n) {
    const auto layer = static_cast<Layer>(n);
    if (layer == Layer::mask || !set.has(layer)) continue;
    const bool unknown = layer == Layer::incidence || layer == Layer::elevation || layer == Layer::error;
    values(layer) = Image<float>(n_azimuth, n_range, unknown ? std::numeric_limits<float>::quiet_NaN() : 0.0f);
  }
  if (set.has(Layer::mask)) mask = Image<std::uint8_t>(n_azimuth, n_range);
}

const Image<float>& Layers::values(Layer layer) const {
  switch (layer) {
    case Layer::incidence:
      return incidence_deg;
    case Layer::elevation:
      return elevation_m;
    case Layer::scatterers:
      return scatterers;
    case Layer::error:
      return error;
    case Layer::mask:
      throw UsageError("the mask is no layer of float values");
    default:
      return beta0[static_cast<std::size_t>(layer)];
  }
}

Image<float>& Layers::values(Layer layer) {
  return const_cast<Image<float>&>(static_cast<const Layers&>(*this).values(layer));
}

std::uint64_t bytes_per_pixel(const LayerSet& layers) {
  std::uint64_t bytes = 0;
  for (std::size_t n = 0; n < kNumberOfLayers; ++n) {
    const auto layer = static_cast<Layer>(n);
    if (layers.has(layer)) bytes += layer == Layer::mask ? sizeof(std::uint8_t) : sizeof(float);
  }
  return bytes;
}

}  // namespace sarnerf

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include "sarnerf/scene/scene.h"

namespace sarnerf {

/// What matter is a part of. Values are those of the `component` grid of a volume.
enum class Component : std::uint8_t { none = 0, ground = 1, wall = 2, roof = 3, other = 4 };

/// "none", "ground", "wall", "roof", "other".
std::string_view name(Component component);

/// The component that a name speaks of, as a whole word in any case: ground, floor, terrain, road, field,
/// pavement, street, grass, lawn, soil, sand, water | wall, facade, side | roof, top; none if it speaks of
/// none.
Component component_from_words(std::string_view words);

/// The component of each triangle: what its group's name says, else its material's; else a face that looks
/// up by more than 45° is roof and any other one wall. Translucent matter is other.
std::vector<Component> components_of_triangles(const Scene& scene);

}  // namespace sarnerf

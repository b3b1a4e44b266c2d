// SPDX-License-Identifier: Apache-2.0
#include "surface_scene.h"

#include "corner_reflector.h"

namespace sarnerf {
namespace {

std::vector<std::uint32_t> opaque_triangles(const Scene& scene) {
  std::vector<std::uint32_t> chosen;
  chosen.reserve(scene.mesh.triangles.size());
  for (std::uint32_t t = 0; t < scene.mesh.triangles.size(); ++t) {
    if (scene.materials[scene.mesh.material[t]].opaque) chosen.push_back(t);
  }
  return chosen;
}

std::size_t count_open_media(const Scene& scene) {
  std::size_t n = 0;
  for (std::size_t t = 0; t < scene.mesh.triangles.size(); ++t) {
    n += !scene.materials[scene.mesh.material[t]].opaque && !scene.pieces[scene.mesh.piece[t]].closed;
  }
  return n;
}

}  // namespace

SurfaceScene::SurfaceScene(const Scene& s)
    : scene(s), origin_m(s.box.empty() ? glm::dvec3(0.0) : s.box.centre()), media(s, origin_m) {
  const std::vector<std::uint32_t> chosen = opaque_triangles(s);
  appearances = make_appearances(s, chosen, origin_m);
  opaque = take_triangles(s.mesh, chosen, origin_m);
  tracer = std::make_unique<RayTracer>(vertices(opaque.vertices_m), opaque.triangles);
  if (std::string corners = corner_reflector_warning(s); !corners.empty()) {
    warnings.push_back(std::move(corners));
  }
  if (const std::size_t n = count_open_media(s); n > 0) {
    warnings.push_back(std::to_string(n) +
                       " translucent triangles bound no volume and have no effect: close the "
                       "mesh, or give it an opaque material");
  }
}

std::span<const Component> SurfaceScene::components() const {
  std::call_once(components_found_, [&] {
    const std::vector<Component> all = components_of_triangles(scene);
    for (const std::uint32_t t : opaque_triangles(scene)) components_.push_back(all[t]);
  });
  return components_;
}

std::uint64_t SurfaceScene::memory_bytes() const {
  return tracer->memory_bytes() + media.memory_bytes() + opaque.vertices_m.size() * sizeof(glm::vec3) +
         opaque.triangles.size() * (sizeof(glm::uvec3) + sizeof(std::uint16_t));
}

}  // namespace sarnerf

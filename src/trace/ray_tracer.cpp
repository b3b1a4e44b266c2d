// SPDX-License-Identifier: Apache-2.0
// Embree 4 replaced the intersection context by an arguments structure; these wrappers hide the
// difference. Nothing else in the project includes Embree.
#include "sarnerf/trace/ray_tracer.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cstring>
#include <limits>
#include <string>

#include "sarnerf/core/error.h"

#if __has_include(<embree4/rtcore.h>)
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

namespace sarnerf::embree {

#if RTC_VERSION_MAJOR >= 4

/// A query of many similar rays, without callbacks.
struct CoherentQuery {
  RTCIntersectArguments arguments;
  CoherentQuery() {
    rtcInitIntersectArguments(&arguments);
    arguments.flags = RTC_RAY_QUERY_FLAG_COHERENT;
  }
  void packet(const int* valid, RTCScene scene, RTCRayHit16* rays) {
    rtcIntersect16(valid, scene, rays, &arguments);
  }
  void single(RTCScene scene, RTCRayHit* ray) { rtcIntersect1(scene, ray, &arguments); }
};

/// Sets tfar to minus infinity when the ray meets anything.
inline void occluded(RTCScene scene, RTCRay* ray) {
  RTCOccludedArguments arguments;
  rtcInitOccludedArguments(&arguments);
  rtcOccluded1(scene, ray, &arguments);
}

/// A query that calls `filter` for every potential hit. The filter gets the context and finds `user` behind it.
struct FilteredQuery {
  RTCRayQueryContext context;
  void* user;
  explicit FilteredQuery(void* user_data) : user(user_data) { rtcInitRayQueryContext(&context); }
  void single(RTCScene scene, RTCRayHit* ray, RTCFilterFunctionN filter) {
    RTCIntersectArguments arguments;
    rtcInitIntersectArguments(&arguments);
    arguments.flags = static_cast<RTCRayQueryFlags>(RTC_RAY_QUERY_FLAG_INCOHERENT |
                                                    RTC_RAY_QUERY_FLAG_INVOKE_ARGUMENT_FILTER);
    arguments.context = &context;
    arguments.filter = filter;
    rtcIntersect1(scene, ray, &arguments);
  }
  static FilteredQuery& from(const RTCFilterFunctionNArguments* arguments) {
    return *reinterpret_cast<FilteredQuery*>(arguments->context);
  }
};

inline void enable_query_filters(RTCGeometry geometry) {
  rtcSetGeometryEnableFilterFunctionFromArguments(geometry, true);
}
inline constexpr RTCSceneFlags kQueryFilterSceneFlag = RTC_SCENE_FLAG_FILTER_FUNCTION_IN_ARGUMENTS;

#else

struct CoherentQuery {
  RTCIntersectContext context;
  CoherentQuery() {
    rtcInitIntersectContext(&context);
    context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  }
  void packet(const int* valid, RTCScene scene, RTCRayHit16* rays) {
    rtcIntersect16(valid, scene, &context, rays);
  }
  void single(RTCScene scene, RTCRayHit* ray) { rtcIntersect1(scene, &context, ray); }
};

inline void occluded(RTCScene scene, RTCRay* ray) {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcOccluded1(scene, &context, ray);
}

struct FilteredQuery {
  RTCIntersectContext context;
  void* user;
  explicit FilteredQuery(void* user_data) : user(user_data) {
    rtcInitIntersectContext(&context);
    context.flags = RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
  }
  void single(RTCScene scene, RTCRayHit* ray, RTCFilterFunctionN filter) {
    context.filter = filter;
    rtcIntersect1(scene, &context, ray);
  }
  static FilteredQuery& from(const RTCFilterFunctionNArguments* arguments) {
    return *reinterpret_cast<FilteredQuery*>(arguments->context);
  }
};

inline void enable_query_filters(RTCGeometry) {}
inline constexpr RTCSceneFlags kQueryFilterSceneFlag = RTC_SCENE_FLAG_CONTEXT_FILTER_FUNCTION;

#endif

}  // namespace sarnerf::embree

namespace sarnerf {

namespace {

constexpr std::size_t kPacket = 16;

/// Bytes that Embree reports through its memory monitor.
struct MemoryCount {
  std::atomic<std::int64_t> now{0};
  std::atomic<std::int64_t> peak{0};

  static bool monitor(void* self, ssize_t bytes, bool /*post*/) {
    auto& count = *static_cast<MemoryCount*>(self);
    const std::int64_t now = count.now.fetch_add(bytes) + bytes;
    std::int64_t peak = count.peak.load();
    while (now > peak && !count.peak.compare_exchange_weak(peak, now)) {
    }
    return true;
  }
};

void load(RTCRay& ray, const glm::vec3& origin_m, const glm::vec3& direction, float far_m) {
  ray.org_x = origin_m.x;
  ray.org_y = origin_m.y;
  ray.org_z = origin_m.z;
  ray.dir_x = direction.x;
  ray.dir_y = direction.y;
  ray.dir_z = direction.z;
  ray.tnear = 0.0f;
  ray.tfar = far_m;
  ray.time = 0.0f;
  ray.mask = ~0u;
  ray.id = 0;
  ray.flags = 0;
}

void load(RTCRayHit& rayhit, const RayRow& rays, std::size_t n) {
  load(rayhit.ray, {rays.origin_x[n], rays.origin_y[n], rays.origin_z[n]},
       {rays.direction_x[n], rays.direction_y[n], rays.direction_z[n]}, rays.far_m);
  rayhit.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  rayhit.hit.primID = RTC_INVALID_GEOMETRY_ID;
}

/// Embree's default for watertight queries is a BVH of width 4. Width 8 takes 5 to 20 % less time
/// (most on meshes finer than the ray spacing) and as much memory, but needs AVX.
const char* device_settings() {
#if defined(__x86_64__)
  if (__builtin_cpu_supports("avx2")) return "tri_accel=bvh8.triangle4v";
#endif
  return nullptr;
}

/// Records the hit and rejects it, so that the ray continues.
void record_and_continue(const RTCFilterFunctionNArguments* arguments) {
  auto& crossings =
      *static_cast<std::vector<Crossing>*>(embree::FilteredQuery::from(arguments).user);
  for (unsigned n = 0; n < arguments->N; ++n) {
    if (arguments->valid[n] == 0) continue;
    const RTCHit hit = rtcGetHitFromHitN(arguments->hit, arguments->N, n);
    crossings.push_back({RTCRayN_tfar(arguments->ray, arguments->N, n), hit.primID,
                         {hit.Ng_x, hit.Ng_y, hit.Ng_z}});
    arguments->valid[n] = 0;
  }
}

}  // namespace

struct RayTracer::State {
  MemoryCount memory;
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;

  ~State() {
    if (scene != nullptr) rtcReleaseScene(scene);
    if (device != nullptr) rtcReleaseDevice(device);
  }

  void require_success(const char* doing) const {
    const RTCError code = rtcGetDeviceError(device);
    if (code == RTC_ERROR_NONE) return;
    throw Error(std::string("Embree failed while ") + doing + ", error code " +
                std::to_string(static_cast<int>(code)) +
                (code == RTC_ERROR_OUT_OF_MEMORY ? " (out of memory: use a smaller mesh)" : ""));
  }
};

RayTracer::RayTracer(std::span<const glm::vec3> vertices_m, std::span<const glm::uvec3> triangles)
    : state_(std::make_unique<State>()) {
  state_->device = rtcNewDevice(device_settings());
  state_->require_success("starting");
  rtcSetDeviceMemoryMonitorFunction(state_->device, &MemoryCount::monitor, &state_->memory);

  state_->scene = rtcNewScene(state_->device);
  // Robust: a ray that leaks through a shared edge gives a wrong pixel.
  rtcSetSceneFlags(state_->scene, static_cast<RTCSceneFlags>(RTC_SCENE_FLAG_ROBUST |
                                                             embree::kQueryFilterSceneFlag));
  if (!triangles.empty()) {
    const RTCGeometry geometry = rtcNewGeometry(state_->device, RTC_GEOMETRY_TYPE_TRIANGLE);
    rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                               vertices_m.data(), 0, sizeof(glm::vec3), vertices_m.size());
    rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, triangles.data(),
                               0, sizeof(glm::uvec3), triangles.size());
    embree::enable_query_filters(geometry);
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(state_->scene, geometry);
    rtcReleaseGeometry(geometry);
  }
  rtcCommitScene(state_->scene);
  state_->require_success("building its acceleration structure");
}

RayTracer::~RayTracer() = default;

namespace {

/// Packets of `Rows` rows by 16 / Rows rays.
template <std::size_t Rows>
void trace_packets(RTCScene scene, std::span<const RayRow> rows, std::span<const HitRow> hits) {
  constexpr std::size_t kRays = kPacket / Rows;
  const std::size_t n_rays = rows[0].origin_x.size();
  embree::CoherentQuery query;
  alignas(64) RTCRayHit16 packet = {};
  alignas(64) int valid[kPacket];
  std::fill(std::begin(packet.ray.mask), std::end(packet.ray.mask), ~0u);
  std::fill(std::begin(packet.hit.instID[0]), std::end(packet.hit.instID[0]),
            RTC_INVALID_GEOMETRY_ID);

  for (std::size_t begin = 0; begin < n_rays; begin += kRays) {
    const std::size_t count = std::min(kRays, n_rays - begin);
    for (std::size_t r = 0; r < Rows; ++r) {
      const bool present = r < rows.size();
      const RayRow& row = rows[present ? r : 0];
      const auto fetch = [&](float* to, std::span<const float> from) {
        if (count == kRays) {
          std::memcpy(to + r * kRays, from.data() + begin, kRays * sizeof(float));
        } else {
          std::copy_n(from.data() + begin, count, to + r * kRays);
        }
      };
      fetch(packet.ray.org_x, row.origin_x);
      fetch(packet.ray.org_y, row.origin_y);
      fetch(packet.ray.org_z, row.origin_z);
      fetch(packet.ray.dir_x, row.direction_x);
      fetch(packet.ray.dir_y, row.direction_y);
      fetch(packet.ray.dir_z, row.direction_z);
      for (std::size_t n = 0; n < kRays; ++n) {
        valid[r * kRays + n] = present && n < count ? -1 : 0;
        packet.ray.tfar[r * kRays + n] = row.far_m;
      }
    }
    for (std::size_t lane = 0; lane < kPacket; ++lane) {
      packet.hit.geomID[lane] = RTC_INVALID_GEOMETRY_ID;
      packet.hit.primID[lane] = kNoTriangle;  // stays so for rays that miss
    }
    query.packet(valid, scene, &packet);

    for (std::size_t r = 0; r < rows.size(); ++r) {
      const auto store = [&](auto to, const auto* from) {
        if (count == kRays) {
          std::memcpy(to.data() + begin, from + r * kRays, kRays * sizeof(*from));
        } else {
          std::copy_n(from + r * kRays, count, to.data() + begin);
        }
      };
      store(hits[r].distance_m, packet.ray.tfar);
      store(hits[r].normal_x, packet.hit.Ng_x);
      store(hits[r].normal_y, packet.hit.Ng_y);
      store(hits[r].normal_z, packet.hit.Ng_z);
      store(hits[r].triangle, packet.hit.primID);
    }
  }
}

}  // namespace

void RayTracer::first_hits(std::span<const RayRow> rows, std::span<const HitRow> hits) const {
  switch (rows.size()) {
    case 0: return;
    case 1: return trace_packets<1>(state_->scene, rows, hits);
    case 2: return trace_packets<2>(state_->scene, rows, hits);
    case 3:
    case 4: return trace_packets<4>(state_->scene, rows, hits);
    default: return trace_packets<8>(state_->scene, rows, hits);
  }
}

void RayTracer::first_hits_one_by_one(const RayRow& rays, const HitRow& hits) const {
  embree::CoherentQuery query;
  RTCRayHit rayhit;
  std::fill(std::begin(rayhit.hit.instID), std::end(rayhit.hit.instID), RTC_INVALID_GEOMETRY_ID);
  for (std::size_t n = 0; n < rays.origin_x.size(); ++n) {
    load(rayhit, rays, n);
    query.single(state_->scene, &rayhit);
    hits.triangle[n] = rayhit.hit.primID;
    hits.distance_m[n] = rayhit.ray.tfar;
    hits.normal_x[n] = rayhit.hit.Ng_x;
    hits.normal_y[n] = rayhit.hit.Ng_y;
    hits.normal_z[n] = rayhit.hit.Ng_z;
  }
}

void RayTracer::all_hits(const glm::vec3& origin_m, const glm::vec3& direction, float far_m,
                         std::vector<Crossing>& crossings) const {
  crossings.clear();
  const RayRow one{{&origin_m.x, 1},  {&origin_m.y, 1},  {&origin_m.z, 1},
                   {&direction.x, 1}, {&direction.y, 1}, {&direction.z, 1},
                   far_m};
  RTCRayHit rayhit;
  std::fill(std::begin(rayhit.hit.instID), std::end(rayhit.hit.instID), RTC_INVALID_GEOMETRY_ID);
  load(rayhit, one, 0);
  embree::FilteredQuery query(&crossings);
  query.single(state_->scene, &rayhit, &record_and_continue);

  // Embree may report a triangle more than once, and not in order of distance.
  const auto before = [](const Crossing& a, const Crossing& b) {
    return a.distance_m != b.distance_m ? a.distance_m < b.distance_m : a.triangle < b.triangle;
  };
  std::sort(crossings.begin(), crossings.end(), before);
  const auto same = [](const Crossing& a, const Crossing& b) { return a.triangle == b.triangle; };
  crossings.erase(std::unique(crossings.begin(), crossings.end(), same), crossings.end());
}

bool RayTracer::meets_any(const glm::vec3& origin_m, const glm::vec3& direction, float far_m) const {
  RTCRay ray;
  load(ray, origin_m, direction, far_m);
  embree::occluded(state_->scene, &ray);
  return ray.tfar < 0.0f;
}

std::uint64_t RayTracer::memory_bytes() const {
  return static_cast<std::uint64_t>(state_->memory.now.load());
}
std::uint64_t RayTracer::peak_memory_bytes() const {
  return static_cast<std::uint64_t>(state_->memory.peak.load());
}

namespace {

/// Two triangles for each face. Corner n has the box's maximum along x, y, z if bit 0, 1, 2 of n is set.
constexpr std::array<std::array<unsigned, 3>, 12> kFaces{{{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6},
                                                          {0, 1, 5}, {0, 5, 4}, {2, 6, 7}, {2, 7, 3},
                                                          {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}}};

}  // namespace

BoxTracer::BoxTracer(std::span<const FloatBox> boxes) {
  vertices_m_.reserve(8 * boxes.size() + 1);
  triangles_.reserve(12 * boxes.size());
  for (const FloatBox& box : boxes) {
    const auto first = static_cast<unsigned>(vertices_m_.size());
    for (unsigned n = 0; n < 8; ++n) {
      vertices_m_.emplace_back(n & 1 ? box.max.x : box.min.x, n & 2 ? box.max.y : box.min.y,
                               n & 4 ? box.max.z : box.min.z);
    }
    for (const auto& face : kFaces) triangles_.emplace_back(first + face[0], first + face[1], first + face[2]);
  }
  vertices_m_.emplace_back(0.0f);  // RayTracer needs a readable element behind the end
  tracer_ = std::make_unique<RayTracer>(std::span(vertices_m_).first(vertices_m_.size() - 1), triangles_);
}

std::uint64_t BoxTracer::memory_bytes() const {
  return tracer_->memory_bytes() + vertices_m_.size() * sizeof(glm::vec3) +
         triangles_.size() * sizeof(glm::uvec3);
}

}  // namespace sarnerf

// SPDX-License-Identifier: Apache-2.0
#pragma once

// Embree 4 replaced the intersection context by an arguments structure; these wrappers hide which of
// the two is there. Nothing else in the project includes Embree.
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

/// A query whose every potential hit is shown to `filter`, with `user` behind the context.
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

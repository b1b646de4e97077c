#include "render/rays/round_geometry.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "geometry/round_crossings.h"

namespace pilesim {
namespace {

// The nearest place between `nearest` and `farthest` where a ray in the shape's frame meets a round
// surface, or infinity.
float meet_round(const RoundSurface& surface, const Vec3f& origin, const Vec3f& direction,
                 float nearest, float farthest) {
  float first = std::numeric_limits<float>::infinity();
  for (const double distance :
       crossings(surface, origin.cast<double>(), direction.cast<double>())) {
    const auto at = static_cast<float>(distance);
    if (at > nearest && at < farthest) first = std::min(first, at);
  }
  return first;
}

// Lanes of a packet that Embree asks about: calls take(lane, distance) where they meet it.
template <class Arguments, class Take>
void meet_lanes(const Arguments& arguments, RTCRayN* rays, const Take& take) {
  const auto* surfaces = static_cast<const RoundSurface*>(arguments.geometryUserPtr);
  const unsigned count = arguments.N;
  for (unsigned i = 0; i < count; ++i) {
    if (arguments.valid[i] == 0) continue;
    const Vec3f origin(RTCRayN_org_x(rays, count, i), RTCRayN_org_y(rays, count, i),
                       RTCRayN_org_z(rays, count, i));
    const Vec3f direction(RTCRayN_dir_x(rays, count, i), RTCRayN_dir_y(rays, count, i),
                          RTCRayN_dir_z(rays, count, i));
    const float distance = meet_round(surfaces[arguments.primID], origin, direction,
                                      RTCRayN_tnear(rays, count, i), RTCRayN_tfar(rays, count, i));
    if (std::isfinite(distance)) take(i, distance);
  }
}

void bound_round(const RTCBoundsFunctionArguments* arguments) {
  const auto* surfaces = static_cast<const RoundSurface*>(arguments->geometryUserPtr);
  const Bounds box = bounds_of(surfaces[arguments->primID]);
  const double margin = 1e-6 * (box.sizes().norm() + box.center().norm());
  const Vec3f low = (box.min().array() - margin).cast<float>();
  const Vec3f high = (box.max().array() + margin).cast<float>();
  *arguments->bounds_o = {.lower_x = low.x(),
                          .lower_y = low.y(),
                          .lower_z = low.z(),
                          .upper_x = high.x(),
                          .upper_y = high.y(),
                          .upper_z = high.z()};
}

void intersect_round(const RTCIntersectFunctionNArguments* arguments) {
  const unsigned count = arguments->N;
  RTCRayN* rays = RTCRayHitN_RayN(arguments->rayhit, count);
  RTCHitN* hits = RTCRayHitN_HitN(arguments->rayhit, count);
  meet_lanes(*arguments, rays, [&](unsigned i, float distance) {
    RTCRayN_tfar(rays, count, i) = distance;
    RTCHitN_u(hits, count, i) = RTCHitN_v(hits, count, i) = 0;
    RTCHitN_geomID(hits, count, i) = arguments->geomID;
    RTCHitN_primID(hits, count, i) = arguments->primID;
    RTCHitN_instID(hits, count, i, 0) = arguments->context->instID[0];
  });
}

void occlude_round(const RTCOccludedFunctionNArguments* arguments) {
  meet_lanes(*arguments, arguments->ray, [&](unsigned i, float) {
    RTCRayN_tfar(arguments->ray, arguments->N, i) = -std::numeric_limits<float>::infinity();
  });
}

}  // namespace

RTCGeometry new_round_geometry(RTCDevice device, const std::vector<RoundSurface>& surfaces) {
  RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_USER);
  rtcSetGeometryUserPrimitiveCount(geometry, static_cast<unsigned>(surfaces.size()));
  // Embree only hands it back.
  rtcSetGeometryUserData(geometry, const_cast<RoundSurface*>(surfaces.data()));
  rtcSetGeometryBoundsFunction(geometry, bound_round, nullptr);
  rtcSetGeometryIntersectFunction(geometry, intersect_round);
  rtcSetGeometryOccludedFunction(geometry, occlude_round);
  rtcCommitGeometry(geometry);
  return geometry;
}

}  // namespace pilesim

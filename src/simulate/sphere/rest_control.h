// Turns bodies that come to rest on ground into possible rest poses (dissertation 3.2.5). A body on
// others also turns towards one, until it sleeps.
#pragma once

#include <cstdint>
#include <vector>

#include "core/types.h"
#include "signature/signature.h"

namespace pilesim {

// Body frame. A body turns to the pose with the largest up . axis + offset. With uniformly random
// orientations, each pose then receives its share of the bodies by small rotations.
struct RestTarget {
  Vec3f up;  // unit
  float height_m;
  float offset;
};

// The poses of a signature: probabilities by simulation if available, and the exact pose of the
// stable face if there is one. At most kMostRestTargets, the most probable.
inline constexpr size_t kMostRestTargets = 127;
std::vector<RestTarget> rest_targets(const std::vector<KnownRestPose>& poses);

// The pose for a body whose support acts along `normal` (world). `targets` must not be empty.
size_t choose_rest_target(const std::vector<RestTarget>& targets, const Quatf& orientation,
                          const Vec3f& normal);

// Turns the body's `up` (body frame) towards `normal` (world) by this share, 0 .. 1, of the angle
// between them.
void turn_towards(const Vec3f& up, const Vec3f& normal, float share, Quatf& orientation);

// One step of a body with this bounding radius on ground of this normal. True once it is exactly in
// its pose.
bool turn_to_rest(const RestTarget& target, const Vec3f& normal, float outer_radius_m,
                  float gravity, float step_s, Quatf& orientation, Vec3f& spin, float& radius_m);

}  // namespace pilesim

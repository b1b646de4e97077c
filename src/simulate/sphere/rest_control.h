// Bodies that come to rest on ground end in a pose in which the object can lie (dissertation
// 3.2.5): they turn towards it. A body that lies on others turns towards one, too, until it sleeps.
#pragma once

#include <cstdint>
#include <vector>

#include "core/types.h"
#include "signature/signature.h"

namespace pilesim {

// Body frame. A body turns to the pose for which up . axis + offset is largest: of bodies in
// uniformly random orientations as many come to each as its probability says, by small turns.
struct RestTarget {
  Vec3f up;  // unit
  float height_m;
  float offset;
};

// The poses of a signature: probabilities by simulation where there are any, the exact pose of the
// stable face where there is one. At most kMostRestTargets, the likeliest.
inline constexpr size_t kMostRestTargets = 127;
std::vector<RestTarget> rest_targets(const std::vector<KnownRestPose>& poses);

// The pose of a body whose support pushes along `normal` (world). `targets` is not empty.
size_t choose_rest_target(const std::vector<RestTarget>& targets, const Quatf& orientation,
                          const Vec3f& normal);

// Turns the body's `up` (body frame) towards `normal` (world), by this share of the angle between
// them, 0 .. 1.
void turn_towards(const Vec3f& up, const Vec3f& normal, float share, Quatf& orientation);

// One step of a body of this outer radius that lies on ground of this normal. True once it is in
// its pose, exactly.
bool turn_to_rest(const RestTarget& target, const Vec3f& normal, float outer_radius_m,
                  float gravity, float step_s, Quatf& orientation, Vec3f& spin, float& radius_m);

}  // namespace pilesim

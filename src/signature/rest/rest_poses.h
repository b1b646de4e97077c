// How an object lies at rest on a horizontal plane, from its geometry alone.
//
// Let d be the direction of "down" in the body frame. The body touches the plane with the hull
// vertex that is farthest along d, and its centre of mass stands at the height of the support
// function
//   U(d) = max over hull vertices v of d . v        (origin: the centre of mass).
// Rolling quasi-statically, without inertia, the body follows the gradient flow of U on the sphere
// of directions (the Gauss map) down to a local minimum: the normal of a face over which the centre
// of mass projects. The share of the sphere that flows to a face is the probability that a body let
// go with a random orientation comes to rest on it. The basins are bounded by the flow lines that
// end in the saddles of U, of which there is at most one an edge, so that their areas are sums of
// spherical triangles: exact, without sampling (Baktash, Sharp, Zhou, Jacobson, Crane: Putting
// Rigid Bodies to Rest, SIGGRAPH 2025; the Morse-Smale complex of U).
#pragma once

#include <span>
#include <vector>

#include "core/types.h"
#include "geometry/mesh.h"

namespace pilesim {

struct RestPose {
  Vec3 up;          // unit, body frame: the plane's normal when at rest (n_rest of section 3.2.3.3)
  double height_m;  // of the centre of mass above the plane (h_rest)
  double probability;   // 0 .. 1
  uint32_t family = 0;  // the same for poses that a slight disturbance joins, see kFamilyBarrier
};

// Two neighbouring poses belong to one family if rolling from the lower into the higher one raises
// the centre of mass by at most this share of its height. The facets of a round side, each a pose
// of its own, then form one family. (The sides of a prism of 12 sides need 0.035, of 16 sides
// 0.020.)
inline constexpr double kFamilyBarrier = 0.03;

// All stable faces of `hull` (closed, convex, outward, the centre of mass at the origin and
// inside), by falling probability; the probabilities sum to 1. Faces that are coplanar within
// rounding count as one (geometry/hull_faces.h).
std::vector<RestPose> stable_rest_poses(const TriangleMesh& hull);

// The same of the hull of `mesh` about its centre of mass.
std::vector<RestPose> mesh_rest_poses(const TriangleMesh& mesh, const Vec3& centre_of_mass);

// For each of `downs` (unit, body frame) the pose that the flow reaches: an index into `poses`,
// which stable_rest_poses() gave for the same hull. It follows the flow step by step, which checks
// the areas by sampling.
std::vector<size_t> roll_to_rest(const TriangleMesh& hull, const std::vector<RestPose>& poses,
                                 std::span<const Vec3> downs);

// Joins poses whose `up` lie within `angle` (radians) of a more probable one, adding probabilities,
// and drops families whose total stays below `least_probability`. The facets of a round side stay
// as a ring of poses, however improbable each is: no single `up` can stand for them, and without
// them a stick could rest only on its ends.
inline constexpr double kRestPoseAngle = radians(5);
inline constexpr double kLeastRestProbability = 0.05;  // of section 3.2.3.3
std::vector<RestPose> cluster_rest_poses(const std::vector<RestPose>& poses, double angle,
                                         double least_probability);

}  // namespace pilesim

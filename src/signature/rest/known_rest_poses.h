// The rest poses that a signature keeps: from geometry and from simulated drops.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "signature/rest/rest_poses.h"

namespace pilesim {

// A pose in which the object lies on a horizontal plane.
struct KnownRestPose {
  Vec3 up = Vec3::UnitY();  // unit, the mesh's axes: the plane's normal when at rest (n_rest)
  double height_m = 0;      // of the centre of mass (h_rest)
  double probability = 0;   // 0 .. 1
  // 95% interval; both equal `probability` where it is exact
  double probability_low = 0, probability_high = 0;
  std::string source;   // how it was found: "geometry" or "simulation"
  uint32_t family = 0;  // the same for poses that a slight disturbance joins (rest_poses.h)
};

// The end of one simulated drop.
struct ObservedRest {
  Vec3 up;  // unit, the mesh's axes
  double height_m = 0;
};

// `faces` come from stable_rest_poses(). Each drop counts for the face nearest to its pose, and for
// that face's cluster and family. Drops farther than kRestPoseAngle from all faces form clusters
// and families of their own. A family is kept if either source gives it kLeastRestProbability or
// more. Each of its clusters has both probabilities: source "geometry" (exact) and "simulation"
// (mean pose of its drops and 95% interval), by falling probability. A cluster that no drop reached
// has no entry by simulation. Without drops: by geometry only.
std::vector<KnownRestPose> known_rest_poses(const std::vector<RestPose>& faces,
                                            std::span<const ObservedRest> drops);

// A pose from either source or both; the two agree within kRestPoseAngle.
struct RestPosePair {
  const KnownRestPose* pose;  // the first of the two, never null
  const KnownRestPose* by_geometry = nullptr;
  const KnownRestPose* by_simulation = nullptr;
};

// Keeps the order of `poses`, which must outlive the result.
std::vector<RestPosePair> pair_rest_poses(std::span<const KnownRestPose> poses);

// The probabilities of one family of poses from both sources.
struct RestPoseComparison {
  uint32_t family = 0;
  size_t poses = 0;     // distinct poses in it, from either source
  Vec3 up;              // of the most probable pose
  double height_m = 0;  // of the most probable pose
  double by_geometry = 0, by_simulation = 0;
  double simulation_low = 0, simulation_high = 0;  // 95% interval
  bool agrees = false;
};

// Quasi-static rolling and drops reach poses in different ways, so their probabilities differ. But
// a pose that one source finds at kLeastRestProbability or above (in simulation: the whole
// interval) must have at least this share of that threshold in the other (in simulation: the upper
// end).
inline constexpr double kRestAgreement = 0.5;

// For poses that known_rest_poses() gave for `drops` drops, by falling probability in simulation.
// Empty without drops.
std::vector<RestPoseComparison> compare_rest_poses(const std::vector<KnownRestPose>& poses,
                                                   uint32_t drops);

// Wilson's 95% score interval of the share count / of (of > 0).
struct ShareInterval {
  double low, high;
};
ShareInterval wilson_interval(double count, double of);

}  // namespace pilesim

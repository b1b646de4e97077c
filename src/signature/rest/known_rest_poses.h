// The rest poses that a signature keeps: those by geometry beside those counted in simulated drops.
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
  double probability_low = 0, probability_high = 0;  // 95% interval; equal where it is exact
  std::string source;                                // how it was found: "geometry" or "simulation"
  uint32_t family = 0;  // poses that a slight push joins have the same (rest_poses.h)
};

// How one simulated drop ended.
struct ObservedRest {
  Vec3 up;  // unit, the mesh's axes
  double height_m = 0;
};

// `faces`: of stable_rest_poses(). Each drop counts for the face nearest to how it lies, and so for
// that face's cluster and family; where none lies within kRestPoseAngle, drops are clustered among
// themselves into families of their own. Kept are the families that either way finds at
// kLeastRestProbability or above, each cluster with both of its probabilities (source "geometry",
// exact, and "simulation", mean pose of its drops and 95% interval), by falling probability. A
// cluster that no drop reached has no entry by simulation. Without drops: by geometry only.
std::vector<KnownRestPose> known_rest_poses(const std::vector<RestPose>& faces,
                                            std::span<const ObservedRest> drops);

// A pose as one way found it or both did: within kRestPoseAngle of each other.
struct RestPosePair {
  const KnownRestPose* pose;  // the first of the two, never null
  const KnownRestPose* by_geometry = nullptr;
  const KnownRestPose* by_simulation = nullptr;
};

// In the order of `poses`, which must outlive them.
std::vector<RestPosePair> pair_rest_poses(std::span<const KnownRestPose> poses);

// One family of poses, found both ways.
struct RestPoseComparison {
  uint32_t family = 0;
  size_t poses = 0;     // distinct ones of it, found either way
  Vec3 up;              // of the likeliest
  double height_m = 0;  // of the likeliest
  double by_geometry = 0, by_simulation = 0;
  double simulation_low = 0, simulation_high = 0;  // 95% interval
  bool agrees = false;
};

// Rolling without inertia and a drop are different ways to a pose, so that probabilities differ;
// but a pose that one way finds at kLeastRestProbability or above (by simulation: with the whole
// interval) must have at least this share of that threshold by the other (by simulation: the upper
// end of the interval).
inline constexpr double kRestAgreement = 0.5;

// For poses that known_rest_poses() gave for `drops` drops; by falling probability by simulation.
// Empty without drops.
std::vector<RestPoseComparison> compare_rest_poses(const std::vector<KnownRestPose>& poses,
                                                   uint32_t drops);

// Wilson's score interval of a share of which `count` of `of` were seen (of > 0), 95%.
struct ShareInterval {
  double low, high;
};
ShareInterval wilson_interval(double count, double of);

}  // namespace pilesim

#include "simulate/sphere/rest_control.h"

#include <algorithm>
#include <cmath>

#include "core/rotation.h"
#include "signature/rest/rest_poses.h"
#include "simulate/sphere/sphere_constants.h"

namespace pilesim {
namespace {

// Directions and iterations that find the offsets: shares are accurate to a few per mille.
constexpr int kDirections = 2048;
constexpr int kRounds = 400;

size_t choose(const std::vector<RestTarget>& targets, const Vec3f& up) {
  size_t best = 0;
  float most = -3;
  for (size_t i = 0; i < targets.size(); ++i) {
    const float value = targets[i].up.dot(up) + targets[i].offset;
    if (value > most) {
      most = value;
      best = i;
    }
  }
  return best;
}

// Evenly spread over the unit sphere (a Fibonacci lattice).
std::vector<Vec3f> directions() {
  std::vector<Vec3f> all;
  const double golden = kPi * (3 - std::sqrt(5.0));
  for (int i = 0; i < kDirections; ++i) {
    const double z = 1 - (2.0 * i + 1) / kDirections, r = std::sqrt(1 - z * z);
    all.push_back(Vec3(r * std::cos(golden * i), r * std::sin(golden * i), z).cast<float>());
  }
  return all;
}

struct Likely {
  KnownRestPose pose;
  double probability;
};

std::vector<Likely> likely_poses(const std::vector<KnownRestPose>& poses) {
  std::vector<Likely> faces, drops;
  for (const KnownRestPose& pose : poses) {
    (pose.source == "simulation" ? drops : faces).push_back({pose, pose.probability});
  }
  if (drops.empty()) return faces;
  for (Likely& face : faces) face.probability = 0;
  for (const Likely& drop : drops) {
    const auto face = std::ranges::max_element(
        faces, {}, [&](const Likely& f) { return f.pose.up.dot(drop.pose.up); });
    if (face != faces.end() && face->pose.up.dot(drop.pose.up) > std::cos(kRestPoseAngle)) {
      face->probability += drop.probability;
    } else {
      faces.push_back(drop);
    }
  }
  std::erase_if(faces, [](const Likely& face) { return face.probability == 0; });
  return faces;
}

// Turns by at most `most` (rad). True once it is exactly there.
bool turn_up(const Vec3f& up, const Vec3f& normal, float most, Quatf& orientation) {
  const Vec3f now = orientation * up;
  Vec3f axis = now.cross(normal);
  if (std::atan2(axis.norm(), now.dot(normal)) <= most) {
    orientation = (float_rotation_between(now, normal) * orientation).normalized();
    return true;
  }
  if (axis.norm() < 1e-6F) axis = now.unitOrthogonal();  // upside down
  orientation = (Quatf(Eigen::AngleAxisf(most, axis.normalized())) * orientation).normalized();
  return false;
}

}  // namespace

std::vector<RestTarget> rest_targets(const std::vector<KnownRestPose>& poses) {
  std::vector<Likely> likely = likely_poses(poses);
  std::ranges::stable_sort(likely, std::greater{}, &Likely::probability);
  if (likely.size() > kMostRestTargets) likely.resize(kMostRestTargets);
  double sum = 0;
  for (const Likely& one : likely) sum += one.probability;
  std::vector<RestTarget> targets;
  for (const Likely& one : likely) {
    targets.push_back({one.pose.up.cast<float>(), static_cast<float>(one.pose.height_m), 0});
  }
  // The offsets with the wanted shares maximise a concave function, whose gradient is the shortage
  // of the shares.
  const std::vector<Vec3f> everywhere = directions();
  std::vector<double> share(targets.size());
  for (int round = 0; round < kRounds; ++round) {
    std::ranges::fill(share, 0.0);
    for (const Vec3f& up : everywhere) share[choose(targets, up)] += 1.0 / kDirections;
    const double step = 2.0 / (1 + 0.05 * round);
    for (size_t i = 0; i < targets.size(); ++i) {
      targets[i].offset += static_cast<float>(step * (likely[i].probability / sum - share[i]));
    }
  }
  return targets;
}

size_t choose_rest_target(const std::vector<RestTarget>& targets, const Quatf& orientation,
                          const Vec3f& normal) {
  return choose(targets, orientation.conjugate() * normal);
}

void turn_towards(const Vec3f& up, const Vec3f& normal, float share, Quatf& orientation) {
  const Quatf all = float_rotation_between(orientation * up, normal);
  orientation = (Quatf::Identity().slerp(share, all) * orientation).normalized();
}

bool turn_to_rest(const RestTarget& target, const Vec3f& normal, float outer_radius_m,
                  float gravity, float step_s, Quatf& orientation, Vec3f& spin, float& radius_m) {
  const float most = sphere_constants::kTurnRate * std::sqrt(gravity / outer_radius_m) * step_s;
  const bool there = turn_up(target.up, normal, most, orientation);
  if (there) spin = spin.dot(normal) * normal;
  const float change = sphere_constants::kEaseSpeed * std::sqrt(gravity * outer_radius_m) * step_s;
  const bool low = std::abs(target.height_m - radius_m) <= change;
  radius_m = low ? target.height_m : radius_m + std::copysign(change, target.height_m - radius_m);
  return there && low;
}

}  // namespace pilesim

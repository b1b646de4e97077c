#include "simulate/rest_control.h"

#include <algorithm>
#include <cmath>

namespace pilesim {
namespace {

// Turns at this rate, in sqrt(g / r): about as fast as a body tips over.
constexpr float kTurnRate = 1.0F;

}  // namespace

bool turn_towards_rest(const BodySignature& object, float gravity, float step_s, Quatf& orientation,
                       Vec3f& spin, float& radius_m) {
  const std::vector<KnownRestPose>& poses = object.signature->rest_poses;
  if (poses.empty()) return true;
  const Vec3f up = orientation.conjugate() * Vec3f::UnitY();
  const auto nearest = std::ranges::max_element(
      poses, {}, [&](const KnownRestPose& pose) { return pose.up.cast<float>().dot(up); });
  const Vec3f wanted = nearest->up.cast<float>();
  const float radius = object.outer_radius_m;
  const float most = kTurnRate * std::sqrt(gravity / radius) * step_s;
  const Vec3f axis = up.cross(wanted);  // body frame: the pose turns the other way
  const float angle = std::atan2(axis.norm(), up.dot(wanted));
  const bool there = angle <= most;
  if (there) {
    orientation =
        (Quatf::FromTwoVectors(orientation * wanted, Vec3f::UnitY()) * orientation).normalized();
    spin = Vec3f(0, spin.y(), 0);
  } else {
    const Vec3f world_axis = (orientation * wanted).cross(Vec3f::UnitY()).normalized();
    orientation = (Quatf(Eigen::AngleAxisf(most, world_axis)) * orientation).normalized();
  }
  const auto height = static_cast<float>(nearest->height_m);
  const float change = kEaseSpeed * std::sqrt(gravity * radius) * step_s;
  const bool low = std::abs(height - radius_m) <= change;
  radius_m = low ? height : radius_m + std::copysign(change, height - radius_m);
  return there && low;
}

}  // namespace pilesim

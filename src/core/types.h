// Vector types of the whole project. SI units, y up, right-handed.
// Exact work is done in double; the statistical hot path and stored trajectories in float.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <numbers>

namespace pilesim {

using Vec3 = Eigen::Vector3d;
using Mat3 = Eigen::Matrix3d;
using Vec3f = Eigen::Vector3f;

// Constructed as (w, x, y, z) and stored in files in that order. Eigen keeps (x, y, z, w) in
// memory: never copy coeffs() into a file as it lies.
using Quat = Eigen::Quaterniond;
using Quatf = Eigen::Quaternionf;

// Takes a point of the child frame to the parent frame: rotate by `orientation`, then add
// `position`.
struct Pose {
  Vec3 position = Vec3::Zero();         // m, parent frame
  Quat orientation = Quat::Identity();  // unit
  Vec3 apply(const Vec3& point) const { return position + orientation * point; }
};

// Axis-aligned box; empty until the first extend() (Eigen keeps min > max then).
using Bounds = Eigen::AlignedBox3d;

inline constexpr double kPi = std::numbers::pi;
constexpr double radians(double degrees) { return degrees * (kPi / 180.0); }
constexpr double degrees(double radians) { return radians * (180.0 / kPi); }

}  // namespace pilesim

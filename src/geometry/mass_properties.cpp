#include "geometry/mass_properties.h"

#include <Eigen/Eigenvalues>
#include <cassert>
#include <cmath>

namespace pilesim {
namespace {

// Second moments about a point, integral of x x^T, to inertia about the same point.
Mat3 inertia_of_second_moments(const Mat3& second) {
  return second.trace() * Mat3::Identity() - second;
}

// Inertia that moving the mass of `volume` by `offset` away from its centre adds.
Mat3 parallel_axis(double volume, const Vec3& offset) {
  return inertia_of_second_moments(volume * offset * offset.transpose());
}

}  // namespace

MassProperties mass_properties(const TriangleMesh& mesh) {
  // The tetrahedra have their common apex in the middle of the mesh: far from it their signed
  // volumes would cancel and take the digits with them.
  const Vec3 apex = mesh.vertices.empty() ? Vec3::Zero().eval() : mesh.bounds().center();
  double volume = 0;
  Vec3 first = Vec3::Zero();
  Mat3 second = Mat3::Zero();
  for (const Triangle& triangle : mesh.triangles) {
    Mat3 edges;  // columns: the triangle's vertices seen from the apex
    for (int corner = 0; corner < 3; ++corner) {
      edges.col(corner) = mesh.vertices[triangle[static_cast<size_t>(corner)]] - apex;
    }
    const double tetrahedron = edges.determinant() / 6.0;
    const Vec3 sum = edges.rowwise().sum();
    volume += tetrahedron;
    first += tetrahedron / 4.0 * sum;
    second += tetrahedron / 20.0 * (edges * edges.transpose() + sum * sum.transpose());
  }
  if (volume == 0) return {.centre_of_mass = apex};
  const Vec3 centre = first / volume;
  second -= volume * centre * centre.transpose();
  return {.volume_m3 = volume,
          .centre_of_mass = apex + centre,
          .inertia_m5 = inertia_of_second_moments(second)};
}

double felt_turn_rate(const Mat3& inertia, const Vec3& spin) {
  const Eigen::SelfAdjointEigenSolver<Mat3> axes(inertia, Eigen::EigenvaluesOnly);
  return std::sqrt(spin.dot(inertia * spin) / axes.eigenvalues().z());
}

MassProperties box_mass_properties(const Vec3& size) {
  const double volume = size.prod();
  const Vec3 second = volume / 12.0 * size.cwiseAbs2();
  return {.volume_m3 = volume, .inertia_m5 = inertia_of_second_moments(second.asDiagonal())};
}

MassProperties sphere_mass_properties(double radius) {
  const double volume = 4.0 / 3.0 * kPi * radius * radius * radius;
  return {.volume_m3 = volume, .inertia_m5 = 0.4 * volume * radius * radius * Mat3::Identity()};
}

MassProperties cylinder_mass_properties(double radius, double height) {
  const double volume = kPi * radius * radius * height;
  const double across = volume * radius * radius / 4.0;
  const double along = volume * height * height / 12.0;
  return {.volume_m3 = volume,
          .inertia_m5 = inertia_of_second_moments(Vec3(across, along, across).asDiagonal())};
}

MassProperties combine(const std::vector<MassProperties>& parts) {
  assert(!parts.empty());
  MassProperties whole;
  for (const MassProperties& part : parts) {
    whole.volume_m3 += part.volume_m3;
    whole.centre_of_mass += part.volume_m3 * part.centre_of_mass;
  }
  whole.centre_of_mass /= whole.volume_m3;
  for (const MassProperties& part : parts) {
    whole.inertia_m5 +=
        part.inertia_m5 + parallel_axis(part.volume_m3, part.centre_of_mass - whole.centre_of_mass);
  }
  return whole;
}

MassProperties transformed(const MassProperties& properties, const Pose& pose) {
  const Mat3 rotation = pose.orientation.toRotationMatrix();
  return {.volume_m3 = properties.volume_m3,
          .centre_of_mass = pose.apply(properties.centre_of_mass),
          .inertia_m5 = rotation * properties.inertia_m5 * rotation.transpose()};
}

namespace {

// The coordinate axis most across `axis` (the first of equals), made perpendicular to it.
Vec3 most_across(const Vec3& axis) {
  Eigen::Index smallest;
  axis.cwiseAbs().minCoeff(&smallest);
  const Vec3 unit = Vec3::Unit(smallest);
  return (unit - unit.dot(axis) * axis).normalized();
}

// The direction of an axis whose largest component is positive.
Vec3 positive_direction(const Vec3& axis) {
  Eigen::Index largest;
  axis.cwiseAbs().maxCoeff(&largest);
  return axis(largest) < 0 ? Vec3(-axis) : axis;
}

}  // namespace

PrincipalInertia principal_inertia(const Mat3& inertia) {
  const Eigen::SelfAdjointEigenSolver<Mat3> solver(inertia);
  const Vec3& moments = solver.eigenvalues();
  Mat3 axes = solver.eigenvectors();

  // Axes of equal moments are free. The solver would let rounding errors choose them; a symmetric
  // body keeps the axes of its mesh as far as it can.
  const double tolerance = 1e-9 * moments(2);
  const bool low_pair = moments(1) - moments(0) <= tolerance;
  const bool high_pair = moments(2) - moments(1) <= tolerance;
  if (low_pair && high_pair) {
    axes = Mat3::Identity();
  } else if (low_pair) {
    axes.col(2) = positive_direction(axes.col(2));
    axes.col(0) = most_across(axes.col(2));
  } else {
    axes.col(0) = positive_direction(axes.col(0));
    axes.col(2) = high_pair ? most_across(axes.col(0)) : positive_direction(axes.col(2));
  }
  axes.col(1) = axes.col(2).cross(axes.col(0));
  return {.moments = moments, .axes = Quat(axes).normalized()};
}

}  // namespace pilesim

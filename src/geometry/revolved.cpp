#include "geometry/revolved.h"

#include <array>
#include <cassert>
#include <cmath>

namespace pilesim {
namespace {

Vec3 turned(const Eigen::Vector2d& point, double angle) {
  return {point.x() * std::cos(angle), point.y(), point.x() * std::sin(angle)};
}

}  // namespace

Profile frustum_profile(double radius, double top_radius, double height) {
  Profile profile = {{0, -height / 2}, {radius, -height / 2}, {top_radius, height / 2}};
  if (top_radius > 0) profile.emplace_back(0, height / 2);
  return profile;
}

Profile capsule_profile(double radius, double height, int across) {
  assert(height > 2 * radius && across >= 1);
  const double middle = height / 2 - radius;
  Profile profile;
  for (const double side : {-1.0, 1.0}) {
    for (int i = 0; i <= across; ++i) {
      const double from_middle = kPi / 2 * (side < 0 ? across - i : i) / across;
      const bool is_pole = side < 0 ? i == 0 : i == across;
      profile.emplace_back(is_pole ? 0 : radius * std::cos(from_middle),
                           side * (middle + radius * std::sin(from_middle)));
    }
  }
  return profile;
}

Profile torus_profile(double ring, double tube, int across) {
  assert(ring > tube && tube > 0 && across >= 3);
  Profile profile;
  for (int i = 0; i < across; ++i) {
    const double angle = 2 * kPi * (i + 0.5) / across - kPi / 2;
    profile.emplace_back(ring + tube * std::cos(angle), tube * std::sin(angle));
  }
  return profile;
}

Profile tube_profile(double outer, double inner, double height) {
  const double y = height / 2;
  return {{inner, -y}, {outer, -y}, {outer, y}, {inner, y}};
}

// By Gauss's theorem: pi r^2 dy and its moments along the edges, which are polynomials of degree 5
// at most, so that three points on each are exact.
MassProperties revolved_mass(const Profile& profile) {
  const double node = std::sqrt(0.6);
  const std::array<std::array<double, 2>, 3> nodes = {
      {{0.5 - node / 2, 5.0 / 18}, {0.5, 8.0 / 18}, {0.5 + node / 2, 5.0 / 18}}};
  double volume = 0, first = 0, second = 0, about_axis = 0;
  for (size_t i = 0; i < profile.size(); ++i) {
    const Eigen::Vector2d from = profile[i];
    const Eigen::Vector2d along = profile[(i + 1) % profile.size()] - from;
    for (const auto& [share, weight] : nodes) {
      const double r2 = std::pow(from.x() + share * along.x(), 2);
      const double y = from.y() + share * along.y();
      const double disk = weight * kPi * r2 * along.y();
      volume += disk;
      first += disk * y;
      second += disk * y * y;
      about_axis += disk * r2 / 2;
    }
  }
  const double centre = first / volume;
  const double across = about_axis / 2 + second - volume * centre * centre;
  return {.volume_m3 = volume,
          .centre_of_mass = {0, centre, 0},
          .inertia_m5 = Vec3(across, about_axis, across).asDiagonal()};
}

TriangleMesh revolved_mesh(const Profile& profile, int sides) {
  const auto count = static_cast<uint32_t>(sides);
  TriangleMesh mesh;
  std::vector<uint32_t> first;  // vertex of each point
  for (const Eigen::Vector2d& point : profile) {
    first.push_back(static_cast<uint32_t>(mesh.vertices.size()));
    const uint32_t copies = point.x() > 0 ? count : 1;
    for (uint32_t side = 0; side < copies; ++side) {
      mesh.vertices.push_back(turned(point, 2 * kPi * side / count));
    }
  }
  for (size_t i = 0; i < profile.size(); ++i) {
    const size_t next = (i + 1) % profile.size();
    const bool is_axis = profile[i].x() == 0, ends_at_axis = profile[next].x() == 0;
    for (uint32_t side = 0; side < count; ++side) {
      const uint32_t after = (side + 1) % count;
      const uint32_t a = first[i] + (is_axis ? 0 : side), d = first[i] + (is_axis ? 0 : after);
      const uint32_t b = first[next] + (ends_at_axis ? 0 : side);
      const uint32_t c = first[next] + (ends_at_axis ? 0 : after);
      if (b != c) mesh.triangles.push_back({a, b, c});
      if (a != d) mesh.triangles.push_back({a, c, d});
    }
  }
  return mesh;
}

}  // namespace pilesim

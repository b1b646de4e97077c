// Things with one smooth surface.
#include <array>
#include <functional>

#include "generate/swept_surface.h"
#include "generate/things.h"

namespace pilesim {
namespace {

// A point of a cross-section that is turned about the y axis: distance from the axis and height, m.
struct ProfilePoint {
  double radius;
  double y;
};

// `profile(i)` is the cross-section at turn i of `count`, counter-clockwise with the radius to the
// right and y up.
TriangleMesh revolve(int count, const std::function<std::vector<ProfilePoint>(int)>& profile) {
  std::vector<Ring> rings;
  for (int i = 0; i < count; ++i) {
    const double angle = 2 * kPi * i / count;
    Ring ring;
    for (const ProfilePoint& point : profile(i)) {
      ring.emplace_back(point.radius * std::cos(angle), point.y, point.radius * std::sin(angle));
    }
    rings.push_back(std::move(ring));
  }
  return closed_loft(rings);
}

double smooth_step(double low, double high, double value) {
  const double t = std::clamp((value - low) / (high - low), 0.0, 1.0);
  return t * t * (3 - 2 * t);
}

}  // namespace

TriangleMesh ring() {
  constexpr int kProfileSteps = 20;
  return revolve(64, [](int) {
    std::vector<ProfilePoint> profile;
    for (int i = 0; i < kProfileSteps; ++i) {
      // A superellipse of exponent 3: flat sides, well-rounded edges.
      const double angle = 2 * kPi * i / kProfileSteps;
      const double c = std::cos(angle);
      const double s = std::sin(angle);
      const double scale = 1 / std::cbrt(std::abs(c * c * c) + std::abs(s * s * s));
      profile.push_back({0.12 + 0.03 * c * scale, 0.02 * s * scale});
    }
    return profile;
  });
}

TriangleMesh tyre() {
  // Upper half of the cross-section from the middle of the tread over the sidewall to the rim.
  constexpr std::array<ProfilePoint, 15> kHalf{{{0.316, 0.006},
                                                {0.325, 0.009},
                                                {0.325, 0.036},
                                                {0.315, 0.040},
                                                {0.315, 0.047},
                                                {0.323, 0.051},
                                                {0.319, 0.076},
                                                {0.306, 0.088},
                                                {0.280, 0.097},
                                                {0.250, 0.100},
                                                {0.222, 0.094},
                                                {0.202, 0.081},
                                                {0.190, 0.066},
                                                {0.194, 0.054},
                                                {0.215, 0.028}}};
  constexpr size_t kFirstLug = 5;  // the points of the shoulder that are cut into lugs
  constexpr size_t kLastLug = 7;
  constexpr int kLugs = 26;
  return revolve(4 * kLugs, [&](int turn) {
    const bool groove = turn % 4 >= 2;
    std::vector<ProfilePoint> profile;
    for (size_t i = 0; i < kHalf.size(); ++i) {
      ProfilePoint point = kHalf[i];
      if (groove && i >= kFirstLug && i <= kLastLug) point.radius -= 0.007;
      profile.push_back(point);
    }
    for (size_t i = kHalf.size(); i-- > 0;) {
      profile.push_back({profile[i].radius, -profile[i].y});
    }
    return profile;
  });
}

TriangleMesh banana() {
  constexpr int kSections = 40;
  constexpr int kSides = 20;
  constexpr double kBend = 0.128;  // radius of the axis, m
  std::vector<Ring> rings;
  for (int i = 0; i <= kSections; ++i) {
    const double t = static_cast<double>(i) / kSections;
    // From the blossom end (t = 0) to the stem, which bends a little more.
    const double angle = radians(50 - 94 * t - 12 * smooth_step(0.8, 1, t));
    const double flesh = smooth_step(-0.04, 0.3, t) * (1 - smooth_step(0.6, 0.92, t));
    const double nub = 0.002 * (1 - smooth_step(0, 0.03, t));
    const double cut = 0.001 * smooth_step(0.96, 1, t);
    const double radius = 0.0048 + 0.0132 * flesh - nub + cut;
    const Vec3 outwards(std::sin(angle), -std::cos(angle), 0);
    Ring ring;
    for (int side = 0; side < kSides; ++side) {
      const double turn = 2 * kPi * side / kSides;
      // Five blunt edges run along the fruit.
      const double edge = 1 + 0.05 * std::cos(5 * turn);
      ring.push_back((kBend + radius * edge * std::cos(turn)) * outwards +
                     radius * edge * std::sin(turn) * Vec3::UnitZ());
    }
    rings.push_back(std::move(ring));
  }
  TriangleMesh mesh = loft(rings);
  const Vec3 centre = mesh.bounds().center();
  for (Vec3& vertex : mesh.vertices) vertex -= centre;
  return mesh;
}

}  // namespace pilesim

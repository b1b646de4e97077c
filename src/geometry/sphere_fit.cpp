#include "geometry/sphere_fit.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

#include "core/parallel_for.h"
#include "geometry/inside_test.h"
#include "geometry/triangle_tree.h"

namespace pilesim {
namespace {

// Samples of the bounds along the longest axis; the fit is judged on this lattice.
constexpr int kLattice = 40;
constexpr int kRounds = 30;

struct Samples {
  std::vector<Vec3> inside;
  std::vector<Vec3> outside;
  double volume_each = 0;  // m^3
};

Samples sample_solid(const TriangleMesh& mesh) {
  const Bounds bounds = mesh.bounds();
  const double spacing = bounds.diagonal().maxCoeff() / kLattice;
  const Eigen::Vector3i count = (bounds.diagonal() / spacing).array().ceil().max(1).cast<int>() + 8;
  const Vec3 first = bounds.center() - 0.5 * spacing * (count.cast<double>() - Vec3::Ones());
  std::vector<Vec3> points;
  for (int x = 0; x < count.x(); ++x) {
    for (int y = 0; y < count.y(); ++y) {
      for (int z = 0; z < count.z(); ++z) points.emplace_back(first + spacing * Vec3(x, y, z));
    }
  }
  const InsideTest test(mesh);
  std::vector<uint8_t> inside(points.size());
  parallel_for(points.size(), 512, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) inside[i] = test.contains(points[i]) ? 1 : 0;
  });
  Samples samples;
  samples.volume_each = spacing * spacing * spacing;
  for (size_t i = 0; i < points.size(); ++i) {
    (inside[i] ? samples.inside : samples.outside).push_back(points[i]);
  }
  // Thinner than the lattice: what it has for an inside is its centre.
  if (samples.inside.empty()) samples.inside.push_back(bounds.center());
  return samples;
}

bool in_any(const std::vector<FittedSphere>& spheres, const Vec3& point) {
  return std::ranges::any_of(spheres, [&](const FittedSphere& s) {
    return (point - s.centre).squaredNorm() <= s.radius * s.radius;
  });
}

// Starts far apart: each next centre is the inside point farthest from those taken.
std::vector<Vec3> spread_centres(const std::vector<Vec3>& points, int count) {
  Vec3 mean = Vec3::Zero();
  for (const Vec3& p : points) mean += p / static_cast<double>(points.size());
  std::vector<double> distance(points.size());
  for (size_t i = 0; i < points.size(); ++i) distance[i] = (points[i] - mean).norm();
  std::vector<Vec3> centres;
  while (static_cast<int>(centres.size()) < count) {
    const auto far = static_cast<size_t>(std::ranges::max_element(distance) - distance.begin());
    centres.push_back(points[far]);
    for (size_t i = 0; i < points.size(); ++i) {
      const double d = (points[i] - centres.back()).norm();
      distance[i] = centres.size() == 1 ? d : std::min(distance[i], d);
    }
  }
  return centres;
}

// Lloyd's rounds: every inside point goes to its nearest centre, every centre to their mean. The
// radius gives a sphere the volume of its points.
std::vector<FittedSphere> cluster(const Samples& samples, int count) {
  std::vector<Vec3> centres = spread_centres(samples.inside, count);
  std::vector<FittedSphere> spheres;
  for (int round = 0; round < kRounds; ++round) {
    std::vector<Vec3> sum(centres.size(), Vec3::Zero());
    std::vector<double> members(centres.size(), 0);
    for (const Vec3& point : samples.inside) {
      size_t nearest = 0;
      double least = std::numeric_limits<double>::infinity();
      for (size_t c = 0; c < centres.size(); ++c) {
        const double d = (point - centres[c]).squaredNorm();
        if (d < least) {
          least = d;
          nearest = c;
        }
      }
      sum[nearest] += point;
      ++members[nearest];
    }
    spheres.clear();
    for (size_t c = 0; c < centres.size(); ++c) {
      if (members[c] > 0) centres[c] = sum[c] / members[c];
      const double volume = std::max(1.0, members[c]) * samples.volume_each;
      spheres.push_back({centres[c], std::cbrt(volume * 3 / (4 * kPi))});
    }
  }
  return spheres;
}

double wrong_volume(const std::vector<FittedSphere>& spheres, const Samples& samples) {
  size_t wrong = 0;
  for (const Vec3& p : samples.inside) wrong += in_any(spheres, p) ? 0 : 1;
  for (const Vec3& p : samples.outside) wrong += in_any(spheres, p) ? 1 : 0;
  return static_cast<double>(wrong) * samples.volume_each;
}

// One common factor on all radii, the best of a few.
void scale_radii(std::vector<FittedSphere>& spheres, const Samples& samples) {
  double best_factor = 1;
  double best_wrong = std::numeric_limits<double>::infinity();
  for (int step = -4; step <= 8; ++step) {
    const double factor = 1 + 0.025 * step;
    std::vector<FittedSphere> trial = spheres;
    for (FittedSphere& s : trial) s.radius *= factor;
    const double wrong = wrong_volume(trial, samples);
    if (wrong < best_wrong) {
      best_wrong = wrong;
      best_factor = factor;
    }
  }
  for (FittedSphere& s : spheres) s.radius *= best_factor;
}

// From the outer surface of the spheres, on equal-area directions (Fibonacci lattice).
double mean_distance_to_surface(const std::vector<FittedSphere>& spheres,
                                const TriangleMesh& mesh) {
  constexpr int kDirections = 400;
  const double golden_angle = kPi * (3 - std::sqrt(5.0));
  const TriangleTree tree(mesh);
  double sum = 0;
  double weight = 0;
  for (const FittedSphere& sphere : spheres) {
    for (int i = 0; i < kDirections; ++i) {
      const double y = 1 - (2 * i + 1.0) / kDirections;
      const double r = std::sqrt(1 - y * y);
      const Vec3 direction(r * std::cos(golden_angle * i), y, r * std::sin(golden_angle * i));
      const Vec3 point = sphere.centre + sphere.radius * direction;
      const bool outer = std::ranges::none_of(spheres, [&](const FittedSphere& other) {
        return &other != &sphere && (point - other.centre).norm() < other.radius;
      });
      if (!outer) continue;
      const double area = sphere.radius * sphere.radius;
      sum += area * tree.distance(point);
      weight += area;
    }
  }
  return weight > 0 ? sum / weight : 0;
}

}  // namespace

SphereFit fit_spheres(const TriangleMesh& mesh, int count) {
  assert(count >= 1);
  const Samples samples = sample_solid(mesh);
  SphereFit fit;
  fit.spheres = cluster(samples, count);
  scale_radii(fit.spheres, samples);
  fit.volume_error = wrong_volume(fit.spheres, samples) /
                     (static_cast<double>(samples.inside.size()) * samples.volume_each);
  fit.mean_surface_error_m = mean_distance_to_surface(fit.spheres, mesh);
  return fit;
}

}  // namespace pilesim

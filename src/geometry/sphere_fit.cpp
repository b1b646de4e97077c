#include "geometry/sphere_fit.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <span>

#include "core/parallel_for.h"
#include "geometry/inside_test.h"
#include "geometry/mass_properties.h"
#include "geometry/triangle_tree.h"

namespace pilesim {
namespace {

constexpr int kFitCells = 32;      // of the grid that spheres are fitted on, along the longest side
constexpr int kMeasureCells = 47;  // of the grid that the error is measured on; shares no points
constexpr double kMargin = 0.15;   // of the longest side, around the mesh, for balls that protrude

// Points of a regular grid in and around the mesh, each standing for one cell.
struct Samples {
  std::vector<Vec3> points;     // m
  std::vector<uint8_t> inside;  // 1: in the mesh
  double cell;                  // m, edge length
};

Samples sample(const Bounds& bounds, const InsideTest& test, int cells) {
  const double longest = bounds.sizes().maxCoeff();
  Samples samples{.points = {}, .inside = {}, .cell = longest / cells};
  const Eigen::Array3i half =
      ((bounds.sizes().array() / 2 + kMargin * longest) / samples.cell).ceil().cast<int>();
  for (int i = -half.x(); i < half.x(); ++i) {
    for (int j = -half.y(); j < half.y(); ++j) {
      for (int k = -half.z(); k < half.z(); ++k) {
        samples.points.push_back(bounds.center() +
                                 samples.cell * (Vec3(i, j, k).array() + 0.5).matrix());
      }
    }
  }
  samples.inside.resize(samples.points.size());
  parallel_for(samples.points.size(), 256, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) {
      samples.inside[i] =
          bounds.contains(samples.points[i]) && test.contains(samples.points[i]) ? 1 : 0;
    }
  });
  return samples;
}

bool covers(const FittedSphere& sphere, const Vec3& point) {
  return (point - sphere.centre).squaredNorm() <= sphere.radius * sphere.radius;
}

class SphereFitter {
 public:
  SphereFitter(const TriangleTree& surface, const Samples& samples)
      : surface_(surface), samples_(samples), covered_by_(samples.points.size(), 0) {}

  std::vector<FittedSphere> fit(int count) {
    place_greedily(count);
    refine();
    return spheres_;
  }

 private:
  // The largest balls inside the mesh about sample points, each time the one that covers most of
  // the uncovered points.
  void place_greedily(int count) {
    const std::vector<FittedSphere> inscribed = inscribed_spheres();
    while (static_cast<int>(spheres_.size()) < count) {
      std::vector<size_t> gains(inscribed.size());
      parallel_for(inscribed.size(), 8, [&](size_t begin, size_t end) {
        for (size_t i = begin; i < end; ++i) gains[i] = newly_covered(inscribed[i]);
      });
      const auto best = std::max_element(gains.begin(), gains.end()) - gains.begin();
      spheres_.push_back(inscribed[static_cast<size_t>(best)]);
      // At its best place at once: else the next one goes for the rim that this one leaves.
      improve(spheres_.back());
      change_coverage(spheres_.back(), 1);
    }
  }

  std::vector<FittedSphere> inscribed_spheres() const {
    std::vector<FittedSphere> spheres;
    for (size_t i = 0; i < samples_.points.size(); ++i) {
      if (samples_.inside[i] != 0) spheres.push_back({samples_.points[i], 0});
    }
    // No cell's middle lies in a mesh thinner than a cell: its own middle must do.
    if (spheres.empty()) spheres.push_back({surface_.nodes()[0].box.center(), 0});
    parallel_for(spheres.size(), 64, [&](size_t begin, size_t end) {
      for (size_t i = begin; i < end; ++i) {
        spheres[i].radius = std::max(surface_.distance(spheres[i].centre), 0.25 * samples_.cell);
      }
    });
    // Balls along the middle of the mesh cover most. A thousand candidates of all kinds suffice.
    constexpr size_t kCandidates = 1000;
    if (spheres.size() <= kCandidates) return spheres;
    std::stable_sort(spheres.begin(), spheres.end(),
                     [](const auto& a, const auto& b) { return a.radius > b.radius; });
    std::vector<FittedSphere> candidates;
    for (size_t i = 0; i < kCandidates; ++i) {
      candidates.push_back(spheres[i * spheres.size() / kCandidates]);
    }
    return candidates;
  }

  size_t newly_covered(const FittedSphere& sphere) const {
    size_t count = 0;
    for (size_t i = 0; i < samples_.points.size(); ++i) {
      count += samples_.inside[i] != 0 && covered_by_[i] == 0 && covers(sphere, samples_.points[i]);
    }
    return count;
  }

  void change_coverage(const FittedSphere& sphere, int change) {
    for (size_t i = 0; i < samples_.points.size(); ++i) {
      if (covers(sphere, samples_.points[i])) covered_by_[i] += change;
    }
  }

  // Moves one sphere after the other to where excess and missing volume are least, the others held
  // still, until none moves.
  void refine() {
    constexpr int kMostSweeps = 30;
    for (int sweep = 0; sweep < kMostSweeps; ++sweep) {
      bool moved = false;
      for (FittedSphere& sphere : spheres_) {
        change_coverage(sphere, -1);
        moved |= improve(sphere);
        change_coverage(sphere, 1);
      }
      if (!moved) return;
    }
  }

  // Gain of a sphere: samples inside of the mesh that it alone covers, less those outside.
  struct Best {
    int worth;
    double radius;
  };

  // The best radius about a centre, by one pass over the samples no other sphere covers.
  Best best_radius(const Vec3& centre, std::span<const uint32_t> free_samples, double reach) const {
    const double bin = 0.25 * samples_.cell;
    std::vector<int> worth(static_cast<size_t>(reach / bin) + 2, 0);
    for (const uint32_t i : free_samples) {
      const double distance = (samples_.points[i] - centre).norm();
      if (distance < reach) {
        worth[static_cast<size_t>(distance / bin)] += samples_.inside[i] != 0 ? 1 : -1;
      }
    }
    Best best{.worth = 0, .radius = bin};
    int sum = 0;
    for (size_t i = 0; i < worth.size(); ++i) {
      sum += worth[i];
      if (sum > best.worth) best = {sum, bin * static_cast<double>(i + 1)};
    }
    return best;
  }

  // Pattern search over the centre with halving steps; the radius is the best for each centre.
  bool improve(FittedSphere& sphere) const {
    const double reach = 2 * sphere.radius + 4 * samples_.cell;
    std::vector<uint32_t> free_samples;
    for (uint32_t i = 0; i < samples_.points.size(); ++i) {
      if (covered_by_[i] == 0 && (samples_.points[i] - sphere.centre).norm() < 2 * reach) {
        free_samples.push_back(i);
      }
    }
    int worth = 0;
    for (const uint32_t i : free_samples) {
      if (covers(sphere, samples_.points[i])) worth += samples_.inside[i] != 0 ? 1 : -1;
    }
    bool moved = false;
    for (double step = std::max(sphere.radius / 2, samples_.cell); step > samples_.cell / 8;) {
      FittedSphere best = sphere;
      int best_worth = worth;
      for (const Vec3& direction : {Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(-1, 0, 0), Vec3(0, 1, 0),
                                    Vec3(0, -1, 0), Vec3(0, 0, 1), Vec3(0, 0, -1)}) {
        const Vec3 centre = sphere.centre + step * direction;
        const Best candidate = best_radius(centre, free_samples, reach);
        if (candidate.worth > best_worth) {
          best = {centre, candidate.radius};
          best_worth = candidate.worth;
        }
      }
      if (best_worth > worth) {
        sphere = best;
        worth = best_worth;
        moved = true;
      } else {
        step /= 2;
      }
    }
    return moved;
  }

  const TriangleTree& surface_;
  const Samples& samples_;
  std::vector<int> covered_by_;  // per sample: how many spheres
  std::vector<FittedSphere> spheres_;
};

bool covered(std::span<const FittedSphere> spheres, const Vec3& point) {
  return std::any_of(spheres.begin(), spheres.end(),
                     [&](const FittedSphere& sphere) { return covers(sphere, point); });
}

// Excess and missing volume as a part of the mesh's, by counting cells.
double volume_error(std::span<const FittedSphere> spheres, const Samples& samples, double volume) {
  std::vector<uint8_t> wrong(samples.points.size());
  parallel_for(samples.points.size(), 1024, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) {
      wrong[i] = covered(spheres, samples.points[i]) != (samples.inside[i] != 0);
    }
  });
  const auto count = static_cast<double>(std::count(wrong.begin(), wrong.end(), 1));
  return count * std::pow(samples.cell, 3) / volume;
}

// Mean distance to the mesh's surface, over the parts of the spheres that no other one covers.
double mean_surface_error(std::span<const FittedSphere> spheres, const TriangleTree& surface) {
  constexpr int kPoints = 500;  // on each sphere, evenly spread on a spiral
  const double golden_angle = kPi * (3.0 - std::sqrt(5.0));
  double weighted = 0, area = 0;
  for (size_t s = 0; s < spheres.size(); ++s) {
    const auto& [centre, radius] = spheres[s];
    for (int i = 0; i < kPoints; ++i) {
      const double y = 1.0 - 2.0 * (i + 0.5) / kPoints;
      const double across = std::sqrt(1.0 - y * y), angle = golden_angle * i;
      const Vec3 point =
          centre + radius * Vec3(across * std::cos(angle), y, across * std::sin(angle));
      if (covered(spheres.first(s), point) || covered(spheres.subspan(s + 1), point)) continue;
      weighted += radius * radius * surface.distance(point);
      area += radius * radius;
    }
  }
  return area > 0 ? weighted / area : 0.0;
}

}  // namespace

SphereFit fit_spheres(const TriangleMesh& mesh, int count) {
  assert(count >= 1);
  const TriangleTree surface(mesh);
  const InsideTest inside(mesh);
  const Bounds bounds = mesh.bounds();
  SphereFit result;
  const Samples samples = sample(bounds, inside, kFitCells);
  result.spheres = SphereFitter(surface, samples).fit(count);
  result.volume_error = volume_error(result.spheres, sample(bounds, inside, kMeasureCells),
                                     mass_properties(mesh).volume_m3);
  result.mean_surface_error_m = mean_surface_error(result.spheres, surface);
  return result;
}

}  // namespace pilesim

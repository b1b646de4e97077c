#include "pile/guide/guide_fit.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <unordered_map>
#include <vector>

#include "geometry/inside_test.h"

namespace pilesim {
namespace {

// Points through a shape, in the body frame, no more than about half a voxel apart.
std::vector<Vec3> fill_points(const ModelShape& shape, double voxel_m) {
  std::vector<Vec3> points = shape.mesh.vertices;
  const InsideTest inside(shape.mesh);
  const Bounds bounds = shape.mesh.bounds();
  const double spacing = std::max(voxel_m / 2, bounds.sizes().maxCoeff() / 40);
  const Vec3 cells = (bounds.sizes() / spacing).array().ceil().max(1);
  for (double x = 0.5; x < cells.x(); ++x) {
    for (double y = 0.5; y < cells.y(); ++y) {
      for (double z = 0.5; z < cells.z(); ++z) {
        const Vec3 point =
            bounds.min() + Vec3(x, y, z).cwiseQuotient(cells).cwiseProduct(bounds.sizes());
        if (inside.contains(point)) points.push_back(point);
      }
    }
  }
  return points;
}

class Voxels {
 public:
  explicit Voxels(double edge_m) : edge_m_(edge_m) {}
  void fill(const Vec3& point, uint8_t what) {
    const Vec3 cell = (point / edge_m_).array().floor();
    cells_[key(cell.cast<int64_t>())] |= what;
  }
  double share(uint8_t all) const {
    const auto full = std::ranges::count_if(cells_, [&](const auto& c) { return c.second == all; });
    return static_cast<double>(full) / static_cast<double>(std::max<size_t>(1, cells_.size()));
  }

 private:
  static uint64_t key(const Eigen::Matrix<int64_t, 3, 1>& cell) {
    constexpr uint64_t kMask = (1U << 21) - 1;
    return (static_cast<uint64_t>(cell.x()) & kMask) << 42 |
           (static_cast<uint64_t>(cell.y()) & kMask) << 21 |
           (static_cast<uint64_t>(cell.z()) & kMask);
  }
  double edge_m_;
  std::unordered_map<uint64_t, uint8_t> cells_;
};

constexpr uint8_t kPile = 1, kGuide = 2;

void fill_guide(const TriangleMesh& guide, const InsideTest& inside, double edge, Voxels& voxels) {
  const Bounds bounds = guide.bounds();
  const Vec3 low = (bounds.min() / edge).array().floor();
  const Vec3 high = (bounds.max() / edge).array().ceil();
  for (double x = low.x() + 0.5; x < high.x(); ++x) {
    for (double y = low.y() + 0.5; y < high.y(); ++y) {
      for (double z = low.z() + 0.5; z < high.z(); ++z) {
        const Vec3 centre = edge * Vec3(x, y, z);
        if (inside.contains(centre)) voxels.fill(centre, kGuide);
      }
    }
  }
}

bool counts(const Model& model, const BodyStates& states, size_t body) {
  return model.bodies[body].role == Role::dynamic && (states.flags[body] & kPresent) != 0;
}

}  // namespace

GuideFit measure_guide_fit(const Model& model, const BodyStates& states) {
  GuideFit fit;
  if (model.guide.triangles.empty()) return fit;
  const InsideTest inside(model.guide);
  double bodies = 0, volume = 0, radii = 0;
  for (size_t body = 0; body < states.size(); ++body) {
    if (!counts(model, states, body)) continue;
    const ModelShape& shape = model.shapes[model.bodies[body].shape];
    const double in = inside.contains(states.position[body]) ? 1 : 0;
    bodies += 1;
    volume += shape.mass.volume_m3;
    radii += shape.bounding_radius;
    fit.bodies_inside += in;
    fit.volume_inside += in * shape.mass.volume_m3;
  }
  if (bodies == 0) return fit;
  fit.bodies_inside /= bodies;
  fit.volume_inside /= volume;
  fit.voxel_m = radii / bodies;
  Voxels voxels(fit.voxel_m);
  fill_guide(model.guide, inside, fit.voxel_m, voxels);
  std::vector<std::vector<Vec3>> points(model.shapes.size());
  for (size_t body = 0; body < states.size(); ++body) {
    if (!counts(model, states, body)) continue;
    const uint32_t shape = model.bodies[body].shape;
    if (points[shape].empty()) points[shape] = fill_points(model.shapes[shape], fit.voxel_m);
    for (const Vec3& point : points[shape]) {
      voxels.fill(states.position[body] + states.orientation[body] * point, kPile);
    }
  }
  fit.overlap = voxels.share(kPile | kGuide);
  return fit;
}

}  // namespace pilesim

#include "pile/guide/guide_fit.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <unordered_map>
#include <utility>
#include <vector>

#include "geometry/inside_test.h"
#include "pile/guide/cell_grid.h"
#include "pile/guide/empty_parts.h"
#include "pile/guide/room.h"

namespace pilesim {
namespace {

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
constexpr double kMostVoxels = 1e8;  // of the guide's box, one byte each

void fill_guide(const TriangleMesh& guide, double edge, Voxels& voxels) {
  Bounds box = guide.bounds();
  box.min() = edge * (box.min() / edge).array().floor();
  // The edge is large enough already.
  const CellGrid grid(box, edge, std::numeric_limits<double>::infinity());
  const std::vector<uint8_t> inside = grid.inside(guide, 0);
  for (size_t i = 0; i < grid.size(); ++i) {
    if (inside[i] != 0) voxels.fill(grid.middle_of(i), kGuide);
  }
}

bool counts(const Model& model, const BodyStates& states, size_t body) {
  return model.bodies[body].role == Role::dynamic && (states.flags[body] & kPresent) != 0;
}

}  // namespace

GuideFit measure_guide_fit(const Scene& scene, const Model& model, const BodyStates& states) {
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
  fit.voxel_m = std::max(radii / bodies, std::cbrt(model.guide.bounds().volume() / kMostVoxels));
  Voxels voxels(fit.voxel_m);
  fill_guide(model.guide, fit.voxel_m, voxels);
  std::vector<std::vector<Vec3>> points(model.shapes.size());
  for (size_t body = 0; body < states.size(); ++body) {
    if (!counts(model, states, body)) continue;
    const uint32_t shape = model.bodies[body].shape;
    if (points[shape].empty()) points[shape] = points_of(model.shapes[shape], fit.voxel_m / 2);
    for (const Vec3& point : points[shape]) {
      voxels.fill(states.position[body] + states.orientation[body] * point, kPile);
    }
  }
  fit.overlap = voxels.share(kPile | kGuide);
  std::vector<PlacedBody> placed;
  for (size_t body = 0; body < states.size(); ++body) {
    if (!counts(model, states, body)) continue;
    placed.emplace_back(model.bodies[body].shape,
                        Pose{states.position[body], states.orientation[body]});
  }
  fit.filled_share = empty_parts(scene, model, fit.voxel_m, placed).filled_share;
  return fit;
}

double outline_moved_m(const Scene& scene, const Model& model, const BodyRange& range,
                       const BodyStates& states, double width_m) {
  using Pixel = std::pair<int64_t, int64_t>;
  const Vec3 up = -scene.gravity.normalized(), side = up.unitOrthogonal();
  std::map<uint32_t, std::vector<Vec3>> points;  // by shape
  double moved_m = 0;
  for (const Vec3& across : {side, Vec3(up.cross(side))}) {
    std::map<Pixel, uint8_t> pixels;
    const auto draw = [&](uint32_t shape, const Pose& pose, uint8_t what) {
      std::vector<Vec3>& own = points[shape];
      if (own.empty()) own = points_of(model.shapes[shape], width_m / 2);
      for (const Vec3& point : own) {
        const Vec3 at = pose.apply(point) / width_m;
        pixels[{static_cast<int64_t>(std::floor(at.dot(across))),
                static_cast<int64_t>(std::floor(at.dot(up)))}] |= what;
      }
    };
    for (uint32_t i = range.first; i < range.first + range.count; ++i) {
      const uint32_t shape = model.bodies[i].shape;
      draw(shape, model.bodies[i].pose, 1);
      if (counts(model, states, i)) draw(shape, {states.position[i], states.orientation[i]}, 2);
    }
    double other = 0, edges = 0;
    for (const auto& [at, what] : pixels) {
      other += what != 3 ? 1 : 0;
      if ((what & 1) == 0) continue;
      for (const Pixel& next : {Pixel(at.first + 1, at.second), Pixel(at.first - 1, at.second),
                                Pixel(at.first, at.second + 1), Pixel(at.first, at.second - 1)}) {
        const auto found = pixels.find(next);
        edges += found == pixels.end() || (found->second & 1) == 0 ? 1 : 0;
      }
    }
    if (edges > 0) moved_m = std::max(moved_m, width_m * other / edges);
  }
  return moved_m;
}

}  // namespace pilesim

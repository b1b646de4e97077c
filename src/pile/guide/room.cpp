#include "pile/guide/room.h"

#include <algorithm>
#include <atomic>
#include <cmath>

#include "core/parallel_for.h"
#include "geometry/inside_test.h"

namespace pilesim {
namespace {

constexpr double kMostCells = 4e6;
// In cells: least distance of a cell's centre from the wall.
constexpr double kFromWall = 0.5;
constexpr size_t kGrain = 1024;

}  // namespace

std::vector<Vec3> points_of(const ModelShape& shape, double spacing_m) {
  std::vector<Vec3> points = shape.mesh.vertices;
  if (points.empty()) {  // a ball
    points.emplace_back(Vec3::Zero());
    for (int k = 0; k < 3; ++k) {
      for (const double side : {1.0, -1.0}) {
        points.emplace_back(side * shape.bounding_radius * Vec3::Unit(k));
      }
    }
    return points;
  }
  for (const Triangle& t : shape.mesh.triangles) {
    const Vec3 &a = shape.mesh.vertices[t[0]], &b = shape.mesh.vertices[t[1]],
               &c = shape.mesh.vertices[t[2]];
    const double longest = std::max({(b - a).norm(), (c - a).norm(), (c - b).norm()});
    const int cuts = static_cast<int>(std::ceil(longest / spacing_m));
    for (int i = 0; i <= cuts; ++i) {
      for (int j = 0; i + j <= cuts; ++j) {
        const double u = static_cast<double>(i) / cuts, v = static_cast<double>(j) / cuts;
        points.push_back(a + u * (b - a) + v * (c - a));
      }
    }
  }
  const InsideTest inside(shape.mesh);
  const Bounds bounds = shape.mesh.bounds();
  const Vec3 cells = (bounds.sizes() / spacing_m).array().ceil().max(1);
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

Room::Room(const TriangleMesh& guide, double cell_m)
    : grid_(guide.bounds(), cell_m, kMostCells),
      cells_(grid_.inside(guide, kFromWall * grid_.cell_m)) {
  for (uint8_t& cell : cells_) cell = cell != 0 ? uint8_t{0} : kOutside;
}

bool Room::block(const Obstacle& obstacle, double near_m) {
  std::atomic<bool> any = false;
  parallel_for(cells_.size(), kGrain, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) {
      if (cells_[i] == kOutside || !obstacle.is_at(grid_.middle_of(i), near_m)) continue;
      cells_[i] = kOutside;
      any = true;
    }
  });
  return any;
}

void Room::clear() {
  for (uint8_t& cell : cells_) cell &= kOutside;
}

void Room::cover(const Pose& pose, std::span<const Vec3> points) {
  const Mat3 turn = pose.orientation.toRotationMatrix();
  for (const Vec3& point : points) {
    const size_t cell = grid_.cell_of(pose.position + turn * point);
    if (cell < cells_.size()) cells_[cell] |= kCovered;
  }
}

void Room::list_free() {
  free_.clear();
  for (uint32_t i = 0; i < cells_.size(); ++i) {
    if (cells_[i] == 0) free_.push_back(i);
  }
}

bool Room::find(std::span<const Vec3> points, Philox& draws, Pose& pose) const {
  if (free_.empty()) return false;
  const uint32_t cell = free_[draws.index(static_cast<uint32_t>(free_.size()))];
  const double x = draws.uniform(), y = draws.uniform(), z = draws.uniform();
  pose.position = grid_.low + grid_.cell_m * (Vec3(x, y, z) + grid_.corner_of(cell));
  pose.orientation = draws.rotation();
  const Mat3 turn = pose.orientation.toRotationMatrix();
  return std::ranges::all_of(points, [&](const Vec3& point) {
    const size_t at = grid_.cell_of(pose.position + turn * point);
    return at < cells_.size() && cells_[at] == 0;
  });
}

}  // namespace pilesim

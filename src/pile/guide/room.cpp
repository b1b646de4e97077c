#include "pile/guide/room.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>

#include "core/parallel_for.h"
#include "geometry/inside_test.h"
#include "geometry/triangle_tree.h"

namespace pilesim {
namespace {

constexpr double kMostCells = 4e6;
// In cells: so far from the wall a cell's middle has to be.
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

Room::Room(const TriangleMesh& guide, double cell_m) {
  const Bounds bounds = guide.bounds();
  low_ = bounds.min();
  cell_m_ = std::max(cell_m, std::cbrt(bounds.volume() / kMostCells));
  for (int k = 0; k < 3; ++k) {
    count_[k] = static_cast<size_t>(std::ceil(bounds.sizes()[k] / cell_m_)) + 1;
  }
  cells_.assign(count_[0] * count_[1] * count_[2], 0);
  const InsideTest inside(guide);
  const TriangleTree surface(guide);
  parallel_for(cells_.size(), kGrain, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) {
      const Vec3 middle = middle_of(i);
      const bool is_in = inside.contains(middle) && surface.distance(middle) >= kFromWall * cell_m_;
      if (!is_in) cells_[i] = kOutside;
    }
  });
}

bool Room::block(const Obstacle& obstacle, double near_m) {
  std::atomic<bool> any = false;
  parallel_for(cells_.size(), kGrain, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) {
      if (cells_[i] == kOutside || !obstacle.is_at(middle_of(i), near_m)) continue;
      cells_[i] = kOutside;
      any = true;
    }
  });
  return any;
}

void Room::clear() {
  for (uint8_t& cell : cells_) cell &= kOutside;
}

Vec3 Room::middle_of(size_t cell) const {
  return low_ + cell_m_ * (Vec3::Constant(0.5) + corner_of(cell));
}

Vec3 Room::corner_of(size_t cell) const {
  const size_t layer = cell / (count_[0] * count_[1]);
  return Vec3(static_cast<double>(cell % count_[0]),
              static_cast<double>(cell / count_[0] % count_[1]), static_cast<double>(layer));
}

size_t Room::cell_of(const Vec3& point) const {
  const Vec3 place = (point - low_) / cell_m_;
  std::array<size_t, 3> at;
  for (int k = 0; k < 3; ++k) {
    if (!(place[k] >= 0) || place[k] >= static_cast<double>(count_[k])) return cells_.size();
    at[k] = static_cast<size_t>(place[k]);
  }
  return at[0] + count_[0] * (at[1] + count_[1] * at[2]);
}

void Room::cover(const Pose& pose, std::span<const Vec3> points) {
  const Mat3 turn = pose.orientation.toRotationMatrix();
  for (const Vec3& point : points) {
    const size_t cell = cell_of(pose.position + turn * point);
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
  pose.position = low_ + cell_m_ * (Vec3(x, y, z) + corner_of(cell));
  pose.orientation = draws.rotation();
  const Mat3 turn = pose.orientation.toRotationMatrix();
  return std::ranges::all_of(points, [&](const Vec3& point) {
    const size_t at = cell_of(pose.position + turn * point);
    return at < cells_.size() && cells_[at] == 0;
  });
}

}  // namespace pilesim

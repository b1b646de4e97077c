// The share of a space that bodies fill, from sample points tested against their convex collision
// pieces: exact shapes, sampled volumes. Independent of engines.
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <vector>

#include "core/body_flags.h"
#include "core/parallel_for.h"
#include "model/model.h"

namespace pilesim {

// An upright cylinder about the y axis, m.
struct Column {
  double radius_m = 0;
  double low_m = 0, high_m = 0;  // y of its ends
};

struct Fill {
  // The bodies' volumes in the column over its volume, as a balance would measure it. Overlaps
  // count twice.
  double by_volume = 0;
  double covered = 0;         // share of the column inside any body
  double standard_error = 0;  // of both, as for random points; these points are more even
};

// The n-th of points that fill the unit cube evenly (Halton 1960, bases 2, 3 and 5). Multiples of
// irrational numbers are faster, but had errors of 0.006 for a sphere on the axis of a column.
inline Vec3 even_point(uint64_t n) {
  const auto mirrored = [n](uint64_t base) {
    double digit = 1, x = 0;
    for (uint64_t left = n + 1; left > 0; left /= base) {
      digit /= static_cast<double>(base);
      x += digit * static_cast<double>(left % base);
    }
    return x;
  };
  return {mirrored(2), mirrored(3), mirrored(5)};
}

class PackedBodies {
 public:
  // The dynamic bodies of `model` that are present, in these poses of their body frames; arrays
  // over all bodies of the model. Only shapes with pieces. `model` must outlive it.
  PackedBodies(const Model& model, const std::vector<Vec3>& position,
               const std::vector<Quat>& orientation, const std::vector<uint8_t>& flags)
      : model_(model) {
    for (const ModelShape& shape : model.shapes) shapes_.push_back(pieces_of(shape));
    Bounds bounds;
    for (size_t i = 0; i < model.bodies.size(); ++i) {
      if (model.bodies[i].role != Role::dynamic || !(flags[i] & kPresent)) continue;
      const uint32_t shape = model.bodies[i].shape;
      bodies_.push_back({shape, position[i], orientation[i].toRotationMatrix().transpose()});
      const double radius = model.shapes[shape].bounding_radius;
      cell_m_ = std::max(cell_m_, radius);
      bounds.extend(Vec3(position[i].array() - radius));
      bounds.extend(Vec3(position[i].array() + radius));
    }
    if (!bodies_.empty()) fill_cells(bounds);
  }

  size_t size() const { return bodies_.size(); }
  const Vec3& position(size_t body) const { return bodies_[body].position; }
  double volume_m3() const {
    double sum = 0;
    for (const Placed& body : bodies_) sum += model_.shapes[body.shape].mass.volume_m3;
    return sum;
  }

  // Number of bodies that contain the point.
  uint32_t bodies_at(const Vec3& point) const {
    if (bodies_.empty()) return 0;
    std::array<int64_t, 3> cell;
    for (int axis = 0; axis < 3; ++axis) {
      cell[axis] = static_cast<int64_t>(std::floor((point[axis] - origin_[axis]) / cell_m_));
      if (cell[axis] < 0 || cell[axis] >= count_[axis]) return 0;
    }
    uint32_t held = 0;
    for (const uint32_t body : cells_[index(cell)]) held += holds(bodies_[body], point);
    return held;
  }

 private:
  struct Piece {
    CollisionPiece::Kind kind;
    Vec3 position;
    Mat3 to_piece;  // from the body frame's axes
    Vec3 size;
    RoundSector round;
    std::vector<std::pair<Vec3, double>> planes;  // of a hull: outward normal, offset
  };
  struct Placed {
    uint32_t shape;
    Vec3 position;
    Mat3 to_body;
  };

  static std::vector<Piece> pieces_of(const ModelShape& shape) {
    std::vector<Piece> pieces;
    for (const CollisionPiece& source : shape.pieces) {
      Piece piece{
          source.kind, source.pose.position, source.pose.orientation.toRotationMatrix().transpose(),
          source.size, source.round,         {}};
      for (const Triangle& t : source.hull.triangles) {
        const Vec3& a = source.hull.vertices[t[0]];
        const Vec3 across = (source.hull.vertices[t[1]] - a).cross(source.hull.vertices[t[2]] - a);
        const Vec3 normal = across.normalized();
        piece.planes.emplace_back(normal, normal.dot(a));
      }
      pieces.push_back(std::move(piece));
    }
    return pieces;
  }

  static bool holds(const Piece& piece, const Vec3& in_body) {
    const Vec3 p = piece.to_piece * (in_body - piece.position);
    switch (piece.kind) {
      case CollisionPiece::Kind::hull:
        return std::ranges::all_of(
            piece.planes, [&](const auto& plane) { return plane.first.dot(p) <= plane.second; });
      case CollisionPiece::Kind::box:
        return (p.cwiseAbs().array() <= piece.size.array() / 2).all();
      case CollisionPiece::Kind::sphere:
        return p.squaredNorm() <= piece.size.x() * piece.size.x();
      case CollisionPiece::Kind::round: {  // whole, as cylinders are
        const RoundSector& round = piece.round;
        return std::abs(p.y()) <= round.height / 2 && std::hypot(p.x(), p.z()) <= round.bottom;
      }
    }
    return false;
  }

  bool holds(const Placed& body, const Vec3& point) const {
    const Vec3 way = point - body.position;
    const double radius = model_.shapes[body.shape].bounding_radius;
    if (way.squaredNorm() > radius * radius) return false;
    const Vec3 in_body = body.to_body * way;
    return std::ranges::any_of(shapes_[body.shape],
                               [&](const Piece& piece) { return holds(piece, in_body); });
  }

  size_t index(const std::array<int64_t, 3>& cell) const {
    return static_cast<size_t>((cell[0] * count_[1] + cell[1]) * count_[2] + cell[2]);
  }

  void fill_cells(const Bounds& bounds) {
    origin_ = bounds.min();
    for (int axis = 0; axis < 3; ++axis) {
      count_[axis] = static_cast<int64_t>(bounds.sizes()[axis] / cell_m_) + 1;
    }
    cells_.resize(static_cast<size_t>(count_[0] * count_[1] * count_[2]));
    for (uint32_t body = 0; body < bodies_.size(); ++body) {
      const double radius = model_.shapes[bodies_[body].shape].bounding_radius;
      std::array<int64_t, 3> low, high, cell;
      for (int axis = 0; axis < 3; ++axis) {
        const double from = bodies_[body].position[axis] - origin_[axis];
        low[axis] = std::max<int64_t>(0, static_cast<int64_t>((from - radius) / cell_m_));
        high[axis] = std::min(count_[axis] - 1, static_cast<int64_t>((from + radius) / cell_m_));
      }
      for (cell[0] = low[0]; cell[0] <= high[0]; ++cell[0]) {
        for (cell[1] = low[1]; cell[1] <= high[1]; ++cell[1]) {
          for (cell[2] = low[2]; cell[2] <= high[2]; ++cell[2]) {
            cells_[index(cell)].push_back(body);
          }
        }
      }
    }
  }

  const Model& model_;
  std::vector<std::vector<Piece>> shapes_;  // by shape
  std::vector<Placed> bodies_;
  double cell_m_ = 0;
  Vec3 origin_ = Vec3::Zero();
  std::array<int64_t, 3> count_{};
  std::vector<std::vector<uint32_t>> cells_;  // bodies whose bounding spheres reach into each cell
};

// With `points` points in the ring between two radii of a column, uniform over its volume.
inline Fill fill_of_ring(const PackedBodies& packing, double inner_m, const Column& column,
                         uint64_t points) {
  // Integers: the order of their addition does not matter.
  std::atomic<uint64_t> held = 0, covered = 0;
  parallel_for(points, 4096, [&](size_t begin, size_t end) {
    uint64_t sum = 0, any = 0;
    for (size_t i = begin; i < end; ++i) {
      const Vec3 even = even_point(i);
      const double inner = inner_m * inner_m, outer = column.radius_m * column.radius_m;
      const double radius = std::sqrt(inner + (outer - inner) * even.x());
      const double angle = 2 * kPi * even.y();
      const double y = column.low_m + (column.high_m - column.low_m) * even.z();
      const uint32_t bodies =
          packing.bodies_at({radius * std::cos(angle), y, radius * std::sin(angle)});
      sum += bodies;
      any += bodies > 0;
    }
    held += sum;
    covered += any;
  });
  Fill fill;
  const auto count = static_cast<double>(points);
  fill.by_volume = static_cast<double>(held) / count;
  fill.covered = static_cast<double>(covered) / count;
  fill.standard_error = std::sqrt(fill.covered * (1 - fill.covered) / count);
  return fill;
}

inline Fill fill_of(const PackedBodies& packing, const Column& column, uint64_t points) {
  return fill_of_ring(packing, 0, column, points);
}

// The empty share of a column in `bins` rings of equal width, from its wall inwards.
inline std::vector<double> porosity_from_wall(const PackedBodies& packing, const Column& column,
                                              int bins, uint64_t points_a_bin) {
  std::vector<double> porosity;
  for (int bin = 0; bin < bins; ++bin) {
    Column ring = column;
    ring.radius_m = column.radius_m * (bins - bin) / bins;
    const double inner = column.radius_m * (bins - bin - 1) / bins;
    porosity.push_back(1 - fill_of_ring(packing, inner, ring, points_a_bin).covered);
  }
  return porosity;
}

// A bed on y = `floor_m` is about twice as high as its bodies' mean centre, m.
inline double bed_height_m(const PackedBodies& packing, double floor_m) {
  double sum = 0;
  for (size_t i = 0; i < packing.size(); ++i) sum += packing.position(i).y() - floor_m;
  return packing.size() > 0 ? 2 * sum / static_cast<double>(packing.size()) : 0;
}

}  // namespace pilesim

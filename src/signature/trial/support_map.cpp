#include "signature/trial/support_map.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numeric>

namespace pilesim {
namespace {

// Margin for rounding on angles and their sines, here and in the flights.
constexpr double kRounding = 1e-5;

// The directions of the edges that leave a vertex, one vertex after the other.
struct Edges {
  std::vector<Vec3> direction;  // unit
  std::vector<uint32_t> begin;  // (vertices + 1)
};

Edges sort_edges(std::span<const Vec3> vertices, std::span<const std::array<uint32_t, 2>> edges) {
  Edges sorted;
  sorted.begin.assign(vertices.size() + 1, 0);
  for (const auto& [from, to] : edges) ++sorted.begin[from + 1];
  for (size_t v = 0; v < vertices.size(); ++v) sorted.begin[v + 1] += sorted.begin[v];
  std::vector<uint32_t> at(sorted.begin.begin(), sorted.begin.end() - 1);
  sorted.direction.resize(edges.size());
  for (const auto& [from, to] : edges) {
    sorted.direction[at[from]++] = (vertices[to] - vertices[from]).stableNormalized();
  }
  return sorted;
}

struct Cone {
  Vec3 axis;
  double angle;
};

// A cone around a cell of the cube, see cell_of().
Cone cone_of_cell(size_t cell, size_t side) {
  const size_t face = cell / (side * side), row = cell / side % side, column = cell % side;
  const auto axis = static_cast<Eigen::Index>(face / 2);
  const auto direction = [&](double r, double c) {
    Vec3 d;
    d(axis) = 1;
    d((axis + 1) % 3) = 2 * (static_cast<double>(row) + r) / static_cast<double>(side) - 1;
    d((axis + 2) % 3) = 2 * (static_cast<double>(column) + c) / static_cast<double>(side) - 1;
    return Vec3(d.normalized() * (face % 2 == 0 ? 1 : -1));
  };
  Cone cone{direction(0.5, 0.5), 0};
  for (const double r : {0.0, 1.0}) {
    for (const double c : {0.0, 1.0}) {
      cone.angle = std::max(cone.angle, std::acos(cone.axis.dot(direction(r, c))));
    }
  }
  return cone;
}

// Largest distance of a vertex below the centre for a normal in a cone of this half angle.
double farthest_below(const Vec3& vertex, const Vec3& axis, double angle) {
  const double below = -vertex.dot(axis), radius = vertex.norm();
  const double off = std::acos(std::clamp(below / radius, -1.0, 1.0));
  return radius * std::cos(std::max(0.0, off - angle));
}

SupportMap::Group group_of(std::span<const Vec3> vertices, std::span<const uint32_t> numbers) {
  SupportMap::Group group{};
  for (size_t lane = 0; lane < SupportMap::kGroup; ++lane) {
    const uint32_t number = numbers[std::min(lane, numbers.size() - 1)];
    const Vec3& v = vertices[number];
    group.x[lane] = static_cast<float>(v.x());
    group.y[lane] = static_cast<float>(v.y());
    group.z[lane] = static_cast<float>(v.z());
    group.vertex[lane] = static_cast<uint16_t>(number);
    group.radius = std::max(group.radius, static_cast<float>(v.norm() * (1 + kRounding)));
  }
  return group;
}

}  // namespace

SupportMap::SupportMap(std::span<const Vec3> vertices,
                       std::span<const std::array<uint32_t, 2>> edges) {
  assert(vertices.size() <= kMostVertices);
  const Edges sorted = sort_edges(vertices, edges);
  // True if a vertex can be lowest for some normal in a cone whose half angle has this sine.
  const auto can_touch = [&](uint32_t vertex, const Vec3& normal, double sine) {
    for (uint32_t e = sorted.begin[vertex]; e < sorted.begin[vertex + 1]; ++e) {
      if (normal.dot(sorted.direction[e]) < -sine) return false;
    }
    return true;
  };
  lists_.resize(kDeviations.size() * kCells);
  std::vector<uint32_t> all(vertices.size()), candidates, fewer;
  std::iota(all.begin(), all.end(), 0U);
  for (size_t cell = 0; cell < kCells; ++cell) {
    const Cone cone = cone_of_cell(cell, kSide);
    candidates = all;
    // The candidates of a wider angle include those of a narrower one.
    for (size_t wide = kDeviations.size(); wide-- > 0;) {
      const double angle = std::asin(kDeviations[wide]) + cone.angle + kRounding;
      const double sine = std::sin(angle) + kRounding;
      fewer.clear();
      double height = 0;
      for (const uint32_t vertex : candidates) {
        if (!can_touch(vertex, cone.axis, sine)) continue;
        fewer.push_back(vertex);
        height = std::max(height, farthest_below(vertices[vertex], cone.axis, angle));
      }
      candidates.swap(fewer);
      List& list = lists_[wide * kCells + cell];
      list.begin = static_cast<uint32_t>(groups_.size());
      list.height_m = static_cast<float>(height * (1 + kRounding));
      for (size_t i = 0; i < candidates.size(); i += kGroup) {
        const size_t count = std::min(kGroup, candidates.size() - i);
        groups_.push_back(group_of(vertices, std::span(candidates).subspan(i, count)));
      }
      list.count = static_cast<uint32_t>(groups_.size()) - list.begin;
    }
  }
}

}  // namespace pilesim

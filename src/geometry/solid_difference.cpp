#include "geometry/solid_difference.h"

#include <algorithm>
#include <cmath>

#include "core/parallel_for.h"

namespace pilesim {
namespace {

constexpr int kLines = 384;  // along each side of the grid

enum class Owner : uint8_t { mesh, pieces };

// A triangle seen along the lines: corners in the plane across them, depth along them.
struct ProjectedTriangle {
  std::array<Eigen::Vector2d, 3> corner;
  std::array<double, 3> depth;
  int8_t direction;  // +1 where a line of growing depth enters the solid, -1 where it leaves
  Owner owner;
};

struct LineGrid {
  int axis;  // of the lines; the grid spans the next two
  Eigen::Vector2d origin, cell;

  // The line of a cell: a point of the R2 sequence (Roberts 2018) inside of it.
  Eigen::Vector2d line(int column, int row) const {
    const double k = row * kLines + column + 1;
    const double u = k * 0.7548776662466927;
    const double v = k * 0.5698402909980532;
    return origin + cell.cwiseProduct(
                        Eigen::Vector2d(column + (u - std::floor(u)), row + (v - std::floor(v))));
  }
};

double doubled_area(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c) {
  return (b.x() - a.x()) * (c.y() - a.y()) - (b.y() - a.y()) * (c.x() - a.x());
}

// Is `p` to the left of the edge? Both triangles at an edge get opposite answers, also for a point
// on it, so that a line through a closed mesh enters as often as it leaves.
bool left_of(const Eigen::Vector2d& from, const Eigen::Vector2d& to, const Eigen::Vector2d& p) {
  const bool ordered = std::pair(from.x(), from.y()) < std::pair(to.x(), to.y());
  return ordered ? doubled_area(from, to, p) >= 0 : !(doubled_area(to, from, p) >= 0);
}

void project(const TriangleMesh& mesh, Owner owner, int axis,
             std::vector<ProjectedTriangle>& triangles) {
  const int u = (axis + 1) % 3;
  const int v = (axis + 2) % 3;
  for (const Triangle& t : mesh.triangles) {
    ProjectedTriangle triangle;
    for (int k = 0; k < 3; ++k) {
      const Vec3& vertex = mesh.vertices[t[k]];
      triangle.corner[k] = {vertex[u], vertex[v]};
      triangle.depth[k] = vertex[axis];
    }
    const double area = doubled_area(triangle.corner[0], triangle.corner[1], triangle.corner[2]);
    if (area == 0) continue;
    triangle.direction = area > 0 ? -1 : 1;
    if (area < 0) {
      std::swap(triangle.corner[1], triangle.corner[2]);
      std::swap(triangle.depth[1], triangle.depth[2]);
    }
    triangle.owner = owner;
    triangles.push_back(triangle);
  }
}

struct Crossing {
  double depth;
  int8_t direction;
  Owner owner;
};

struct Lengths {
  double mesh = 0, pieces = 0, common = 0;
};

void add_lengths(std::vector<Crossing>& crossings, Lengths& lengths) {
  std::ranges::stable_sort(crossings, {}, &Crossing::depth);
  int in_mesh = 0;
  int in_pieces = 0;
  for (size_t k = 0; k < crossings.size(); ++k) {
    if (k > 0) {
      const double length = crossings[k].depth - crossings[k - 1].depth;
      if (in_mesh > 0) lengths.mesh += length;
      if (in_pieces > 0) lengths.pieces += length;
      if (in_mesh > 0 && in_pieces > 0) lengths.common += length;
    }
    (crossings[k].owner == Owner::mesh ? in_mesh : in_pieces) += crossings[k].direction;
  }
}

// Everything along the lines of one row of the grid.
Lengths measure_row(const LineGrid& grid, int row, const std::vector<ProjectedTriangle>& triangles,
                    const std::vector<uint32_t>& in_row) {
  std::vector<std::vector<Crossing>> crossings(kLines);
  for (const uint32_t index : in_row) {
    const ProjectedTriangle& triangle = triangles[index];
    const auto& [a, b, c] = triangle.corner;
    const auto [low, high] = std::minmax({a.x(), b.x(), c.x()});
    const int first = std::max(0, static_cast<int>((low - grid.origin.x()) / grid.cell.x()));
    const int last =
        std::min(kLines - 1, static_cast<int>((high - grid.origin.x()) / grid.cell.x()));
    for (int column = first; column <= last; ++column) {
      const Eigen::Vector2d p = grid.line(column, row);
      if (!left_of(a, b, p) || !left_of(b, c, p) || !left_of(c, a, p)) continue;
      const double area = doubled_area(a, b, c);
      const double at_b = doubled_area(a, p, c) / area;
      const double at_c = doubled_area(a, b, p) / area;
      const double depth = triangle.depth[0] + at_b * (triangle.depth[1] - triangle.depth[0]) +
                           at_c * (triangle.depth[2] - triangle.depth[0]);
      crossings[column].push_back({depth, triangle.direction, triangle.owner});
    }
  }
  Lengths lengths;
  for (std::vector<Crossing>& line : crossings) add_lengths(line, lengths);
  return lengths;
}

Lengths measure_along(int axis, const Bounds& bounds, const TriangleMesh& mesh,
                      std::span<const TriangleMesh> pieces) {
  const Vec3 size = bounds.sizes();
  const int u = (axis + 1) % 3;
  const int v = (axis + 2) % 3;
  const LineGrid grid{.axis = axis,
                      .origin = {bounds.min()[u], bounds.min()[v]},
                      .cell = Eigen::Vector2d(size[u], size[v]) / kLines};
  std::vector<ProjectedTriangle> triangles;
  triangles.reserve(mesh.triangles.size());
  project(mesh, Owner::mesh, axis, triangles);
  for (const TriangleMesh& piece : pieces) project(piece, Owner::pieces, axis, triangles);

  std::vector<std::vector<uint32_t>> rows(kLines);
  for (uint32_t k = 0; k < triangles.size(); ++k) {
    const auto& [a, b, c] = triangles[k].corner;
    const auto [low, high] = std::minmax({a.y(), b.y(), c.y()});
    const int first = std::max(0, static_cast<int>((low - grid.origin.y()) / grid.cell.y()));
    const int last =
        std::min(kLines - 1, static_cast<int>((high - grid.origin.y()) / grid.cell.y()));
    for (int row = first; row <= last; ++row) rows[row].push_back(k);
  }
  std::vector<Lengths> of_row(kLines);
  parallel_for(kLines, 8, [&](size_t begin, size_t end) {
    for (size_t row = begin; row < end; ++row) {
      of_row[row] = measure_row(grid, static_cast<int>(row), triangles, rows[row]);
    }
  });
  const double cell_area = grid.cell.prod();
  Lengths volumes;
  for (const Lengths& row : of_row) {
    volumes.mesh += cell_area * row.mesh;
    volumes.pieces += cell_area * row.pieces;
    volumes.common += cell_area * row.common;
  }
  return volumes;
}

}  // namespace

SolidDifference solid_difference(const TriangleMesh& mesh, std::span<const TriangleMesh> pieces) {
  Bounds bounds = mesh.bounds();
  for (const TriangleMesh& piece : pieces) bounds.extend(piece.bounds());
  SolidDifference result;
  for (int axis = 0; axis < 3; ++axis) {
    const Lengths volumes = measure_along(axis, bounds, mesh, pieces);
    result.mesh_volume_m3 += volumes.mesh / 3;
    result.union_volume_m3 += volumes.pieces / 3;
    result.common_volume_m3 += volumes.common / 3;
  }
  return result;
}

}  // namespace pilesim

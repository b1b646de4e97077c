#include "signature/rest/gauss_map.h"

#include <Eigen/Eigenvalues>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>

#include "core/error.h"
#include "geometry/convex_hull.h"

namespace pilesim {
namespace {

// Planes within this distance of a hull vertex meet there, as a share of the hull's extent.
constexpr double kSamePoint = 1e-12;
// Smaller singular values do not determine where planes meet.
constexpr double kLeastSingular = 1e-9;

// A point inside and a linear map that makes the body about as thick as it is long.
struct Rounding {
  Vec3 centre = Vec3::Zero();
  Mat3 to_round = Mat3::Identity();  // of normals: the transposed inverse of that map
};

Rounding make_round(const TriangleMesh& hull) {
  Rounding rounding;
  for (const Vec3& v : hull.vertices) {
    rounding.centre += v / static_cast<double>(hull.vertices.size());
  }
  Mat3 moments = Mat3::Zero();
  for (const Vec3& v : hull.vertices) {
    moments += (v - rounding.centre) * (v - rounding.centre).transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Mat3> axes(moments);
  Mat3 turn = axes.eigenvectors();
  if (turn.determinant() < 0) turn.col(0) = -turn.col(0);
  const double longest = std::sqrt(axes.eigenvalues()(2));
  const Vec3 lengths = axes.eigenvalues().cwiseMax(0).cwiseSqrt() / longest;
  rounding.to_round = lengths.cwiseMax(1e-9).asDiagonal() * turn.transpose();
  return rounding;
}

// The hull of the points dual to the planes: its vertices are faces, and its triangles are the
// points where three of them meet.
std::vector<std::array<uint32_t, 3>> meeting_faces(const std::vector<HullFace>& faces,
                                                   const Rounding& rounding) {
  std::vector<Vec3> points;
  std::map<std::array<double, 3>, uint32_t> face_of;
  for (uint32_t f = 0; f < faces.size(); ++f) {
    const double distance = faces[f].offset_m - faces[f].normal.dot(rounding.centre);
    points.emplace_back(rounding.to_round * faces[f].normal / distance);
    face_of.emplace(std::array{points[f].x(), points[f].y(), points[f].z()}, f);
  }
  const TriangleMesh dual = convex_hull(points);
  std::vector<std::array<uint32_t, 3>> cells;
  for (const Triangle& triangle : dual.triangles) {
    std::array<uint32_t, 3> cell{};
    for (size_t k = 0; k < 3; ++k) {
      const Vec3& point = dual.vertices[triangle[k]];
      cell[k] = face_of.at({point.x(), point.y(), point.z()});
    }
    cells.push_back(cell);
  }
  return cells;
}

// The point where three faces meet. If it is poorly determined, a point near the hull vertex
// farthest in their direction.
Vec3 meeting_point(const TriangleMesh& hull, const std::vector<HullFace>& faces,
                   const std::array<uint32_t, 3>& cell, double extent) {
  Mat3 normals;
  Vec3 offsets;
  const HullFace* smallest = &faces[cell[0]];
  for (size_t k = 0; k < 3; ++k) {
    const HullFace& face = faces[cell[k]];
    normals.row(static_cast<Eigen::Index>(k)) = face.normal;
    offsets(static_cast<Eigen::Index>(k)) = face.offset_m;
    if (face.vertices.size() < smallest->vertices.size()) smallest = &face;
  }
  const Vec3 direction = normals.colwise().sum();
  Vec3 nearest = hull.vertices[smallest->vertices.front()];
  for (const uint32_t v : smallest->vertices) {
    if (direction.dot(hull.vertices[v]) > direction.dot(nearest)) nearest = hull.vertices[v];
  }
  const Vec3 missing = offsets - normals * nearest;
  if (missing.cwiseAbs().maxCoeff() <= kSamePoint * extent) return nearest;
  Eigen::JacobiSVD<Mat3> svd(normals, Eigen::ComputeFullU | Eigen::ComputeFullV);
  svd.setThreshold(kLeastSingular);
  const Vec3 step = svd.solve(missing);
  return step.norm() < extent ? Vec3(nearest + step) : nearest;
}

void connect(GaussMap& map) {
  std::map<std::pair<uint32_t, uint32_t>, GaussMap::Side> sides;
  map.cell_at.resize(map.normals.size());
  for (uint32_t c = 0; c < map.cells.size(); ++c) {
    for (uint32_t k = 0; k < 3; ++k) {
      sides[{map.cells[c][k], map.cells[c][(k + 1) % 3]}] = {c, k};
      map.cell_at[map.cells[c][k]] = {c, k};
    }
  }
  map.across.resize(map.cells.size());
  for (const auto& [ends, side] : sides) {
    map.across[side.cell][side.corner] = sides.at({ends.second, ends.first});
  }
}

// Keeps the faces that have a cell, in their order.
GaussMap assemble(const TriangleMesh& hull, const std::vector<HullFace>& faces,
                  const Rounding& rounding, std::vector<uint32_t>& number) {
  GaussMap map;
  const auto cells = meeting_faces(faces, rounding);
  const double extent = hull.bounds().diagonal().norm();
  constexpr uint32_t kNone = UINT32_MAX;
  std::vector<uint32_t> place(faces.size(), kNone);
  for (const auto& cell : cells) {
    for (const uint32_t f : cell) place[f] = 0;
  }
  number.clear();
  for (uint32_t f = 0; f < faces.size(); ++f) {
    if (place[f] == kNone) continue;
    place[f] = static_cast<uint32_t>(number.size());
    number.push_back(f);
    map.normals.push_back(faces[f].normal);
    map.heights.push_back(faces[f].offset_m);
  }
  for (const auto& cell : cells) {
    map.cells.push_back({place[cell[0]], place[cell[1]], place[cell[2]]});
    map.apexes.push_back(meeting_point(hull, faces, cell, extent));
  }
  connect(map);
  return map;
}

// Area of a face over its greatest length, m.
double width(const GaussMap& map, uint32_t f) {
  const GaussMap::Side start = map.cell_at[f];
  const Vec3 first = map.apexes[start.cell];
  Vec3 area = Vec3::Zero(), before = first;
  double length = 0;
  GaussMap::Side at = start;
  do {
    const Vec3& vertex = map.apexes[at.cell];
    area += (before - first).cross(vertex - first) / 2;
    length = std::max(length, (vertex - first).norm());
    before = vertex;
    at = map.across[at.cell][(at.corner + 2) % 3];
  } while (at.cell != start.cell);
  return length > 0 ? area.norm() / length : 0;
}

// Faces narrower than `tolerance`, narrowest first; no two neighbours are taken in one round.
std::vector<uint8_t> narrow_faces(const GaussMap& map, double tolerance) {
  std::vector<double> widths;
  for (uint32_t f = 0; f < map.normals.size(); ++f) widths.push_back(width(map, f));
  std::vector<uint32_t> order(widths.size());
  std::iota(order.begin(), order.end(), 0U);
  std::ranges::stable_sort(order, {}, [&](uint32_t f) { return widths[f]; });
  std::vector<std::vector<uint32_t>> beside(widths.size());
  for (const auto& cell : map.cells) {
    for (size_t k = 0; k < 3; ++k) beside[cell[k]].push_back(cell[(k + 1) % 3]);
  }
  std::vector<uint8_t> narrow(widths.size(), 0);
  for (const uint32_t f : order) {
    if (widths[f] > tolerance) break;
    narrow[f] = std::ranges::none_of(beside[f], [&](uint32_t g) { return narrow[g] != 0; }) ? 1 : 0;
  }
  return narrow;
}

}  // namespace

Vec3 GaussMap::foot(const Side& side) const {
  const uint32_t f = face(side), g = face(side, 1);
  const Vec3 step = normals[g] - normals[f];
  const Vec3 towards = (step + step.squaredNorm() / 2 * normals[f]).stableNormalized();
  const double sine = normals[f].cross(normals[g]).norm();
  return heights[f] * normals[f] + clearance(f, g) / sine * towards;
}

GaussMap make_gauss_map(const TriangleMesh& hull, double shift) {
  std::vector<HullFace> faces = flat_faces(hull);
  for (size_t f = 0; f < faces.size(); ++f) {
    const double golden = 0.6180339887498949 * static_cast<double>(f + 1);
    faces[f].offset_m *= 1 + shift * (2 * (golden - std::floor(golden)) - 1);
  }
  const double tolerance = face_tolerance(hull);
  const Rounding rounding = make_round(hull);
  std::vector<uint32_t> number;
  while (true) {
    GaussMap map = assemble(hull, faces, rounding, number);
    const std::vector<uint8_t> narrow = narrow_faces(map, tolerance);
    if (std::ranges::count(narrow, 1) == 0) return map;
    std::vector<HullFace> wide;
    for (size_t f = 0; f < number.size(); ++f) {
      if (narrow[f] == 0) wide.push_back(std::move(faces[number[f]]));
    }
    faces = std::move(wide);
  }
}

}  // namespace pilesim

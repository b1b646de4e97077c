#include "signature/rest/rest_poses.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <numeric>
#include <optional>
#include <utility>

#include "geometry/convex_hull.h"

namespace pilesim {
namespace {

// Triangles whose neighbour's far vertex lies within this share of the hull's extent of their plane
// are one face.
constexpr double kFlatness = 1e-7;

// An edge of the hull is an arc of the Gauss map between the normals of its two faces.
struct Edge {
  std::array<size_t, 2> vertex;
  std::array<size_t, 2> face;
};

// The hull seen from the sphere of directions: a vertex is a cell, a face a corner of cells.
struct GaussMap {
  std::vector<Vec3> vertices;  // m, from the centre of mass
  std::vector<Vec3> normals;   // of faces, unit, outward
  std::vector<Edge> edges;
  std::vector<std::vector<size_t>> cell_edges;  // by vertex
  std::vector<std::vector<size_t>> face_edges;  // by face
};

size_t find_root(std::vector<size_t>& parent, size_t i) {
  while (parent[i] != i) i = parent[i] = parent[parent[i]];
  return i;
}

using EdgeKey = std::pair<uint32_t, uint32_t>;

std::map<EdgeKey, std::vector<size_t>> triangles_of_edges(const TriangleMesh& hull) {
  std::map<EdgeKey, std::vector<size_t>> triangles;
  for (size_t t = 0; t < hull.triangles.size(); ++t) {
    for (size_t k = 0; k < 3; ++k) {
      triangles[std::minmax(hull.triangles[t][k], hull.triangles[t][(k + 1) % 3])].push_back(t);
    }
  }
  return triangles;
}

// Twice the area times the outward normal.
Vec3 area_normal(const TriangleMesh& hull, size_t t) {
  const auto& [a, b, c] = hull.triangles[t];
  return (hull.vertices[b] - hull.vertices[a]).cross(hull.vertices[c] - hull.vertices[a]);
}

// The face of every triangle: coplanar neighbours share one. Judged on the plane of the larger
// triangle, since that of a sliver is mostly rounding.
std::vector<size_t> merge_coplanar(const TriangleMesh& hull,
                                   const std::map<EdgeKey, std::vector<size_t>>& neighbours) {
  std::vector<size_t> parent(hull.triangles.size());
  std::iota(parent.begin(), parent.end(), size_t{0});
  const double tolerance = kFlatness * hull.bounds().diagonal().norm();
  for (const auto& [edge, pair] : neighbours) {
    assert(pair.size() == 2);
    size_t large = pair[0];
    size_t small = pair[1];
    if (area_normal(hull, small).norm() > area_normal(hull, large).norm()) std::swap(large, small);
    const Vec3 normal = area_normal(hull, large).normalized();
    double distance = 0;
    for (const uint32_t v : hull.triangles[small]) {
      const Vec3 offset = hull.vertices[v] - hull.vertices[hull.triangles[large][0]];
      distance = std::max(distance, std::abs(normal.dot(offset)));
    }
    if (distance <= tolerance) parent[find_root(parent, small)] = find_root(parent, large);
  }
  std::vector<size_t> face(parent.size());
  std::map<size_t, size_t> number;
  for (size_t t = 0; t < parent.size(); ++t) {
    face[t] = number.emplace(find_root(parent, t), number.size()).first->second;
  }
  return face;
}

GaussMap make_gauss_map(const TriangleMesh& hull) {
  const auto neighbours = triangles_of_edges(hull);
  const std::vector<size_t> face = merge_coplanar(hull, neighbours);

  GaussMap map;
  map.vertices = hull.vertices;
  map.normals.assign(1 + *std::max_element(face.begin(), face.end()), Vec3::Zero());
  for (size_t t = 0; t < face.size(); ++t) map.normals[face[t]] += area_normal(hull, t);
  for (Vec3& normal : map.normals) normal.normalize();

  // A vertex inside a flat face or on a straight edge has no cell: only corners of three faces
  // count.
  std::vector<std::vector<size_t>> faces_at(hull.vertices.size());
  for (size_t t = 0; t < face.size(); ++t) {
    for (const uint32_t v : hull.triangles[t]) {
      if (std::ranges::find(faces_at[v], face[t]) == faces_at[v].end()) {
        faces_at[v].push_back(face[t]);
      }
    }
  }
  std::map<std::pair<size_t, size_t>, std::vector<size_t>> corners;
  for (const auto& [edge, pair] : neighbours) {
    if (face[pair[0]] == face[pair[1]]) continue;
    std::vector<size_t>& ends = corners[std::minmax(face[pair[0]], face[pair[1]])];
    for (const size_t v : {size_t{edge.first}, size_t{edge.second}}) {
      if (faces_at[v].size() >= 3 && std::ranges::find(ends, v) == ends.end()) ends.push_back(v);
    }
  }
  map.cell_edges.resize(map.vertices.size());
  map.face_edges.resize(map.normals.size());
  for (const auto& [faces, ends] : corners) {
    if (ends.size() != 2) continue;  // shrunk to a point by the merging
    for (const size_t v : ends) map.cell_edges[v].push_back(map.edges.size());
    map.face_edges[faces.first].push_back(map.edges.size());
    map.face_edges[faces.second].push_back(map.edges.size());
    map.edges.push_back({.vertex = {ends[0], ends[1]}, .face = {faces.first, faces.second}});
  }
  return map;
}

size_t other(const std::array<size_t, 2>& pair, size_t one) {
  return pair[0] == one ? pair[1] : pair[0];
}

// The point of the edge's line that is nearest to the centre of mass.
Vec3 foot_on_line(const GaussMap& map, const Edge& edge) {
  const Vec3& a = map.vertices[edge.vertex[0]];
  const Vec3 along = (map.vertices[edge.vertex[1]] - a).normalized();
  return a - along.dot(a) * along;
}

// The flow crosses an arc from the cell of `from` into that of `to` where the foot of the centre of
// mass lies beyond `to`; otherwise, with the foot between the two, both cells flow into the arc: a
// valley.
bool crosses(const GaussMap& map, size_t from, size_t to) {
  return map.vertices[from].dot(map.vertices[to]) > map.vertices[to].squaredNorm();
}

// Where a great circle through the cell's apex (the direction of its vertex) meets the cell's
// border.
struct Crossing {
  size_t edge;
  Vec3 direction;
};

// Within the cell of vertex v, U(d) = d . v: the flow runs along great circles away from v / |v|.
// `ahead`: the border that the flow from `d` reaches. Not `ahead`: the one that it came from, or
// none if it came from the apex, a maximum of U.
std::optional<Crossing> trace_cell(const GaussMap& map, size_t v, const Vec3& d, bool ahead) {
  const Vec3 apex = map.vertices[v].normalized();
  const Vec3 tangent = (d - apex.dot(d) * apex).normalized();
  const double start = std::atan2(d.dot(tangent), d.dot(apex));
  std::optional<size_t> nearest;
  double nearest_angle = ahead ? kPi : 0;
  for (const size_t e : map.cell_edges[v]) {
    // Inside the cell the height above the neighbour's, gap(t) = R cos(t - phase), is positive.
    const Vec3 gap = map.vertices[v] - map.vertices[other(map.edges[e].vertex, v)];
    const double phase = std::atan2(tangent.dot(gap), apex.dot(gap));
    if (ahead) {
      const double leaves = phase + kPi / 2;
      if (leaves < nearest_angle) {
        nearest_angle = leaves;
        nearest = e;
      }
    } else {
      const double enters = phase - kPi / 2;
      if (enters > nearest_angle && enters < start) {
        nearest_angle = enters;
        nearest = e;
      }
    }
  }
  if (!nearest) return std::nullopt;
  return Crossing{*nearest, std::cos(nearest_angle) * apex + std::sin(nearest_angle) * tangent};
}

// Of a face: where on it the centre of mass projects.
struct Support {
  bool stable = true;
  std::optional<size_t> edge;    // nearest in the middle of an edge
  std::optional<size_t> vertex;  // nearest at a corner
};

Support support_of_face(const GaussMap& map, size_t f) {
  const Vec3& normal = map.normals[f];
  Vec3 centre = Vec3::Zero();
  for (const size_t e : map.face_edges[f]) {
    for (const size_t v : map.edges[e].vertex) centre += map.vertices[v];
  }
  centre /= 2.0 * static_cast<double>(map.face_edges[f].size());
  const Vec3 foot = normal.dot(centre) * normal;

  Support support;
  double least = std::numeric_limits<double>::infinity();
  for (const size_t e : map.face_edges[f]) {
    const Vec3& a = map.vertices[map.edges[e].vertex[0]];
    const Vec3 along = map.vertices[map.edges[e].vertex[1]] - a;
    Vec3 inward = normal.cross(along);
    if (inward.dot(centre - a) < 0) inward = -inward;
    if (inward.dot(foot - a) < 0) support.stable = false;

    const double share = along.dot(foot - a) / along.squaredNorm();
    const double distance = (foot - a - std::clamp(share, 0.0, 1.0) * along).norm();
    if (distance >= least) continue;
    least = distance;
    support.edge.reset();
    support.vertex.reset();
    if (share <= 0) {
      support.vertex = map.edges[e].vertex[0];
    } else if (share >= 1) {
      support.vertex = map.edges[e].vertex[1];
    } else {
      support.edge = e;
    }
  }
  return support;
}

// Along a valley U falls away from the direction of the foot: the face that the flow from `d` on
// the arc of `e` reaches.
size_t end_of_valley(const GaussMap& map, size_t e, const Vec3& d) {
  const Edge& edge = map.edges[e];
  const Vec3 top = foot_on_line(map, edge).normalized();
  const Vec3 axis = map.normals[edge.face[0]].cross(map.normals[edge.face[1]]);
  return top.cross(d).dot(axis) > 0 ? edge.face[1] : edge.face[0];
}

class Flow {
 public:
  explicit Flow(const GaussMap& map) : map_(map) {
    for (size_t f = 0; f < map.normals.size(); ++f) supports_.push_back(support_of_face(map, f));
  }

  bool stable(size_t face) const { return supports_[face].stable; }

  size_t from_face(size_t face) const {
    for (size_t guard = 0; guard <= map_.normals.size(); ++guard) {
      const Support& support = supports_[face];
      if (support.stable) return face;
      face = support.edge ? other(map_.edges[*support.edge].face, face)
                          : leave_cell(*support.vertex, map_.normals[face]);
    }
    assert(false && "the flow falls at every step, so that it cannot run in a circle");
    return face;
  }

  size_t from_direction(const Vec3& down) const {
    size_t v = 0;
    for (size_t i = 1; i < map_.vertices.size(); ++i) {
      if (map_.cell_edges[i].empty()) continue;
      if (map_.cell_edges[v].empty() || down.dot(map_.vertices[i]) > down.dot(map_.vertices[v])) {
        v = i;
      }
    }
    return from_face(leave_cell(v, down));
  }

 private:
  // From `d` in the cell of `v` on through cells to the first face.
  size_t leave_cell(size_t v, Vec3 d) const {
    for (size_t guard = 0; guard <= map_.vertices.size(); ++guard) {
      const std::optional<Crossing> crossing = trace_cell(map_, v, d, true);
      assert(crossing && "every great circle leaves a cell within half a turn");
      const size_t next = other(map_.edges[crossing->edge].vertex, v);
      d = crossing->direction;
      if (!crosses(map_, v, next)) return end_of_valley(map_, crossing->edge, d);
      v = next;
    }
    assert(false && "each cell passed lies lower than the one before");
    return 0;
  }

  const GaussMap& map_;
  std::vector<Support> supports_;
};

// The saddle of an edge, if the direction of its foot lies within its arc.
std::optional<Vec3> saddle(const GaussMap& map, const Edge& edge) {
  const auto& [a, b] = edge.vertex;
  if (crosses(map, a, b) || crosses(map, b, a)) return std::nullopt;
  const Vec3 top = foot_on_line(map, edge).normalized();
  const Vec3& n0 = map.normals[edge.face[0]];
  const Vec3& n1 = map.normals[edge.face[1]];
  const Vec3 axis = n0.cross(n1);
  if (n0.cross(top).dot(axis) <= 0 || top.cross(n1).dot(axis) <= 0) return std::nullopt;
  return top;
}

// The points at which the flow line that comes down into `from` within the cell of `v` turns, from
// `from` up to a maximum of U.
std::vector<Vec3> climb(const GaussMap& map, size_t v, const Vec3& from) {
  std::vector<Vec3> points = {from};
  for (size_t guard = 0; guard <= map.vertices.size(); ++guard) {
    const std::optional<Crossing> crossing = trace_cell(map, v, points.back(), false);
    if (!crossing) {
      points.emplace_back(map.vertices[v].normalized());
      return points;
    }
    points.push_back(crossing->direction);
    v = other(map.edges[crossing->edge].vertex, v);
  }
  assert(false && "each cell passed lies higher than the one before");
  return points;
}

// Signed solid angle of a spherical triangle (Van Oosterom and Strackee 1983), positive when a, b,
// c turn to the left seen from outside.
double solid_angle(const Vec3& a, const Vec3& b, const Vec3& c) {
  return 2 * std::atan2(a.dot(b.cross(c)), 1 + a.dot(b) + b.dot(c) + c.dot(a));
}

// The sum over a border is the area up to whole spheres (its triangles may wind around).
double positive_modulo_sphere(double area) {
  const double sphere = 4 * kPi;
  area = std::fmod(area, sphere);
  return area < 0 ? area + sphere : area;
}

// Of the centre of mass when the body lies on the face.
double height_on(const GaussMap& map, size_t face) {
  const size_t corner = map.edges[map.face_edges[face].front()].vertex[0];
  return map.normals[face].dot(map.vertices[corner]);
}

// From 0 on in the order of first appearance.
void number_families(std::vector<RestPose>& poses) {
  std::map<uint32_t, uint32_t> number;
  for (RestPose& pose : poses) {
    const auto next = static_cast<uint32_t>(number.size());
    pose.family = number.emplace(pose.family, next).first->second;
  }
}

}  // namespace

std::vector<RestPose> stable_rest_poses(const TriangleMesh& hull) {
  const GaussMap map = make_gauss_map(hull);
  const Flow flow(map);

  // Each saddle's two flow lines down end in two minima, and its two lines up are the border
  // between their basins. The area of a basin is the sum of triangles from its minimum over its
  // border.
  std::vector<double> area(map.normals.size(), 0);
  std::vector<size_t> family(map.normals.size());
  std::iota(family.begin(), family.end(), size_t{0});
  for (const Edge& edge : map.edges) {
    const std::optional<Vec3> top = saddle(map, edge);
    if (!top) continue;
    const Vec3 travel = map.vertices[edge.vertex[1]] - map.vertices[edge.vertex[0]];
    const bool first_is_left = map.normals[edge.face[0]].dot(top->cross(travel)) > 0;
    const size_t left = flow.from_face(edge.face[first_is_left ? 0 : 1]);
    const size_t right = flow.from_face(edge.face[first_is_left ? 1 : 0]);
    if (left == right) continue;
    const double top_m = top->dot(map.vertices[edge.vertex[0]]);
    const double lower_m = std::min(height_on(map, left), height_on(map, right));
    if (top_m <= (1 + kFamilyBarrier) * lower_m) {
      family[find_root(family, left)] = find_root(family, right);
    }

    std::vector<Vec3> border = climb(map, edge.vertex[0], *top);
    std::ranges::reverse(border);
    const std::vector<Vec3> second = climb(map, edge.vertex[1], *top);
    border.insert(border.end(), second.begin() + 1, second.end());
    for (size_t i = 0; i + 1 < border.size(); ++i) {
      area[left] += solid_angle(map.normals[left], border[i], border[i + 1]);
      area[right] += solid_angle(map.normals[right], border[i + 1], border[i]);
    }
  }

  std::vector<RestPose> poses;
  for (size_t f = 0; f < map.normals.size(); ++f) {
    if (!flow.stable(f)) continue;
    poses.push_back({.up = -map.normals[f],
                     .height_m = height_on(map, f),
                     .probability = positive_modulo_sphere(area[f]) / (4 * kPi),
                     .family = static_cast<uint32_t>(find_root(family, f))});
  }
  if (poses.size() == 1) poses.front().probability = 1;
  std::ranges::stable_sort(poses, std::greater{}, &RestPose::probability);
  number_families(poses);
  return poses;
}

std::vector<RestPose> mesh_rest_poses(const TriangleMesh& mesh, const Vec3& centre_of_mass) {
  TriangleMesh hull = convex_hull(mesh.vertices);
  for (Vec3& v : hull.vertices) v -= centre_of_mass;
  return stable_rest_poses(hull);
}

std::vector<size_t> roll_to_rest(const TriangleMesh& hull, const std::vector<RestPose>& poses,
                                 std::span<const Vec3> downs) {
  const GaussMap map = make_gauss_map(hull);
  const Flow flow(map);
  std::vector<size_t> reached;
  for (const Vec3& down : downs) {
    const Vec3 up = -map.normals[flow.from_direction(down)];
    const auto pose =
        std::ranges::max_element(poses, {}, [&](const RestPose& p) { return up.dot(p.up); });
    reached.push_back(static_cast<size_t>(pose - poses.begin()));
  }
  return reached;
}

std::vector<RestPose> cluster_rest_poses(const std::vector<RestPose>& poses, double angle,
                                         double least_probability) {
  std::vector<RestPose> clusters;
  for (const RestPose& pose : poses) {
    const auto near = std::ranges::find_if(
        clusters, [&](const RestPose& c) { return c.up.dot(pose.up) >= std::cos(angle); });
    if (near == clusters.end()) {
      clusters.push_back(pose);
    } else {
      near->probability += pose.probability;
    }
  }
  std::map<uint32_t, double> together;
  for (const RestPose& c : clusters) together[c.family] += c.probability;
  std::erase_if(clusters,
                [&](const RestPose& c) { return together[c.family] < least_probability; });
  std::ranges::stable_sort(clusters, std::greater{}, &RestPose::probability);
  return clusters;
}

}  // namespace pilesim

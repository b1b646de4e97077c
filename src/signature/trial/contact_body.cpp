#include "signature/trial/contact_body.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <span>

#include "core/error.h"
#include "geometry/convex_hull.h"
#include "geometry/mass_properties.h"
#include "geometry/mesh_check.h"
#include "geometry/mesh_group.h"

namespace pilesim {
namespace {

// Largest rotation of a flight in one step of the search, rad. The Taylor series of the rotation
// and the bounds on its derivatives hold up to it.
constexpr double kLongestTurn = 0.5;

// Bounds the third derivative of a direction, seen from the freely turning body, over one step.
void bound_turning(ContactBody& body) {
  const Vec3& c = body.euler;
  const double largest = c.cwiseAbs().maxCoeff();
  // |spin|^2 changes at the rate 2 (c1 + c2 + c3) w1 w2 w3, |w1 w2 w3| <= |w|^3 / sqrt(27).
  const double drift = std::abs(c.sum()) / std::sqrt(27.0);
  const double growth = 1 / (1 - drift * kLongestTurn);  // of |spin| over the step
  // |dw/dt| <= largest |w|^2 / sqrt(3), |d2w/dt2| <= 2 largest |dw/dt| |w|.
  const double first = largest / std::sqrt(3.0);
  const double second = 2 * largest * first;
  body.turn_jerk_bound = growth * growth * growth * (1 + 3 * first + second);
}

// Orders `numbers` of vertices so that neighbours are grouped: splits along the longest side, at a
// multiple of the group's size.
void group_neighbours(const std::vector<Vec3>& vertices, std::span<uint32_t> numbers) {
  constexpr size_t kGroup = ContactBody::kGroup;
  if (numbers.size() <= kGroup) return;
  Bounds bounds;
  for (const uint32_t v : numbers) bounds.extend(vertices[v]);
  Eigen::Index axis = 0;
  bounds.sizes().maxCoeff(&axis);
  const size_t groups = (numbers.size() + kGroup - 1) / kGroup;
  const size_t half = (groups + 1) / 2 * kGroup;
  std::nth_element(numbers.begin(), numbers.begin() + static_cast<ptrdiff_t>(half), numbers.end(),
                   [&](uint32_t a, uint32_t b) { return vertices[a](axis) < vertices[b](axis); });
  group_neighbours(vertices, numbers.first(half));
  group_neighbours(vertices, numbers.subspan(half));
}

// Stores the vertices of `hull` in groups of neighbours, with the edge data that the contact search
// needs.
void take_vertices(ContactBody& body, const TriangleMesh& hull) {
  std::vector<uint32_t> order(hull.vertices.size()), place(order.size());
  std::iota(order.begin(), order.end(), 0U);
  group_neighbours(hull.vertices, order);
  for (uint32_t i = 0; i < order.size(); ++i) {
    body.vertices.push_back(hull.vertices[order[i]]);
    place[order[i]] = i;
  }
  // Every edge belongs to two triangles with opposite orientations.
  std::vector<std::array<uint32_t, 2>> edges;
  for (const Triangle& t : hull.triangles) {
    for (size_t i = 0; i < 3; ++i) edges.push_back({place[t[i]], place[t[(i + 1) % 3]]});
  }
  body.support = SupportMap(body.vertices, edges);
}

void lay_out_lanes(ContactBody& body) {
  constexpr size_t kGroup = ContactBody::kGroup;
  const size_t count = body.vertices.size();
  const size_t groups = (count + kGroup - 1) / kGroup;
  // Covers the rounding to float.
  const double rounding = 1e-6 * body.outer_radius_m;
  for (size_t group = 0; group < groups; ++group) {
    Bounds bounds;
    double extent = 0;
    for (size_t i = group * kGroup; i < (group + 1) * kGroup; ++i) {
      const Vec3& v = body.vertices[std::min(i, count - 1)];
      body.lane_x.push_back(static_cast<float>(v.x()));
      body.lane_y.push_back(static_cast<float>(v.y()));
      body.lane_z.push_back(static_cast<float>(v.z()));
      bounds.extend(v);
    }
    const Vec3 centre = bounds.center();
    for (size_t i = group * kGroup; i < std::min((group + 1) * kGroup, count); ++i) {
      extent = std::max(extent, (body.vertices[i] - centre).norm());
    }
    body.group_x.push_back(static_cast<float>(centre.x()));
    body.group_y.push_back(static_cast<float>(centre.y()));
    body.group_z.push_back(static_cast<float>(centre.z()));
    body.group_extent.push_back(static_cast<float>(extent + rounding));
  }
  for (auto* values : {&body.group_x, &body.group_y, &body.group_z, &body.group_extent}) {
    values->resize((groups + kGroup - 1) / kGroup * kGroup, values->front());
  }
}

double energy_reach_m(const ContactBody& body) {
  const auto to_spin = (body.gyration_m * body.inverse_inertia.cwiseSqrt()).asDiagonal();
  double greatest = 0;
  for (const Vec3& r : body.vertices) {
    const Mat3 squares =
        to_spin * (r.squaredNorm() * Mat3::Identity() - r * r.transpose()) * to_spin;
    Eigen::SelfAdjointEigenSolver<Mat3> solver;
    solver.computeDirect(squares, Eigen::EigenvaluesOnly);
    greatest = std::max(greatest, solver.eigenvalues().maxCoeff());
  }
  return std::sqrt(greatest) * (1 + 1e-6);
}

// `hull` in the body frame, inertia set.
void finish(ContactBody& body, const TriangleMesh& hull) {
  take_vertices(body, hull);
  const Vec3& i = body.inertia_m2;
  body.inverse_inertia = i.cwiseInverse();
  body.euler = Vec3(i.y() - i.z(), i.z() - i.x(), i.x() - i.y()).cwiseQuotient(i);
  body.gyration_m = std::sqrt(i.sum() / 3);
  for (const Vec3& v : body.vertices) {
    body.outer_radius_m = std::max(body.outer_radius_m, v.norm());
  }
  // Over all normals for which a vertex is lowest, its sideways distance is largest at a corner of
  // their region, which is the normal of a face.
  for (const Triangle& t : hull.triangles) {
    const Vec3& a = hull.vertices[t[0]];
    const Vec3 normal = (hull.vertices[t[1]] - a).cross(hull.vertices[t[2]] - a).stableNormalized();
    for (const uint32_t corner : t) {
      const Vec3& v = hull.vertices[corner];
      body.reach_m = std::max(body.reach_m, (v - v.dot(normal) * normal).norm());
    }
  }
  body.reach_m = std::min(body.outer_radius_m, body.reach_m * (1 + 1e-9));
  body.energy_reach_m = energy_reach_m(body);
  bound_turning(body);
  lay_out_lanes(body);
}

void use_principal_frame(ContactBody& body, const Mat3& inertia, TriangleMesh& hull) {
  const PrincipalInertia principal = principal_inertia(inertia);
  body.inertia_m2 = principal.moments;
  body.principal_axes = principal.axes;
  const Quat to_body = principal.axes.conjugate();
  for (Vec3& v : hull.vertices) v = to_body * v;
}

// Hull and, nearly, mass are still defined where triangles cross. Closed parts that touch are no
// proper solid as one mesh, but have both as well.
std::vector<MeshDefect> solid_defects(const TriangleMesh& mesh) {
  std::vector<MeshDefect> defects = find_volume_defects(mesh);
  const bool closed_groups =
      mesh.groups.size() > 1 &&
      std::all_of(mesh.groups.begin(), mesh.groups.end(), [&](const MeshGroup& group) {
        return find_volume_defects(group_mesh(mesh, group)).empty();
      });
  if (closed_groups) defects.clear();
  return defects;
}

}  // namespace

bool has_mass_and_hull(const TriangleMesh& mesh) { return solid_defects(mesh).empty(); }

void check_material(const ContactMaterial& material) {
  const auto demand = [](bool good, const std::string& found, const std::string& expected) {
    if (!good) throw Error(ErrorKind::usage, {.found = found, .expected = expected});
  };
  // Negated comparisons also reject NaN.
  demand(material.restitution >= 0 && material.restitution <= 1,
         "restitution is " + std::to_string(material.restitution), "a number from 0 to 1");
  demand(material.friction >= 0 && std::isfinite(material.friction),
         "friction is " + std::to_string(material.friction), "a number of at least 0");
  demand(
      material.restitution_threshold_m_s >= 0 && std::isfinite(material.restitution_threshold_m_s),
      "the restitution threshold is " + std::to_string(material.restitution_threshold_m_s) + " m/s",
      "a speed of at least 0");
}

ContactBody make_contact_body(const TriangleMesh& mesh, const std::string& mesh_name) {
  std::vector<Problem> problems;
  for (const MeshDefect& defect : solid_defects(mesh)) {
    problems.push_back({.file = mesh_name,
                        .found = defect.text,
                        .expected = "a closed surface with outward triangles",
                        .remedy = "Close and re-orient the mesh in a modelling tool"});
  }
  if (!problems.empty()) throw Error(ErrorKind::input, problems);

  TriangleMesh hull;
  try {
    hull = convex_hull(mesh.vertices);
  } catch (const Error& error) {
    problems = error.problems();
    for (Problem& problem : problems) problem.file = mesh_name;
    throw Error(error.kind(), problems);
  }
  if (hull.vertices.size() > kMaxHullVertices) {
    throw Error(ErrorKind::input, {.file = mesh_name,
                                   .found = "the convex hull has " +
                                            std::to_string(hull.vertices.size()) + " vertices",
                                   .expected = "at most " + std::to_string(kMaxHullVertices),
                                   .remedy = "Simplify the mesh: contacts need no finer one"});
  }
  const MassProperties mass = mass_properties(mesh);
  ContactBody body;
  body.mesh_hash = mesh_hash(mesh);
  body.centre_of_mass = mass.centre_of_mass;
  for (Vec3& v : hull.vertices) v -= mass.centre_of_mass;
  use_principal_frame(body, mass.inertia_m5 / mass.volume_m3, hull);
  finish(body, hull);
  return body;
}

ContactBody make_contact_body(const TriangleMesh& hull, const Mat3& inertia_m2) {
  ContactBody body;
  body.mesh_hash = mesh_hash(hull);
  TriangleMesh turned = hull;
  use_principal_frame(body, inertia_m2, turned);
  finish(body, turned);
  return body;
}

}  // namespace pilesim

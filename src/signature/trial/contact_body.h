// A rigid body for collision trials: the vertices of its hull about the centre of mass, in its
// principal axes, and its inertia. All values are per unit of mass, because density does not affect
// how a body bounces off a plane.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "core/types.h"
#include "geometry/mesh.h"
#include "signature/trial/support_map.h"

namespace pilesim {

// The material of a contact. Speed matters only if restitution_threshold_m_s is set.
struct ContactMaterial {
  double restitution = 0.3;  // 0 .. 1
  double friction = 0.5;     // >= 0
  // Contacts that approach more slowly do not bounce (impulse engines need this to come to rest).
  // 0: restitution is independent of speed, and the response is homogeneous.
  double restitution_threshold_m_s = 0;

  bool scale_free() const { return restitution_threshold_m_s == 0; }
};

// Throws Error(usage) naming the value that is out of its range.
void check_material(const ContactMaterial& material);

struct ContactBody {
  // Vertices, m, in principal axes at the centre of mass. `lane_*` hold the same as floats for
  // SIMD, in groups of neighbours. `group_*` is a bounding sphere per group; lanes and groups are
  // padded with copies to multiples of kGroup.
  static constexpr size_t kGroup = 8;
  std::vector<Vec3> vertices;
  std::vector<float> lane_x, lane_y, lane_z;
  std::vector<float> group_x, group_y, group_z;
  std::vector<float> group_extent;  // radius of the group's bounding sphere
  SupportMap support;

  Vec3 inertia_m2 = Vec3::Ones();  // principal moments per unit of mass, ascending
  Vec3 inverse_inertia = Vec3::Ones();
  Vec3 euler = Vec3::Zero();           // ((I2 - I3) / I1, (I3 - I1) / I2, (I1 - I2) / I3)
  Vec3 centre_of_mass = Vec3::Zero();  // m, the frame of the mesh
  Quat principal_axes;                 // body frame to the axes of the mesh
  double gyration_m = 0;               // k: 3 k^2 = the sum of the moments
  double outer_radius_m = 0;           // distance of the farthest vertex
  double reach_m = 0;          // largest sideways distance of a contact from the centre of mass
  double energy_reach_m = 0;   // greatest |k I^(-1/2) u x r| of a vertex r and a unit u
  double turn_jerk_bound = 0;  // bound on |third derivative of a direction| / |spin|^3
  std::string mesh_hash;

  size_t vertex_count() const { return vertices.size(); }
};

// True if make_contact_body() accepts it: closed; its triangles may cross.
bool has_mass_and_hull(const TriangleMesh& mesh);

// `mesh` is a proper solid. Throws Error(input), naming `mesh_name`, for an open or inside-out
// mesh, one without extent or thickness, or one whose hull has more than kMaxHullVertices vertices.
inline constexpr size_t kMaxHullVertices = 20000;
ContactBody make_contact_body(const TriangleMesh& mesh, const std::string& mesh_name);

// The same for a given hull and inertia (unit mass, about the centre of mass, which is the origin):
// for exact primitives and compounds.
ContactBody make_contact_body(const TriangleMesh& hull, const Mat3& inertia_m2);

}  // namespace pilesim

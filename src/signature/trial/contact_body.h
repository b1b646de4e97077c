// A rigid body as its collisions see it: the vertices of its hull about the centre of mass, in its
// principal axes, and its inertia. Everything is per unit of mass, because density does not change
// how a body bounces off a plane.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "core/types.h"
#include "geometry/mesh.h"
#include "signature/trial/support_map.h"

namespace pilesim {

// The material of a contact. Speeds change nothing unless restitution_threshold_m_s is set.
struct ContactMaterial {
  double restitution = 0.3;  // 0 .. 1
  double friction = 0.5;     // >= 0
  // Contacts that approach slower than this do not bounce (impulse engines do that to come to
  // rest). 0: restitution is the same at every speed, the response is homogeneous.
  double restitution_threshold_m_s = 0;

  bool scale_free() const { return restitution_threshold_m_s == 0; }
};

// Throws Error(usage) naming the value that is out of its range.
void check_material(const ContactMaterial& material);

struct ContactBody {
  // Vertices, m; the body frame is principal axes at the centre of mass. `lane_*` hold the same as
  // floats, padded with copies to a multiple of kGroup, for the vector unit: groups of neighbours,
  // each within the ball of `group_*`, whose own lanes are padded to a multiple of kGroup, too.
  static constexpr size_t kGroup = 8;
  std::vector<Vec3> vertices;
  std::vector<float> lane_x, lane_y, lane_z;
  std::vector<float> group_x, group_y, group_z;
  std::vector<float> group_extent;  // radius of the ball
  SupportMap support;

  Vec3 inertia_m2 = Vec3::Ones();  // principal moments per unit of mass, ascending
  Vec3 inverse_inertia = Vec3::Ones();
  Vec3 euler = Vec3::Zero();           // ((I2 - I3) / I1, (I3 - I1) / I2, (I1 - I2) / I3)
  Vec3 centre_of_mass = Vec3::Zero();  // m, the frame of the mesh
  Quat principal_axes;                 // body frame to the axes of the mesh
  double gyration_m = 0;               // k: 3 k^2 = the sum of the moments
  double outer_radius_m = 0;           // the farthest vertex
  double reach_m = 0;                  // farthest sideways from under the centre a contact can be
  double energy_reach_m = 0;           // greatest |k I^(-1/2) u x r| of a vertex r and a unit u
  double turn_jerk_bound = 0;          // bound of |third derivative of a direction| / |spin|^3
  std::string mesh_hash;

  size_t vertex_count() const { return vertices.size(); }
};

// Whether make_contact_body() takes it: closed, its triangles may cross.
bool has_mass_and_hull(const TriangleMesh& mesh);

// `mesh` is a proper solid. Throws Error(input), naming `mesh_name`, for an open or inside-out
// mesh, one without extent or thickness, or one whose hull has more than kMaxHullVertices vertices.
inline constexpr size_t kMaxHullVertices = 20000;
ContactBody make_contact_body(const TriangleMesh& mesh, const std::string& mesh_name);

// The same for a hull and inertia given directly (of unit mass, about the centre of mass, which is
// the origin): exact primitives in tests and compounds.
ContactBody make_contact_body(const TriangleMesh& hull, const Mat3& inertia_m2);

}  // namespace pilesim

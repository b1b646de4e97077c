// Mass, centre of mass and inertia of closed meshes by polyhedral integrals (Mirtich 1996, in the
// tetrahedral form), exact up to rounding, and of primitives in closed form.
#pragma once

#include "core/types.h"
#include "geometry/mesh.h"

namespace pilesim {

// At unit density: multiply volume and inertia by a density to get kg and kg m^2.
struct MassProperties {
  double volume_m3 = 0;                // > 0 for a mesh with outward triangles
  Vec3 centre_of_mass = Vec3::Zero();  // m, the frame of the mesh
  Mat3 inertia_m5 = Mat3::Zero();      // about the centre of mass, axes of the mesh's frame
};

// `mesh` is closed with outward triangles (find_mesh_defects is empty); overlapping closed pieces
// count twice.
MassProperties mass_properties(const TriangleMesh& mesh);

MassProperties box_mass_properties(const Vec3& size);                   // full edge lengths, m
MassProperties sphere_mass_properties(double radius);                   // m
MassProperties cylinder_mass_properties(double radius, double height);  // axis y, m

// The rate |spin| as far as the body's mass takes part in it, sqrt(w I w / largest moment), rad/s:
// a needle that rolls about its own axis hardly moves. `inertia`: of any unit, in the spin's axes.
double felt_turn_rate(const Mat3& inertia, const Vec3& spin);

// Rigid union of parts that do not overlap.
MassProperties combine(const std::vector<MassProperties>& parts);
// The same body seen from a frame in which its own frame stands at `pose`.
MassProperties transformed(const MassProperties& properties, const Pose& pose);

// Principal moments (ascending) and the rotation that takes principal axes to the mesh's frame,
// right-handed, chosen the same way on every run.
struct PrincipalInertia {
  Vec3 moments;
  Quat axes;
};
PrincipalInertia principal_inertia(const Mat3& inertia);

}  // namespace pilesim

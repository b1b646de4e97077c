// Solids of revolution about the y axis: cones, capsules, rings.
#pragma once

#include <vector>

#include "geometry/mass_properties.h"
#include "geometry/mesh.h"

namespace pilesim {

// A polygon of points (radius, y), m, radius >= 0, that is turned about the axis; counter-clockwise
// with the radius to the right. Where it has points on the axis, they are its first and its last.
using Profile = std::vector<Eigen::Vector2d>;

Profile frustum_profile(double radius, double top_radius, double height);  // top_radius >= 0
// `height` is over all, > 2 radius; its halves of a circle have `across` edges each.
Profile capsule_profile(double radius, double height, int across);
// A circle of radius `tube` at `ring` from the axis, as `across` corners on it, with edges that are
// level at the lowest and the highest where `across` is even.
Profile torus_profile(double ring, double tube, int across);
Profile tube_profile(double outer, double inner, double height);

// Exact, for the solid that the profile's edges sweep.
MassProperties revolved_mass(const Profile& profile);

// Closed, with outward triangles; `sides` corners on the circle of each point.
TriangleMesh revolved_mesh(const Profile& profile, int sides);

}  // namespace pilesim

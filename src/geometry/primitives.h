// Closed meshes of the primitive shapes, for drawing, hulls and tests. Centred at the origin.
#pragma once

#include "geometry/mesh.h"

namespace pilesim {

TriangleMesh box_mesh(const Vec3& size);                                   // full edge lengths, m
TriangleMesh sphere_mesh(double radius, int subdivisions = 3);             // subdivided icosahedron
TriangleMesh cylinder_mesh(double radius, double height, int sides = 48);  // axis y

}  // namespace pilesim

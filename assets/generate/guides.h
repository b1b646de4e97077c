// Guide shapes that a pile is packed into, m; closed, standing on y = 0 around the origin.
#pragma once

#include "geometry/mesh.h"

namespace pilesim {

TriangleMesh column();        // 2 m tall, 0.8 m thick
TriangleMesh cut_sphere();    // 1.4 m tall, 1.6 m wide, cut level below
TriangleMesh l_guide();       // 2 m tall and 1.6 m wide; limbs here and below 0.6 m thick
TriangleMesh t_guide();       // 2 m tall and wide
TriangleMesh arch();          // 1.9 m tall, 2.2 m wide
TriangleMesh torus();         // upright on a flat foot, 2 m tall, its tube 0.6 m thick
TriangleMesh cone();          // 2 m tall, base radius 1 m
TriangleMesh spiral_tower();  // 2.8 m tall, base radius 1.4 m, a ramp climbs it in four turns
TriangleMesh heart();         // 2 m tall, upright in the plane z = 0, with a flat foot
TriangleMesh letters();       // "PILE" in the plane z = 0, 2 m tall; a group each letter

}  // namespace pilesim

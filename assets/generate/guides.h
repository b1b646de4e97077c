// Guide shapes that a pile is packed into, m; closed, standing on y = 0 around the origin.
#pragma once

#include "geometry/mesh.h"

namespace pilesim {

TriangleMesh cone();          // 2 m tall, base radius 1 m
TriangleMesh spiral_tower();  // 2.8 m tall, base radius 1.4 m, a ramp climbs it in four turns
TriangleMesh heart();         // 2 m tall, upright in the plane z = 0, with a flat foot
TriangleMesh letters();       // "PILE" in the plane z = 0, 2 m tall; a group each letter

}  // namespace pilesim

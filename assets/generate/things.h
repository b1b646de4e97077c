// Everyday things in their natural sizes, m, y up.
#pragma once

#include "geometry/mesh.h"

namespace pilesim {

// One convex piece.
TriangleMesh box();           // 0.2 m cube, centred
TriangleMesh stick();         // 1 m along x, 2 cm thick, centred
TriangleMesh playing_card();  // 63 x 88 x 0.3 mm, lying across y, centred

// Named convex parts.
TriangleMesh l_shape();  // 0.2 m tall
TriangleMesh cross();    // four arms, 1.5 m across, to spin about z; centred
TriangleMesh pole();     // 1.5 m on a base plate, for rings to fall around; stands on y = 0
TriangleMesh book();     // 0.17 x 0.03 x 0.24 m, spine at -x, lying, centred
TriangleMesh chair();    // 0.9 m tall, facing +z; stands on y = 0
TriangleMesh crate();    // 1.2 m wide, open above; stands on y = 0
TriangleMesh cart();     // 2 m long along x, open above, four wheels; stands on y = 0

// One smooth closed surface each.
TriangleMesh ring();    // 0.3 m across, axis y, centred; falls around pole()
TriangleMesh tyre();    // 0.65 m across, axis y, centred
TriangleMesh banana();  // 0.21 m long, bent in the plane z = 0, centred

}  // namespace pilesim

// The project's two figures, sculpted as implicit surfaces: ours, made for this project.
#pragma once

#include "generate/implicit.h"
#include "generate/polygonise.h"

namespace pilesim {

// What is modelled: `full` for thousands of triangles, `coarse` for hundreds (no eyes, toes or
// grooves), `distant` for tens (no small parts, and limbs and ears thick enough to last).
enum class Detail { full, coarse, distant };

struct Sculpture {
  Field field;
  Bounds region;  // contains the surface, m
  Focus face;
  double cell_m;  // grid that catches its smallest details
};

// A sitting rabbit, 0.3 m long, standing on y = 0 and facing +x.
Sculpture rabbit(Detail detail);

// An upright figure in banded armour with a tail, 0.4 m tall, standing on y = 0 and facing +z.
Sculpture armoured_biped(Detail detail);

}  // namespace pilesim

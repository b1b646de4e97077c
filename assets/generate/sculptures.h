// The project's two figures, sculpted as implicit surfaces: ours, made for this project.
#pragma once

#include "generate/implicit.h"

namespace pilesim {

// The coarse figure leaves out what a few hundred triangles cannot show (eyes, toes, grooves) and
// thickens what they would lose (ears, claws).
enum class Detail { full, coarse };

struct Sculpture {
  Field field;
  Bounds region;  // contains the surface, m
};

// A sitting rabbit, 0.3 m long, standing on y = 0 and facing +x.
Sculpture rabbit(Detail detail);

// An upright figure in banded armour with a tail, 0.4 m tall, standing on y = 0 and facing +z.
Sculpture armoured_biped(Detail detail);

}  // namespace pilesim

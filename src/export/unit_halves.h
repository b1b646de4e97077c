// Unit quaternions in half precision.
#pragma once

#include <array>

#include "core/types.h"

namespace pilesim {

// (w, x, y, z) as numbers of half precision (11 binary digits), each adjacent to that of `q`
// (unit). There are sixteen ways to round them; it takes the one with a length nearest to 1. A
// number below 2^-14 becomes a multiple of 2^-24, as in half precision.
std::array<float, 4> unit_halves(const Quatf& q);

}  // namespace pilesim

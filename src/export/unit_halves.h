// Unit quaternions in half precision.
#pragma once

#include <array>

#include "core/types.h"

namespace pilesim {

// (w, x, y, z) as numbers that half precision has (11 binary digits), each next to that of `q`
// (unit): the one of the sixteen ways to round them whose length is nearest to 1. A number below
// 2^-14 becomes a multiple of 2^-24, as halves have it.
std::array<float, 4> unit_halves(const Quatf& q);

}  // namespace pilesim

// Colours as scenes and pictures have them.
#pragma once

#include <array>
#include <cstdint>

namespace pilesim {

using Colour = std::array<uint8_t, 3>;  // sRGB

}  // namespace pilesim

// Looks of surfaces and lights of pictures that have names.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "json/codec.h"
#include "scene/scene.h"

namespace pilesim {

inline constexpr double kMostEmission = 64;

const std::vector<std::pair<std::string, Look>>& named_looks();
// The first is Light{}.
const std::vector<std::pair<std::string, Light>>& named_lights();

// A name of a look.
Codec<Look> look_codec();

}  // namespace pilesim

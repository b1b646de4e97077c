// The shapes of a scene that move freely.
#pragma once

#include <map>
#include <set>
#include <string>

#include "scene/scene.h"

namespace pilesim {

// Names of the shapes of dynamic bodies, with the names of their materials. A compound is listed,
// its parts are not.
std::map<std::string, std::set<std::string>> moving_shapes(const Scene& scene);

}  // namespace pilesim

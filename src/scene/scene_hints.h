// Parts of a valid scene that do nothing, which its author hardly means.
#pragma once

#include <string>
#include <vector>

#include "scene/scene.h"

namespace pilesim {

// A line each: what does nothing, and how to mend it.
std::vector<std::string> scene_hints(const Scene& scene);

}  // namespace pilesim

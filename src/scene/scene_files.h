// The files that a scene names, and its hash, which is of what they hold and not of where they lie.
#pragma once

#include <string>

#include "scene/scene_loader.h"

namespace pilesim {

// 32 hexadecimal digits of the resolved scene with the content of each file (and of the buffers
// that a .gltf names) in place of its path: the same wherever the scene lies and whatever its files
// are called. A file that is not there counts as missing; what cannot be read throws Error(io).
std::string scene_hash(const LoadedScene& loaded);

}  // namespace pilesim

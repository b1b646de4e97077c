// The files that a scene names, and its hash, which depends on their content and not on their
// places.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "scene/scene_loader.h"

namespace pilesim {

// 32 hexadecimal digits of the resolved scene with the content of each file (and of the files of
// files_named_by_mesh()) in place of its path: the same wherever the scene lies and whatever its
// files are called. A file that is not there counts as missing; a file that cannot be read throws
// Error(io).
std::string scene_hash(const LoadedScene& loaded);

// The other files of a mesh, as it names them, from its directory on: the buffers of a .gltf, the
// materials of an .obj. None where it is not there.
std::vector<std::string> files_named_by_mesh(const std::filesystem::path& mesh);

}  // namespace pilesim

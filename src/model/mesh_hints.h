// Shapes whose size is likely given in another unit than the scene takes it for, mesh files that
// likely have another upward axis, and those whose textures cannot be read.
#pragma once

#include <string>
#include <vector>

#include "model/model.h"
#include "scene/scene.h"

namespace pilesim {

// One line a shape and doubt: the odd value, and the key that corrects it; and one a texture that
// is left out, once a file. No doubts about shapes that say their "size_m" or, of the axis, their
// "up". `model` is that of `scene`.
std::vector<std::string> describe_unlikely_meshes(const Scene& scene, const Model& model);

}  // namespace pilesim

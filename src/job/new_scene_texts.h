// Texts of first scenes, in which a $NAME stands for each value that follows from the mesh.
#pragma once

#include <map>
#include <string>

#include "job/new_scene.h"

namespace pilesim {

using NewSceneValues = std::map<std::string, std::string>;  // by the names in the texts

// `values` has each value of the text of this kind; more do not matter.
std::string new_scene_text(NewSceneKind kind, NewSceneValues values);

}  // namespace pilesim

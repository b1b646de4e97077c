// Conditions between the parts of a scene, beyond each key's own range.
#pragma once

#include "json/json_text.h"
#include "json/problem_log.h"
#include "scene/scene.h"

namespace pilesim {

// `scene` was read from `document`, and `log` has the faults of single keys: values that depend on
// those are not checked.
void check_scene(const Scene& scene, const Json& document, ProblemLog& log);

// That the mesh files of shapes and emitters are there.
void check_mesh_files(const Scene& scene, ProblemLog& log);

}  // namespace pilesim

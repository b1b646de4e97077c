// Conditions on the guide of a scene and on the emitter that fills it, beyond each key's own range.
#pragma once

#include "json/problem_log.h"
#include "scene/scene.h"

namespace pilesim {

void check_guide(const Scene& scene, ProblemLog& log);

}  // namespace pilesim

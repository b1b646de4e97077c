// Conditions on the piles of a scene, beyond each key's own range.
#pragma once

#include "json/problem_log.h"
#include "scene/scene.h"

namespace pilesim {

void check_piles(const Scene& scene, ProblemLog& log);

}  // namespace pilesim

// Conditions of the mixed mode on a scene beyond the ranges of single keys.
#pragma once

#include "json/problem_log.h"
#include "scene/scene.h"

namespace pilesim {

void check_detail(const Scene& scene, ProblemLog& log);

}  // namespace pilesim

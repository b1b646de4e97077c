// What joints and chains of a scene may be.
#pragma once

#include "json/problem_log.h"
#include "scene/scene.h"

namespace pilesim {

void check_joints(const Scene& scene, ProblemLog& log);

}  // namespace pilesim

// Reports settings that Bullet cannot follow in scenes whose contacts Bullet is to solve.
#pragma once

#include "json/problem_log.h"
#include "scene/scene.h"

namespace pilesim {

void check_engine(const Scene& scene, ProblemLog& log);

}  // namespace pilesim

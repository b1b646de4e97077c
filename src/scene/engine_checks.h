// Refuses what Bullet cannot do, where it is to solve the contacts of a scene.
#pragma once

#include "json/problem_log.h"
#include "scene/scene.h"

namespace pilesim {

void check_engine(const Scene& scene, ProblemLog& log);

}  // namespace pilesim

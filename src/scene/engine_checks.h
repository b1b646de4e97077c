// What a scene must do without where Bullet is to solve its contacts.
#pragma once

#include "json/problem_log.h"
#include "scene/scene.h"

namespace pilesim {

void check_engine(const Scene& scene, ProblemLog& log);

}  // namespace pilesim

// Reports joints, and ends of chains, that name no body or that their mode cannot hold.
#pragma once

#include "json/problem_log.h"
#include "scene/scene.h"

namespace pilesim {

void check_joints(const Scene& scene, ProblemLog& log);

}  // namespace pilesim

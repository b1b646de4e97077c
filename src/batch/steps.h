// The commands of a plan: what a batch says to each itself, and where each leaves what it makes.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "batch/plan.h"
#include "json/problem_log.h"

namespace pilesim {

// Reports, below /steps and /scene, commands that a batch does not know or not there, options that
// it sets itself, and names in braces that nothing sets.
void check_steps(const BatchPlan& plan, ProblemLog& log);

// The whole command of a step as the shell would have it, without the program: it works in the
// job's directory. `step` is its index.
std::vector<std::string> step_words(const BatchPlan& plan, const BatchJob& job, size_t step,
                                    uint64_t seed, int threads);

// That what a step writes lies below the job's `directory`, as links lead; `words` are those of
// step_words(), `said` the plan's. Throws Error(input).
void require_inside(const std::vector<std::string>& words, const BatchStep& said,
                    const std::filesystem::path& directory);

// The input of the first step where the plan has no scene: a mesh, or the directory of a run.
std::filesystem::path step_input(const BatchPlan& plan, const BatchJob& job);

// Below a job's directory, in the order of the steps: what holds pictures.
std::vector<std::string> picture_directories(const BatchPlan& plan, const BatchJob& job);

}  // namespace pilesim

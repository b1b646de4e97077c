// The commands of a plan: the arguments that the batch adds, and their output paths.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "batch/plan.h"
#include "json/problem_log.h"

namespace pilesim {

// Reports, below /steps and /scene, commands that are unknown or misplaced, options that the batch
// sets itself, and names in braces without a value.
void check_steps(const BatchPlan& plan, ProblemLog& log);

// All words of a step's command without the program; it runs in the job's directory. `step` is its
// index.
std::vector<std::string> step_words(const BatchPlan& plan, const BatchJob& job, size_t step,
                                    uint64_t seed, int threads);

// Requires that a step writes only inside the job's `directory`, with links resolved. `words` come
// from step_words(), `said` from the plan. Throws Error(input).
void require_inside(const std::vector<std::string>& words, const BatchStep& said,
                    const std::filesystem::path& directory);

// The input of the first step if the plan has no scene: a mesh, or the directory of a run.
std::filesystem::path step_input(const BatchPlan& plan, const BatchJob& job);

// Directories with pictures, relative to a job's directory, in the order of the steps.
std::vector<std::string> picture_directories(const BatchPlan& plan, const BatchJob& job);

}  // namespace pilesim

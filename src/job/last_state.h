// Starts a scene from the current or last state of another run.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "model/model.h"

namespace pilesim {

struct LastState {
  size_t matched = 0;  // bodies that start in the state of the run's body of the same name
  size_t taken = 0;    // bodies removed before the start
  std::string hash;    // hash of the state used
};

// Movable bodies of `model` start in the last state of the run in `directory` if a body of the same
// name is present there. They appear at once, with its pose and velocities, and asleep if it sleeps
// and `scene` allows sleep; in the impulse mode, bodies wake if they overlap others by more than
// its engine lets sleep. Fills model.start_overlaps. Other bodies start as in the scene. `take`
// models a pile that is emptied: it removes that many of these bodies, the highest against gravity,
// and all movable bodies that are absent in the run. Throws Error(io), or Error(input) if no name
// matches, a body has another shape there, or no body would remain.
LastState begin_from(const std::filesystem::path& directory, const Scene& scene, Model& model,
                     std::optional<uint64_t> take);

// Checks that all frames of a complete run can be read. Throws Error(input) naming the damaged
// file, or Error(io).
void require_whole_run(const std::filesystem::path& output);

}  // namespace pilesim

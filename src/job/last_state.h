// A scene that begins where another run stands or has ended.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "model/model.h"

namespace pilesim {

struct LastState {
  size_t matched = 0;  // bodies that begin where the other run has those of their names
  size_t taken = 0;    // bodies that are taken away before
  std::string hash;    // of what was taken
};

// Bodies of `model` that can move, and have the name of one that is present in the last state of
// the run in `directory`, begin there: at once, at its pose and with its velocities, asleep where
// it sleeps and `scene` lets bodies sleep; in the impulse mode those wake that overlap others by
// more than its engine lets sleep. Fills model.start_overlaps. Others are as the scene has them.
// With `take` what is left of a pile that is emptied: of those bodies the so many that lie highest
// against gravity are taken out of the model, with all that could move and is not there. Throws
// Error(io), or Error(input) where no body has such a name, one has another shape there, or none
// would be left.
LastState begin_from(const std::filesystem::path& directory, const Scene& scene, Model& model,
                     std::optional<uint64_t> take);

// That all frames of a run that is said to be complete can be read. Throws Error(input) naming the
// file that is damaged, or Error(io).
void require_whole_run(const std::filesystem::path& output);

}  // namespace pilesim

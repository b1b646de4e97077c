// A scene that begins where another run stands or has ended.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

#include "model/model.h"

namespace pilesim {

struct LastState {
  size_t matched = 0;  // bodies that begin where the other run has those of their names
  std::string hash;    // of what was taken
};

// Bodies of `model` that can move, and have the name of one that is present in the last state of
// the run in `directory`, begin there: at once, at its pose and with its velocities, asleep where
// it sleeps. Others are as the scene has them. Throws Error(io), or Error(input) where no body has
// such a name, or one has another shape there.
LastState begin_from(const std::filesystem::path& directory, Model& model);

}  // namespace pilesim

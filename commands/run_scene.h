// The options and the work that commands have in common which run a scene: simulate, direct-pile.
#pragma once

#include <string>

#include "options.h"

namespace pilesim {

// `text` has the name, the description and the footer; `direct_piles` is of SimulationJob.
struct RunSceneText {
  std::string name, description, footer;
  bool direct_piles = false;
};
void add_run_scene_command(CLI::App& app, const RunSceneText& text);

}  // namespace pilesim

#include "run_scene.h"

namespace pilesim {

void add_simulate_command(CLI::App& app) {
  add_run_scene_command(
      app, {.name = "simulate", .description = "Simulate a scene into a trajectory", .footer = R"(
Examples:
  pilesim simulate presets/impulse/rabbits_in_a_crate.json -o out/crate
  pilesim simulate scene.json -o out/a --seed 7 --set /simulator/sleeping=false --force
  pilesim simulate scene.json -o out/a --fail-on "penetration>0.02D,unsettled>0,floating>0"

Ctrl-C stops between two frames; what was simulated until then is complete and can be rendered.)"});
}

}  // namespace pilesim

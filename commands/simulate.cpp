#include "run_scene.h"

namespace pilesim {

void add_simulate_command(CLI::App& app) {
  add_run_scene_command(
      app, {.name = "simulate", .description = "Simulate a scene into a trajectory", .footer = R"(
Examples:
  pilesim simulate presets/impulse/rabbits_in_a_crate.json -o out/crate
  pilesim simulate scene.json -o out/a --seed 7 --set /simulator/sleeping=false --force
  pilesim simulate scene.json -o out/a --fail-on "penetration>0.02D,unsettled>0,floating>0"
  pilesim simulate scene.json -o out/a --resume
  pilesim simulate hit.json -o out/hit --from out/a

Ctrl-C stops between two frames; the simulated frames are complete and can be rendered, and
--resume goes on from there.)"});
}

}  // namespace pilesim

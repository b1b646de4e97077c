#include "run_scene.h"

namespace pilesim {

void add_direct_pile_command(CLI::App& app) {
  add_run_scene_command(
      app,
      {.name = "direct-pile",
       .description = "Simulate a scene whose piles take the angles of repose or the shape it asks "
                      "for",
       .footer = R"(
Examples:
  pilesim direct-pile presets/repose/rabbit_matrix_35.json -o out/pile
  pilesim direct-pile presets/repose/rabbit_matrix_35.json -o out/steep --set /piles/0/angle_deg=45
  pilesim direct-pile presets/equilibrium/card_tower.json -o out/cards
  pilesim direct-pile presets/equilibrium/card_tower.json -o out/cards --resume

The scene has "piles", each with an "angle_deg" (docs/direct_pile.md), or a "guide", in whose shape
glue, freezing or nails hold the bodies (docs/guides.md, docs/equilibrium.md). pilesim simulate runs
the same scene undirected, for comparison.
Ctrl-C stops between two frames; the simulated frames are complete and can be rendered, and
--resume goes on from there.)",
       .direct_piles = true});
}

}  // namespace pilesim

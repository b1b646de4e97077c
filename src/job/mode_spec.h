// Modes of simulation as the user names them: "statistical", "impulse:spheres7",
// "impulse:decomposition@1/480", "statistical@1/60+/simulator/solver_iterations=8". A name only
// stands for overrides of the scene, as with --set, so new modes need no change here.
#pragma once

#include <set>
#include <string>
#include <vector>

#include "scene/scene.h"

namespace pilesim {

struct ModeSpec {
  std::string name;                    // as written
  std::string directory;               // derived file name
  std::vector<std::string> overrides;  // "/json/pointer=value"
};

// Names of the meshes of dynamic bodies, including parts of compounds: a mode may choose their
// collision shape.
std::set<std::string> dynamic_meshes(const Scene& scene);

// Splits "a,b,c" at commas outside brackets. Throws Error(usage) for an empty name.
std::vector<std::string> split_modes(const std::string& text);

// MODE[:COLLISION[COUNT]][@STEP][+finish][+/POINTER=VALUE]... for `scene`:
//   MODE       /simulator/mode. Another mode than the scene's gets its own defaults of step and
//   sweeps,
//              since the scene's values suit the scene's mode
//   COLLISION  for every mesh of dynamic bodies: hull, decomposition, spheres or sphere.
//              COUNT: vertices of the hull, most pieces, spheres. Not allowed without such
//              meshes
//   finish     /finish={}: the pile is made sound at the end
//   STEP       /step_s, in seconds, as a number or a fraction
// Throws Error(usage) naming the part that is wrong.
ModeSpec resolve_mode(const std::string& text, const Scene& scene);

}  // namespace pilesim

// Ways to simulate a scene, as the user names them: "statistical", "impulse:spheres7",
// "impulse:decomposition@1/480", "statistical@1/60+/simulator/solver_iterations=8". A name is
// nothing but overrides of the scene, as --set gives them, so a mode that comes later needs
// nothing here.
#pragma once

#include <set>
#include <string>
#include <vector>

#include "scene/scene.h"

namespace pilesim {

struct ModeSpec {
  std::string name;                    // as written
  std::string directory;               // a file name made of it
  std::vector<std::string> overrides;  // "/json/pointer=value"
};

// Names of the meshes that dynamic bodies have, also as parts of compounds: those whose collision a
// mode may choose.
std::set<std::string> dynamic_meshes(const Scene& scene);

// "a,b,c" apart, at the commas that are not inside brackets. Throws Error(usage) for an empty name.
std::vector<std::string> split_modes(const std::string& text);

// MODE[:COLLISION[COUNT]][@STEP][+finish][+/POINTER=VALUE]... for `scene`:
//   MODE       /simulator/mode. Another than the scene's own gets the defaults of step and sweeps,
//              as the scene's are chosen for its own mode
//   COLLISION  of every mesh that dynamic bodies have: hull, decomposition, spheres or sphere.
//              COUNT: vertices of the hull, most pieces, spheres. Not in a scene without such
//              meshes
//   finish     /finish={}: the pile is made sound at the end
//   STEP       /step_s, in seconds, as a number or a fraction
// Throws Error(usage) naming the part that is wrong.
ModeSpec resolve_mode(const std::string& text, const Scene& scene);

}  // namespace pilesim

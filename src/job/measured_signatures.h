// Signatures of the objects whose shapes name none, measured where a scene needs them and kept in
// the user's cache directory.
#pragma once

#include <cstdint>

#include "core/progress.h"
#include "model/model.h"
#include "scene/scene.h"

namespace pilesim {

// How much is measured of an object.
struct MeasuringEffort {
  uint32_t trials_per_cell = 20;
  uint32_t rest_drops = 100;
  uint32_t pours = 1;  // as in PackingSettings
  uint32_t rounds = 16, pours_a_round = 1, pours_of_result = 1;
};

// Puts the signatures into `model` that its bodies collide by in the scene's mode and that no shape
// names: from the cache, else measured, with the object's own geometry and material. A cached one
// is that of this very program, so the result does not depend on the cache; a damaged file is
// replaced. `model` is ready to be simulated, its guide filled. The same for any number of threads.
// Returns the wall time that was spent on measuring, s; 0: there was nothing to measure.
// Throws Error(input) naming the shape's JSON pointer where an object cannot be measured, and for
// what the mode refuses; Error(io) if the cache cannot be written; Error(interrupted) after Ctrl-C.
double measure_signatures(const Scene& scene, Model& model, ProgressMode progress,
                          const MeasuringEffort& effort = {});

// The same without measuring: what is not in the cache is null in `model`, with which a simulator
// can be made but not stepped.
void find_signatures(const Scene& scene, Model& model);

}  // namespace pilesim

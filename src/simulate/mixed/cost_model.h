// The cost of a step of the mixed mode, by the bodies that are awake and their contacts: measured
// beforehand (tests/benchmark/budget_benchmark.cpp), never by the clock, so that what follows from
// it is the same on any machine.
#pragma once

#include "model/model.h"
#include "scene/scene.h"

namespace pilesim {

// The work of a step, or the sum over several.
struct StepWork {
  double spheres = 0;          // bodies that are spheres to others, I' bodies too
  double sphere_contacts = 0;  // that carry something
  double blocks = 0;           // spheres that lie by faces, see face_patch.h; they count as both
  double pieces = 0;           // convex pieces of bodies that the exact engine moves
  double solved = 0;           // bodies whose pairs with their like are solved, too ...
  double solved_pieces = 0;    // ... and their pieces; they count as both

  static void fields(auto& self, auto& stream) {
    stream(self.spheres, self.sphere_contacts, self.blocks, self.pieces, self.solved,
           self.solved_pieces);
  }
  StepWork& operator+=(const StepWork& more);
};
StepWork operator*(double times, const StepWork& work);

// The work of an awake body that prefers to be a sphere. `near`: it is I'. `method`: for its pairs
// with its like. `sphere_contacts`: the mean number of such a body.
StepWork usual_work(const ModelShape& shape, bool near, PairMethod method, double sphere_contacts);

// us of one core.
double cost_us(const StepWork& work);

}  // namespace pilesim

#include "simulate/dissertation/dissertation_simulator.h"

#include "simulate/dissertation/drawn_world.h"
#include "simulate/sphere/sphere_simulator.h"

namespace pilesim {

std::unique_ptr<Simulator> make_dissertation_simulator(const Scene& scene, const Model& model) {
  return std::make_unique<SphereSimulator<DrawnWorld>>(scene, model, load_signatures(model));
}

}  // namespace pilesim

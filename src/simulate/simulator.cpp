#include "simulate/simulator.h"

#include "simulate/impulse_simulator.h"
#include "simulate/mixed_simulator.h"
#include "simulate/statistical_simulator.h"

namespace pilesim {

std::unique_ptr<Simulator> make_simulator(const Scene& scene, const Model& model) {
  switch (scene.simulator.mode) {
    case SimulatorMode::impulse:
      return make_impulse_simulator(scene, model);
    case SimulatorMode::statistical:
    case SimulatorMode::particle:
      return make_statistical_simulator(scene, model);
    case SimulatorMode::mixed:
      return make_mixed_simulator(scene, model);
  }
  return nullptr;
}

std::unique_ptr<Simulator> make_directed_simulator(const Scene& scene, const Model& model,
                                                   StepDirector& director) {
  if (scene.simulator.mode == SimulatorMode::mixed) {
    return make_mixed_simulator(scene, model, &director);
  }
  return make_impulse_simulator(scene, model, director);
}

}  // namespace pilesim

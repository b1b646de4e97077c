#include "simulate/modes/make_simulator.h"

#include "simulate/bullet/bullet.h"
#include "simulate/dissertation/dissertation_simulator.h"
#include "simulate/exact/engine.h"
#include "simulate/impulse_simulator.h"
#include "simulate/mixed/mixed_simulator.h"
#include "simulate/sphere/statistical_simulator.h"

namespace pilesim {
namespace {

std::unique_ptr<ExactEngine> make_engine(const Scene& scene, const Model& model) {
  switch (scene.simulator.engine) {
    case EngineKind::bullet:
      return make_bullet_engine(scene, model);
    case EngineKind::exact:
      return make_exact_engine(scene, model);
  }
  return nullptr;
}

}  // namespace

std::unique_ptr<Simulator> make_simulator(const Scene& scene, const Model& model) {
  switch (scene.simulator.mode) {
    case SimulatorMode::impulse:
      return make_impulse_simulator(scene, model, make_engine(scene, model));
    case SimulatorMode::statistical:
      if (scene.simulator.method == Method::dissertation) {
        return make_dissertation_simulator(scene, model);
      }
      return make_statistical_simulator(scene, model);
    case SimulatorMode::particle:
      return make_statistical_simulator(scene, model);
    case SimulatorMode::mixed:
      return make_mixed_simulator(scene, model, make_engine(scene, model));
  }
  return nullptr;
}

std::unique_ptr<Simulator> make_directed_simulator(const Scene& scene, const Model& model,
                                                   StepDirector& director) {
  auto engine = make_engine(scene, model);
  if (scene.simulator.mode == SimulatorMode::mixed) {
    return make_mixed_simulator(scene, model, std::move(engine), &director);
  }
  return make_impulse_simulator(scene, model, std::move(engine), director);
}

std::unique_ptr<Simulator> make_directed_simulator(const Scene& scene, const Model& model,
                                                   ImpulseDirector& director) {
  return make_impulse_simulator(scene, model, make_engine(scene, model), director);
}

}  // namespace pilesim

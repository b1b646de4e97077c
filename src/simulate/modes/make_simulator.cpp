#include "simulate/modes/make_simulator.h"

#include <cassert>

#include "simulate/bullet/bullet_simulator.h"
#include "simulate/dissertation/dissertation_simulator.h"
#include "simulate/exact/engine.h"
#include "simulate/impulse_simulator.h"
#include "simulate/mixed/mixed_simulator.h"
#include "simulate/sphere/body_signature.h"
#include "simulate/sphere/statistical_simulator.h"

namespace pilesim {
namespace {

// For all that Bullet cannot do: scenes that ask Bullet for it were refused
// (scene/engine_checks.h).
std::unique_ptr<ExactEngine> own_engine(const Scene& scene, const Model& model) {
  assert(scene.simulator.engine == EngineKind::exact);
  return make_exact_engine(scene, model);
}

}  // namespace

std::vector<ObjectKey> objects_to_measure(const Scene& scene, const Model& model) {
  switch (scene.simulator.mode) {
    case SimulatorMode::statistical:
      return objects_to_measure(model, [](const ModelBody&) { return true; });
    case SimulatorMode::mixed:
      return mixed_objects_to_measure(scene, model);
    case SimulatorMode::impulse:
    case SimulatorMode::particle:
      return {};
  }
  return {};
}

std::unique_ptr<Simulator> make_simulator(const Scene& scene, const Model& model) {
  switch (scene.simulator.mode) {
    case SimulatorMode::impulse:
      if (scene.simulator.engine == EngineKind::bullet) return make_bullet_simulator(scene, model);
      return make_impulse_simulator(scene, model, own_engine(scene, model));
    case SimulatorMode::statistical:
      if (scene.simulator.method == Method::dissertation) {
        return make_dissertation_simulator(scene, model);
      }
      return make_statistical_simulator(scene, model);
    case SimulatorMode::particle:
      return make_statistical_simulator(scene, model);
    case SimulatorMode::mixed:
      return make_mixed_simulator(scene, model, own_engine(scene, model));
  }
  return nullptr;
}

std::unique_ptr<Simulator> make_directed_simulator(const Scene& scene, const Model& model,
                                                   StepDirector& director) {
  auto engine = own_engine(scene, model);
  if (scene.simulator.mode == SimulatorMode::mixed) {
    return make_mixed_simulator(scene, model, std::move(engine), &director);
  }
  return make_impulse_simulator(scene, model, std::move(engine), director);
}

std::unique_ptr<Simulator> make_directed_simulator(const Scene& scene, const Model& model,
                                                   ImpulseDirector& director) {
  return make_impulse_simulator(scene, model, own_engine(scene, model), director);
}

}  // namespace pilesim

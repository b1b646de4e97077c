#include "simulate/sphere/statistical_simulator.h"

#include "core/error.h"
#include "simulate/rolling_resistance.h"
#include "simulate/sphere/sphere_simulator.h"
#include "simulate/sphere/sphere_world.h"

namespace pilesim {
namespace {

bool is_particle_mode(const Scene& scene) {
  return scene.simulator.mode == SimulatorMode::particle;
}

void refuse_joints(const Model& model) {
  if (!model.joints.empty()) {
    throw Error(ErrorKind::input,
                {.found = "'" + model.bodies[model.joints.front().a].name + "' has a joint",
                 .expected = "free bodies in the modes statistical and particle",
                 .remedy = "Take the joints away, or set /simulator/mode to impulse or mixed"});
  }
  for (const ModelBody& body : model.bodies) {
    if (!body.hinge) continue;
    throw Error(ErrorKind::input,
                {.found = "'" + body.name + "' has a hinge",
                 .expected = "free bodies in the modes statistical and particle",
                 .remedy = "Take the hinge away, or set /simulator/mode to impulse or mixed"});
  }
}

}  // namespace

SphereWorldSettings sphere_world_settings(const Scene& scene) {
  return {.gravity = scene.gravity.cast<float>(),
          .step_s = static_cast<float>(scene.actual_step_s()),
          .seed = scene.seed,
          .sleeping = scene.simulator.sleeping,
          .rest_control = !is_particle_mode(scene) && scene.simulator.rest_control,
          .sweeps = scene.simulator.solver_iterations,
          .method = is_particle_mode(scene) ? PairMethod::particle : PairMethod::statistical};
}

void refuse_what_spheres_lack(const Model& model) {
  refuse_joints(model);
  refuse_rolling_friction(model, [](const ModelBody&) { return true; });
}

std::unique_ptr<Simulator> make_statistical_simulator(const Scene& scene, const Model& model) {
  return std::make_unique<SphereSimulator<SphereWorld>>(
      scene, model, is_particle_mode(scene) ? particle_spheres(model) : load_signatures(model));
}

}  // namespace pilesim

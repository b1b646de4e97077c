// The impulse mode: all bodies solved exactly, by one engine; the reference of all other modes.
#pragma once

#include <memory>

#include "simulate/exact_engine.h"

namespace pilesim {

// Scene, model and director must outlive it. `engine`: of the same scene and model, without bodies.
std::unique_ptr<Simulator> make_impulse_simulator(const Scene& scene, const Model& model,
                                                  std::unique_ptr<ExactEngine> engine);
std::unique_ptr<Simulator> make_impulse_simulator(const Scene& scene, const Model& model,
                                                  std::unique_ptr<ExactEngine> engine,
                                                  StepDirector& director);
std::unique_ptr<Simulator> make_impulse_simulator(const Scene& scene, const Model& model,
                                                  std::unique_ptr<ExactEngine> engine,
                                                  ImpulseDirector& director);

}  // namespace pilesim

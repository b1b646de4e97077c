// The exact engine of this project.
#pragma once

#include <memory>

#include "simulate/exact_engine.h"

namespace pilesim {

// `scene` and `model` must outlive it.
std::unique_ptr<ExactEngine> make_exact_engine(const Scene& scene, const Model& model);

}  // namespace pilesim

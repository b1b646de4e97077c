// Bullet in double precision behind the interface of exact engines. Nothing outside of this folder
// knows Bullet.
#pragma once

#include <memory>

#include "simulate/exact_engine.h"

namespace pilesim {

// Both arguments must outlive it.
std::unique_ptr<ExactEngine> make_bullet_engine(const Scene& scene, const Model& model);

}  // namespace pilesim

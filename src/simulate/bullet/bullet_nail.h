// A slider whose way is nought: two bodies that may only turn about an axis (dissertation 6.2.2).
#pragma once

#include <memory>

#include "simulate/bullet/bullet_types.h"
#include "simulate/impulse_control.h"

namespace pilesim {

std::unique_ptr<btTypedConstraint> make_nail(const Nail& nail, btRigidBody& a, btRigidBody& b);

}  // namespace pilesim

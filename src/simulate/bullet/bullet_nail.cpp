#include "simulate/bullet/bullet_nail.h"

#include "core/rotation.h"
#include "simulate/bullet/bullet_constants.h"

namespace pilesim {
namespace {

using namespace bullet_constants;

// Bullet's indices of the rows of a slider: along it, across it, turns across it.
constexpr int kRows[] = {0, 1, 4};

// In the body, with the x axis, along which sliders slide, on the nail.
btTransform frame_in(const btRigidBody& body, const Nail& nail) {
  const Quat turn = rotation_between(Vec3::UnitX(), nail.axis);
  return body.getWorldTransform().inverse() * to_bullet(Pose{nail.point, turn});
}

}  // namespace

std::unique_ptr<btTypedConstraint> make_nail(const Nail& nail, btRigidBody& a, btRigidBody& b) {
  auto slider =
      std::make_unique<btSliderConstraint>(a, b, frame_in(a, nail), frame_in(b, nail), true);
  slider->setLowerLinLimit(0);
  slider->setUpperLinLimit(0);
  slider->setLowerAngLimit(1);  // above the upper one: free
  slider->setUpperAngLimit(-1);
  for (const int row : kRows) slider->setParam(BT_CONSTRAINT_STOP_ERP, kCorrection, row);
  slider->setBreakingImpulseThreshold(nail.breaking_impulse_ns);
  return slider;
}

}  // namespace pilesim

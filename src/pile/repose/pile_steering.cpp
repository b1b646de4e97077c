#include "pile/repose/pile_steering.h"

#include <algorithm>
#include <cmath>

#include "pile/repose/repose_constants.h"

namespace pilesim {
namespace {

using namespace repose_constants;

}  // namespace

PileSteering::PileSteering(double size_m, double gravity)
    : gravity_(gravity),
      speed_unit_(std::sqrt(gravity * size_m)),
      time_unit_s_(std::sqrt(size_m / gravity)) {}

void PileSteering::set_friction(BodyControl& control, const std::vector<SteeredBody>& steered) {
  for (const SteeredBody& body : steered) {
    control.set_friction(body.body, body.drive == Drive::spill
                                        ? kSpillFriction * body.grip * body.material_friction
                                        : std::max(body.material_friction, kHoldFriction));
  }
}

void PileSteering::steer(BodyControl& control, const std::vector<SteeredBody>& steered) const {
  const double step_s = control.step_s();
  const auto keep = [&](double rate) { return std::exp(-rate / time_unit_s_ * step_s); };
  for (const SteeredBody& body : steered) {
    if (!control.is_in_world(body.body) || control.is_asleep(body.body)) continue;
    const BodyMotion motion = control.motion(body.body);
    Vec3 velocity = motion.linear_velocity;
    Vec3 turn_rate = motion.angular_velocity;
    switch (body.drive) {
      case Drive::spill: {
        const Vec3 down = Vec3(body.outward.x(), -body.slope, body.outward.y()).normalized();
        // Drag that balances the driving force and the slope at the target speed.
        const double push = kSpillPush * (1 - body.grip);
        const double kept = keep((push - down.y()) / (kSpillSpeed * (1 + body.extra_speed)));
        velocity = kept * (velocity + down * (push * gravity_ * step_s));
        turn_rate *= kept;
        break;
      }
      case Drive::hold:
        velocity *= keep(kHoldRate * (0.5 + body.grip));
        turn_rate *= keep(kHoldTurnRate);  // tipping bodies must fall
        break;
      case Drive::settle: {
        const double kept = keep(kSettleRate * body.grip);
        velocity.x() *= kept;
        velocity.z() *= kept;
        break;
      }
    }
    control.set_velocity(body.body, velocity, turn_rate);
  }
}

}  // namespace pilesim

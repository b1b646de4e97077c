// Boxes that fall onto one spot, and a director that measures their pile.
#pragma once

#include <cmath>

#include "pile/repose/repose_director.h"
#include "support/small_model.h"

namespace pilesim {

// Ground 0 and boxes of 0.2 m, one after the other onto one spot.
struct BoxesOntoAPile : SmallModel {
  explicit BoxesOntoAPile(int boxes, double angle_deg = 35) {
    scene.frame_rate = 60;
    scene.step_s = 1.0 / 120;
    scene.piles = {{.angle = radians(angle_deg), .centre = GroundPoint(0, 0)}};
    const uint32_t wood = material(0.1, 0.5);
    body(plane(), wood, Vec3::Zero(), Role::fixed);
    const uint32_t shape = box(Vec3::Constant(0.2));
    for (int i = 0; i < boxes; ++i) {
      ModelBody& fallen = body(shape, wood, {0.15 * std::sin(i), 1.6, 0.15 * std::cos(2.0 * i)});
      fallen.pose.orientation = Quat(Eigen::AngleAxisd(0.7 * i, Vec3(1, i % 3, 1).normalized()));
      fallen.linear_velocity = {0, -3, 0};
      fallen.start_s = 0.1 * i;
    }
  }
};

class MeasuringDirector final : public StepDirector {
 public:
  explicit MeasuringDirector(const SmallModel& small) : director(small.scene, small.model) {}
  void direct(BodyControl& control) override { director.direct(control); }
  void end_frame(BodyControl& control) override { director.measure(control); }
  ReposeDirector director;
};

}  // namespace pilesim

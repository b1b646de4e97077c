// What only the engine that has Bullet behind it promises.

#include <gtest/gtest.h>

#include <vector>

#include "simulate/bullet/bullet.h"
#include "support/small_model.h"

namespace pilesim {
namespace {

// Else the far side of a thin body would be a contact too.
TEST(Bullet, ContactsWithAPlaneReachATenthOfAThinBody) {
  const auto contacts_at = [](double share) {
    SmallModel small;
    small.scene.gravity.setZero();
    const double thickness_m = 0.004;
    const uint32_t wood = small.material(0.3, 0.5);
    small.body(small.plane(), wood, Vec3::Zero(), Role::fixed);
    small.body(small.box({1, thickness_m, 1}), wood, {0, (0.5 + share) * thickness_m, 0});
    const std::unique_ptr<ExactEngine> engine = make_bullet_engine(small.scene, small.model);
    for (uint32_t body = 0; body < 2; ++body) {
      engine->add(body, {.position = small.model.bodies[body].pose.position}, false, false);
    }
    StageTimer timer;
    engine->step(timer, [] {});
    std::vector<BodyContact> contacts;
    engine->read_contacts(contacts);
    return contacts.size();
  };
  EXPECT_EQ(contacts_at(0.07), 4);
  EXPECT_EQ(contacts_at(0.14), 0);
}

}  // namespace
}  // namespace pilesim

// The control of a director over a Bullet world, and the bodies that both know.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <vector>

#include "scene/model.h"
#include "simulate/body_state.h"
#include "simulate/bullet_shapes.h"
#include "simulate/bullet_world.h"
#include "simulate/impulse_control.h"

namespace pilesim {

// What Bullet has of a body of the model.
struct BulletRecord {
  std::unique_ptr<btRigidBody> body;  // null: not in the world
  std::unique_ptr<btTypedConstraint> hinge;
  bool moved = false;         // kinematic: in the step before
  bool put_to_sleep = false;  // by the director
};

// The bodies of a model in a Bullet world.
struct BulletBodies {
  const Model& model;
  std::vector<BulletShape> shapes;    // as Model::shapes
  std::vector<BulletRecord> records;  // (B)
  BodyStates states;                  // of the last frame; flags as of now

  // Dynamic and not held.
  bool is_in_world(uint32_t body) const;
  // Of one that Bullet has.
  Pose pose_of(uint32_t body) const;
};

class BulletControl final : public ImpulseControl {
 public:
  // All must outlive it; gravity in m/s^2.
  BulletControl(BulletBodies& bodies, BulletWorld& world, btCollisionDispatcher& dispatcher,
                const Vec3& gravity, double step_s);
  ~BulletControl() override;

  void set_time(double time_s) { time_s_ = time_s; }  // of the state
  // Brings what set_friction() asked for to the contacts that are there.
  void refresh_friction();
  void remove_constraints_of(uint32_t body);

  double time_s() const override { return time_s_; }
  double step_s() const override { return step_s_; }
  bool is_in_world(uint32_t body) const override;
  BodyMotion motion(uint32_t body) const override;
  void put_to_sleep(uint32_t body) override;
  void wake(uint32_t body) override;
  bool is_asleep(uint32_t body) const override;
  void set_velocity(uint32_t body, const Vec3& linear, const Vec3& angular) override;
  void set_friction(uint32_t body, double friction) override;
  void read_contacts(std::vector<BodyContact>& contacts) const override;
  ConstraintId add_point_constraint(uint32_t a, uint32_t b, const Vec3& point) override;
  ConstraintId add_nail(const Nail& nail) override;
  void remove_constraint(ConstraintId constraint) override;
  bool holds(ConstraintId constraint) const override;
  void mark(uint32_t body, uint8_t mask, uint8_t flags) override;

 private:
  struct PointConstraint {
    std::unique_ptr<btTypedConstraint> constraint;
    uint32_t a, b;
  };

  ConstraintId add_constraint(std::unique_ptr<btTypedConstraint> constraint, uint32_t a,
                              uint32_t b);

  BulletBodies& bodies_;
  BulletWorld& world_;
  btCollisionDispatcher& dispatcher_;
  Vec3 gravity_;
  double step_s_;
  double time_s_ = 0;
  bool friction_changed_ = false;  // since the last step
  std::map<ConstraintId, PointConstraint> constraints_;
  ConstraintId next_constraint_ = 0;
};

}  // namespace pilesim

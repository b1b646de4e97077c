// Bodies of a model in a Bullet world: the exact engine in double precision.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <span>
#include <vector>

#include "model/model.h"
#include "scene/scene.h"
#include "simulate/bullet/bullet_broad_phase.h"
#include "simulate/bullet/bullet_collision_configuration.h"
#include "simulate/bullet/bullet_contact_solver.h"
#include "simulate/bullet/bullet_shapes.h"
#include "simulate/bullet/bullet_state.h"
#include "simulate/bullet/bullet_world.h"
#include "simulate/exact_engine.h"

namespace pilesim {

class BulletEngine final : public ExactEngine {
 public:
  BulletEngine(const Scene& scene, const Model& model);
  ~BulletEngine() override;
  BulletEngine(const BulletEngine&) = delete;
  BulletEngine& operator=(const BulletEngine&) = delete;

  void add(uint32_t body, const BodyMotion& start, bool held, bool asleep) override;
  void remove(uint32_t body) override;
  bool contains(uint32_t body) const override { return records_[body].body != nullptr; }
  void apply_impulse(uint32_t body, const ModelEvent& event) override;
  void move_by_keys(uint32_t body, double time_s) override;
  void set_partner(std::function<void(int iteration)> partner) override;
  bool is_solving(uint32_t body) const override { return solver_.is_solving(*records_[body].body); }
  Vec3 solver_velocity(uint32_t body) const override;
  Vec3 solver_spin(uint32_t body) const override;
  void change_solver_velocity(uint32_t body, const Vec3& linear, const Vec3& angular) override;
  void carry(uint32_t body) override;
  void step(StageTimer& timer, const std::function<void()>& before_solver) override;
  BodyMotion motion(uint32_t body) const override;
  void boxes(uint32_t body, std::vector<Bounds>& boxes) const override;
  Bounds box_at(uint32_t body, const Pose& pose) const override;
  double reach_below_m(uint32_t body, const Quat& orientation) const override;
  bool is_active(uint32_t body) const override { return records_[body].body->isActive(); }
  void set_velocity(uint32_t body, const Vec3& linear, const Vec3& angular) override;
  void nudge(uint32_t body, const Vec3& way, const Quat& turn) override;
  void put_to_sleep(uint32_t body) override;
  void wake(uint32_t body) override;
  void set_friction(uint32_t body, double friction) override;
  void refresh_friction() override;
  void read_contacts(std::vector<BodyContact>& contacts) const override;
  void find_hits(std::vector<Hit>& hits) override;
  ConstraintId add_nail(const Nail& nail) override;
  ConstraintId add_glue(const GlueSpot& spot) override;
  void remove_constraint(ConstraintId constraint) override;
  bool holds(ConstraintId constraint) const override;
  double longest_step_s(double) override { return step_s_; }
  void set_step(double step_s) override { step_s_ = step_s; }
  void set_pair_filter(PairFilter filter) override { dispatcher_.filter = std::move(filter); }
  void keep_apart(const std::vector<uint32_t>& bodies) override;
  double kinetic_energy_j(uint32_t body) const override;
  void add_contacts_to(FrameStatistics& statistics) const override;
  void save(StateWriter& writer) const override { writer(state()); }
  void load(StateReader& reader) override;

  // What its world is between two steps.
  BulletState state() const;
  // Makes its world that one. Throws Error(input) where there is no such world of this model.
  void set_state(const BulletState& state);

 private:
  // What Bullet has of a body of the model.
  struct Record {
    std::unique_ptr<btRigidBody> body;  // null: not in the world
    std::unique_ptr<btTypedConstraint> hinge;
    bool moved = false;         // kinematic: in the step before
    bool put_to_sleep = false;  // by put_to_sleep()
    bool kept_apart = false;    // from its like
  };
  struct TiedPair {
    std::unique_ptr<btTypedConstraint> constraint;
    uint32_t a, b;
  };

  void fall_asleep(uint32_t body);  // by the world's own rule, at once
  void set_up_dynamic(uint32_t index, const BodyMotion& start, btRigidBody& body);
  void remove_constraints_of(uint32_t index);
  void clear();  // takes all out of the world
  // In bullet_save.cpp:
  BulletBody body_state(const btRigidBody& body) const;
  std::vector<uint64_t> constraint_order() const;
  // In bullet_load.cpp:
  void add_bodies(const std::vector<BulletBody>& bodies);
  void set_broad_phase(const BulletState& state);
  void set_constraints(const BulletState& state);
  void set_pairs(const BulletState& state);

  const Scene& scene_;
  const Model& model_;
  double step_s_;
  std::vector<BulletShape> shapes_;
  BulletCollisionConfiguration configuration_;
  FilteringDispatcher dispatcher_{&configuration_};
  BulletBroadPhase broad_phase_;
  BulletContactSolver solver_;
  BulletWorld world_;
  std::vector<DynamicBody> dynamic_;
  std::vector<Record> records_;
  bool friction_changed_ = false;  // since the last step
  std::map<ConstraintId, TiedPair> constraints_;
  ConstraintId next_constraint_ = 0;
};

}  // namespace pilesim

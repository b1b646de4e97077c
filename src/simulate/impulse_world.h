// Bodies of a model in a Bullet world: the engine of the impulse mode.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <vector>

#include "scene/model.h"
#include "scene/scene.h"
#include "simulate/bullet_broad_phase.h"
#include "simulate/bullet_collision_configuration.h"
#include "simulate/bullet_contact_solver.h"
#include "simulate/bullet_shapes.h"
#include "simulate/bullet_world.h"
#include "simulate/impulse_control.h"
#include "simulate/simulator.h"

namespace pilesim {

// Bodies are indices into Model::bodies. Unless it says otherwise, a function asks for one that is
// in the world; of contacts and sleep, for a dynamic one that is not held.
class ImpulseWorld {
 public:
  // Both arguments must outlive it.
  ImpulseWorld(const Scene& scene, const Model& model);
  ~ImpulseWorld();
  ImpulseWorld(const ImpulseWorld&) = delete;
  ImpulseWorld& operator=(const ImpulseWorld&) = delete;

  // A dynamic body starts at `start`, one that is held stands there like a static one.
  void add(uint32_t body, const BodyMotion& start, bool held, bool asleep);
  void remove(uint32_t body);  // wakes what touches it
  bool contains(uint32_t body) const { return records_[body].body != nullptr; }  // of any body
  void apply_impulse(uint32_t body, const ModelEvent& event);
  // Gives a kinematic body the pose and the velocities of the step from `time_s` on.
  void move_by_keys(uint32_t body, double time_s);

  // Another solver of the contacts of some bodies, called before each iteration of this one, once
  // in a step: all that is awake is one group then. None: empty.
  void set_partner(std::function<void(int iteration)> partner);
  // For the partner: whether this step moves the body, and how, gravity included.
  bool is_solving(uint32_t body) const { return solver_.is_solving(*records_[body].body); }
  Vec3 solver_velocity(uint32_t body) const;
  Vec3 solver_spin(uint32_t body) const;
  void change_solver_velocity(uint32_t body, const Vec3& linear, const Vec3& angular);
  void carry(uint32_t body);  // as contacts would that hold it

  // `before_solver` is called when the step's contacts are known.
  void step(StageTimer& timer, const std::function<void()>& before_solver);

  BodyMotion motion(uint32_t body) const;
  // Of the convex pieces of the body's collision shape, or of the whole where it has none, with all
  // that they can reach in the step to come; world. `boxes` is overwritten.
  void boxes(uint32_t body, std::vector<Bounds>& boxes) const;
  // Of a body that may be outside of the world, if it stood there.
  Bounds box_at(uint32_t body, const Pose& pose) const;
  // How far its collision shape reaches below the centre in that orientation, m; of a dynamic body.
  double reach_below_m(uint32_t body, const Quat& orientation) const;
  bool is_active(uint32_t body) const { return records_[body].body->isActive(); }
  void set_velocity(uint32_t body, const Vec3& linear, const Vec3& angular);
  // Moves a body by something else than its velocity.
  void nudge(uint32_t body, const Vec3& way, const Quat& turn);
  void put_to_sleep(uint32_t body);  // see BodyControl
  void fall_asleep(uint32_t body);   // by the world's own rule, at once
  void wake(uint32_t body);
  void set_friction(uint32_t body, double friction);
  void refresh_friction();  // of contacts that are there, after set_friction()

  void read_contacts(std::vector<BodyContact>& contacts) const;
  void find_hits(std::vector<Hit>& hits);

  ConstraintId add_nail(const Nail& nail);
  void remove_constraint(ConstraintId constraint);
  bool holds(ConstraintId constraint) const;

  // Which pairs of bodies touch at all, asked in every step; none: all.
  void set_pair_filter(PairFilter filter) { dispatcher_.filter = std::move(filter); }

  // Before any is added: these never touch each other, whatever the filter says. What lies close
  // together then costs no pairs.
  void keep_apart(const std::vector<uint32_t>& bodies);

  double kinetic_energy_j(uint32_t body) const;
  // Contacts and penetration of the last step.
  void add_contacts_to(FrameStatistics& statistics) const;

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

  void set_up_dynamic(uint32_t index, const BodyMotion& start, btRigidBody& body);
  void remove_constraints_of(uint32_t index);

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

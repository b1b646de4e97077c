// A step's contacts and joints as the contact solver wants them, and what it makes of them.
#pragma once

#include <span>
#include <vector>

#include "core/disjoint_sets.h"
#include "scene/scene.h"
#include "simulate/exact/contact_solver.h"
#include "simulate/exact/curve_order.h"
#include "simulate/exact/state.h"
#include "simulate/exact_engine.h"

namespace pilesim::exact {

class StepSolver {
 public:
  // Works on the bodies, pairs and joints of `state`; `active`: the bodies that do not stand still.
  // All must outlive it.
  struct Followed {  // a kinematic body in the step to come
    uint32_t body;
    double time_s;  // where the step begins
  };

  StepSolver(const Scene& scene, const Model& model, std::span<const CollisionShape> shapes,
             EngineState& state, const std::vector<uint32_t>& active);

  // Moves the bodies that contacts of the pairs `touching`, joints or the `partner` may push by
  // `step_s`, less what they have made of it already (`advanced_s`, of each body). Each island gets
  // the substeps that its loads need.
  void solve(double step_s, std::span<const uint32_t> touching, std::span<const double> advanced_s,
             const Partner& partner);
  // In the step to come the body, which is kinematic, moves as its keys and motors say from
  // `time_s` on: in each substep.
  void follow(uint32_t body, double time_s) { followed_.push_back({body, time_s}); }
  const std::vector<Followed>& followed() const { return followed_; }
  // Whether solve() has moved the body.
  bool has_moved(uint32_t body) const { return place_[body] != kNone; }

  // For the partner: see ExactEngine.
  Vec3 velocity(uint32_t body) const;
  Vec3 spin(uint32_t body) const;
  void change_velocity(uint32_t body, const Vec3& linear, const Vec3& angular);

 private:
  static constexpr uint32_t kNone = ~uint32_t{0};
  struct Group;
  void list_bodies(std::span<const uint32_t> touching, const Partner& partner);
  void find_loads(std::span<const uint32_t> touching);
  std::vector<double> find_hanging() const;
  double rate2(uint32_t body) const;
  std::vector<Group> group(std::span<const uint32_t> touching, const Partner& partner);
  void solve(const Group& group, std::span<const double> advanced_s);
  void make_bodies(std::span<const double> advanced_s);
  Vec3 turned_spin(const SolverBody& body) const;
  void list_contacts(std::span<const uint32_t> touching);
  Quat bent(const Joint& joint) const;
  bool is_torn(const Joint& joint) const;
  void list_joints(std::span<const uint32_t> joints);
  void take_over_joints();
  void take_over_bodies();
  void turn_surfaces();
  void list_paths();
  uint32_t place_of(uint32_t body);  // of one that is not moved: listed when it is asked for
  const CollisionShape& shape_of(uint32_t body) const { return shapes_[bodies_[body].shape]; }

  std::span<const CollisionShape> shapes_;
  EngineState& state_;
  std::vector<Body>& bodies_;
  const std::vector<uint32_t>& active_;
  RollingResistance resistance_;
  double accuracy_;  // as Scene has it
  const Model& model_;
  std::vector<uint32_t> running_;  // bodies with a surface velocity
  SolverSettings settings_;
  ContactSolver solver_;
  // Scratch of a step.
  std::vector<Followed> followed_;
  std::vector<uint32_t> place_;      // of bodies in the solver's list
  std::vector<uint8_t> is_touched_;  // bodies that a contact, a joint or the partner may push
  std::vector<uint32_t> movers_;     // those that are solved, in the order of a curve through space
  DisjointSets islands_;
  std::vector<double> loads_;              // 1/s^2: squares of rates of substeps, by body or island
  std::vector<SurfaceVelocity> surfaces_;  // of running_, in the step
  std::vector<SolverBody> solver_bodies_;
  std::vector<uint32_t> body_at_;
  CurveOrder order_;
  size_t moving_ = 0;  // of them, which come first
  std::vector<ContactRange> ranges_;
  std::vector<SolverJoint> solver_joints_;
  std::vector<size_t> joint_at_;
  std::vector<ConstraintId> broken_;
};

}  // namespace pilesim::exact

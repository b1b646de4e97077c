// Contacts solved in soft substeps: each substep pulls bodies, lets contacts push back softly,
// moves bodies, and relaxes what the softness has left in their velocities ("TGS soft", Catto,
// Solver2D 2024; Macklin et al., "Small Steps in Physics Simulation", 2019).
//
// Contacts that share no body are solved side by side in the lanes of a register; see
// contact_blocks.cpp. The result does not depend on the number of threads.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <span>
#include <vector>

#include "core/disjoint_sets.h"
#include "core/types.h"
#include "scene/scene.h"
#include "simulate/exact/lanes.h"
#include "simulate/exact/pair.h"
#include "simulate/exact/state.h"
#include "simulate/rolling_resistance.h"

namespace pilesim::exact {

template <typename T, typename Block>
struct Weights;

// A body as solvers see it; world axes.
struct SolverBody {
  // m/s, rad/s; with the contacts and the gravity of the step when it is solved
  Vec3 velocity = Vec3::Zero(), spin = Vec3::Zero();
  Mat3 inverse_inertia = Mat3::Zero();  // 1 / kg m^2, world, as the step begins
  double inverse_mass = 0;              // 1 / kg; 0: moves by its velocities alone
  // For what turns fast: principal moments, kg m^2, and the turn of those axes to the world.
  Vec3 moments = Vec3::Zero();
  Quat axes = Quat::Identity();
  Vec3 turned_spin = Vec3::Zero();   // rad/s, change of the spin in the step by turning alone
  Vec3 displacement = Vec3::Zero();  // m, of the step
  Quat turn = Quat::Identity();      // of the step, world
  double share = 1;                  // of the step that is still to come for it
};

// Up to kMostOfPlane contacts of a pair. Bodies are places in the solver's list.
struct ContactRange {
  Contact* contacts;
  uint32_t count;
  uint32_t a, b;
  double friction, restitution;
  double slop_m;    // overlaps beyond it are undone slowly
  bool is_joined;   // by a joint, which overlaps are not to strain
  bool collides;    // some contact is an impact
  TorqueArms arms;  // of what holds back rolling and spinning
  // How the surfaces of its bodies run along them, world axes; null: they do not.
  const SurfaceVelocity* surface_a = nullptr;
  const SurfaceVelocity* surface_b = nullptr;
};

// A point of one body held at a point of another. Bodies are places in the solver's list; where the
// world holds a, b is a body that never moves.
struct SolverJoint {
  uint32_t a, b;
  Vec3 arm_a, arm_b;            // m, from either centre to the point, world, as the step begins
  Vec3 apart;                   // m, from a's point to b's
  Vec3 axis_a, axis_b;          // unit, world
  Vec3 force_n = Vec3::Zero();  // on b, in the step before; then in this one
  Vec3 torque_nm = Vec3::Zero();
  Vec3 push_ns = Vec3::Zero();  // on b, of the whole step
  Holds holds = Holds::axis;
  Quat bent = Quat::Identity();  // from b's attitude as it is meant to b's, world
  double strength_n = std::numeric_limits<double>::infinity();  // of glue
  double strength_nm = std::numeric_limits<double>::infinity();
  // Hinges have these, as in Joint; `axis` is that of the substep, world.
  double least_turn = -std::numeric_limits<double>::infinity();
  double most_turn = std::numeric_limits<double>::infinity();
  double motor_rad_s = 0, motor_most_nm = 0;
  double motor_nm = 0, limit_nm = 0;  // on b, about the axis, in the step before; then in this one
  double turn = 0;                    // of b against a, rad
  Vec3 axis = Vec3::Zero();
  Vec3 torque_on_b_nm() const { return torque_nm + (motor_nm + limit_nm) * axis; }
  bool has_axial() const {
    return motor_most_nm > 0 || std::isfinite(least_turn) || std::isfinite(most_turn);
  }
  // Where its bodies are in the substep: from their centres to the middle between the two points,
  // m; how b is turned against a, rad; inverse inertias, 1 / kg m^2; what turns and moves b against
  // a.
  Vec3 from_a = Vec3::Zero(), from_b = Vec3::Zero(), gap = Vec3::Zero(), angle = Vec3::Zero();
  Mat3 inertia_a = Mat3::Zero(), inertia_b = Mat3::Zero(), moment = Mat3::Zero(),
       mass = Mat3::Zero();
  // Its change of a's and b's velocities in the substep, m/s and rad/s.
  struct Given {
    Vec3 linear = Vec3::Zero(), angular = Vec3::Zero();
  };
  Given given_a, given_b;
};

// How a substep pushes back: the speed that it asks for is `rate` (1/s) times the distance; of the
// push that would give it, it gives mass_scale, and takes force_scale off what there was.
struct Softness {
  double rate, mass_scale, force_scale;
};

// Softness of a spring of so many Hz and so much damping (1: critical), in substeps of `h` s.
inline Softness softness(double hertz, double damping, double h) {
  const double omega = 2 * kPi * hertz;
  const double a1 = 2 * damping + h * omega;
  const double a2 = h * omega * a1;
  const double a3 = 1 / (1 + a2);
  return {omega / a1, a2 * a3, a3};
}

// A body that contacts do not move has such a velocity and spin in each substep.
struct SolverPath {
  uint32_t body;                     // its place in the solver's list
  std::vector<Vec3> velocity, spin;  // m/s, rad/s
};

struct SolverSettings {
  double step_s;
  double push_time_s;  // in which deep overlaps fall by e
  double push_speed;   // m/s, at most
  int substeps;
  Vec3 gravity;                      // m/s^2
  std::function<void(int)> partner;  // before each sweep that is shared with it; empty: none
  int shared_sweeps = 0;
  bool has_torques = false;   // some contacts may hold back rolling and spinning
  bool has_surfaces = false;  // some surfaces may run or turn
  std::vector<SolverPath> paths;
};

class ContactSolver {
 public:
  // Bodies that contacts move come first, `moving` of them; those that are near each other in space
  // had better be so in the list. Changes bodies, and the forces of the contacts.
  void solve(const SolverSettings& settings, std::vector<SolverBody>& bodies, size_t moving,
             std::span<const ContactRange> contacts, std::span<SolverJoint> joints);

  // For the partner: a body by its place, as the step would end. Its changes act on the body all
  // through the step.
  Vec3 velocity(uint32_t body) const;
  Vec3 spin(uint32_t body) const;
  void change_velocity(uint32_t body, const Vec3& linear, const Vec3& angular);

 private:
  using T = float;
  static constexpr uint32_t kNone = ~uint32_t{0};
  static constexpr size_t kLanes = Lanes<T>::kCount;
  using Row = std::array<T, kLanes>;
  using Rows = std::array<Row, 3>;

  struct alignas(32) Motion {
    std::array<T, 8> v;  // velocity x y z, spin x y z, -, -
  };
  struct alignas(32) Inverse {
    std::array<T, 8> v;  // inertia xx, yy, zz, xy, xz, yz, 1 / kg m^2, world; mass, 1 / kg; -
  };
  struct alignas(32) Shift {
    std::array<T, 8> v;  // m, displacement x y z; turn x y z w; the body's share of the step
  };
  // Contacts of kLanes pairs that share no body.
  struct alignas(32) Block {
    std::array<uint32_t, kLanes> a, b;
    uint32_t first_point, points;
    uint32_t visited;    // when it was last; see changed_
    bool is_settled;     // its points came to agree then
    bool is_reached;     // some lane has part in this round of impacts
    bool has_impacts;    // some lane collides in it
    bool holds_turning;  // some lane's torque arms are not 0
    bool has_surfaces;   // some lane has a surface that runs or turns
    alignas(32) Row inverse_mass_a, inverse_mass_b;
    std::array<Row, 6> inertia_a, inertia_b;  // inverse; xx, yy, zz, xy, xz, yz
    Rows between;                             // m, centre a less centre b
    Row friction, restitution, slop;
    Row edged;                          // 0: a round side, 1: corners that turn
    Row rate, mass_scale, force_scale;  // of the softness
    // Impacts; see bounce_solver.cpp. Lanes hold 1 or 0.
    Row impact;   // its bodies collide in this round
    Row bounced;  // they have in a round before
    Row passes;   // it passes impulses on without a bounce of its own
    Row reached;  // it has part in this round
  };
  // Where the contacts of a block's lanes are found.
  struct LaneContacts {
    std::array<const Contact*, kLanes> first{};
    std::array<uint32_t, kLanes> count{};
  };
  struct alignas(32) Point {
    Rows normal, arm;  // of a, m
    Row now;           // m, how far apart as the substep begins
    Rows answer;       // 1 / kg: how b is moved against a, there, by a push along the normal
    Row mass_along, mass_across;  // kg, effective
    Row push;                     // N s
    Rows friction;                // N s
    Row slop;                     // m: overlaps beyond it are undone slowly
  };
  // Values of a point that sweeps do not read.
  struct alignas(32) PointStart {
    Row distance;  // m, as the step begins
    Row parting;   // m/s, at which an impact parts it; below 0: no faster than this it comes nearer
    Row allowance;  // m, of the last substep
    Row impact;     // s: from the step's begin until a bounce
  };
  // Impulses of an impact, N s; not carried over.
  struct alignas(32) Impulse {
    Row push;
    Rows friction;
  };
  // Resistance to the turning of b against a at a point, along the normal and two directions
  // across it. See rolling_solver.cpp.
  struct alignas(32) Torque {
    Rows across;                     // unit, the first of the two
    Row spinning, rolling;           // m: limits along and across, for a push
    Row along_mass;                  // kg m^2, effective
    std::array<Row, 3> across_mass;  // kg m^2, of both; uu, vv, uv
    Row least_mass;                  // kg m^2, of the direction across that turns most easily
    Rows given;                      // N m s, on b
    Rows impact;                     // N m s, in an impact; not carried over
  };
  // How the surface of b runs against that of a at a point, where contacts do not move one of them.
  struct alignas(32) Running {
    Rows velocity;  // m/s, across the normal, where bodies have come to
    Rows start;     // as the step begins
    Rows spin;      // rad/s
    Rows turning;   // rad/s, of all that surface, with its body: what moves along it gains speed
  };
  static constexpr T kNever = std::numeric_limits<T>::infinity();
  // Bodies that impulses connect: sums over their points of products with d and e (see
  // accelerate()), and what follows from them.
  struct ImpactIsland {
    bool is_open = false;  // the sweep has changed something
    double dd = 0, de = 0, ee = 0, d = 0, e = 0, noise = 0;
    double gained = 0;  // J: see find_gains()
    double s = 0, t = 0, part = 1;
    void choose_step();
  };
  struct Gathered;
  struct GatheredShifts;
  using V3 = Eigen::Matrix<T, 3, 1>;

  // Blocks that one thread goes through, one after the other.
  struct Batch {
    uint32_t first, end;  // in blocks_
  };
  void arrange(std::span<const ContactRange> contacts);
  void size_points();
  std::vector<uint32_t> sort_by_node(std::span<const ContactRange> contacts, size_t parts,
                                     std::vector<uint32_t>& node_first) const;
  void pack(std::span<const ContactRange> contacts, std::span<const uint32_t> which);
  void add_block(std::span<const ContactRange> contacts, std::span<const uint32_t> lanes);
  void prepare(const SolverSettings& settings, const std::vector<SolverBody>& bodies,
               std::span<const ContactRange> contacts);
  void take_over(const SolverSettings& settings, std::vector<SolverBody>& bodies,
                 std::span<const ContactRange> contacts);
  void fill(const SolverSettings& settings, std::span<const ContactRange> contacts, size_t bodies);
  Row fill_points(Block& block, const LaneContacts& lanes, T substep_s, int substeps);
  template <typename Visit>
  void for_blocks(const Visit& visit);
  void measure(Block& block, bool is_last);
  void take_turns(const SolverSettings& settings, const std::vector<SolverBody>& bodies,
                  std::span<SolverJoint> joints);
  void make_substeps(const SolverSettings& settings, std::vector<SolverBody>& bodies,
                     std::span<SolverJoint> joints);
  void set_velocity(uint32_t body, const Vec3& linear, const Vec3& angular);
  void add_velocity(uint32_t body, const Vec3& linear, const Vec3& angular);
  void apply_forces(Block& block);
  Quat turn_of(uint32_t body) const;  // since the step began
  Vec3 displacement_of(uint32_t body) const;
  void place(SolverJoint& joint, const std::vector<SolverBody>& bodies) const;
  void give(SolverJoint& joint, const Vec3& push, const Vec3& twist);
  void give_again(SolverJoint& joint, double substep_s, bool is_first);
  void solve_impacts(const SolverSettings& settings, std::span<const SolverJoint> joints);
  void find_partners(std::span<const SolverJoint> joints);
  void converge();
  void find_gains(std::span<const Motion> before);
  template <typename Visit>
  void for_gains(const Visit& visit);
  bool forbid_bounces();
  void cancel_gains(std::span<const Motion> before);
  void sum_impulses(std::span<const Motion> before);
  void move_back(std::span<const Motion> before);
  Lanes<T> moved_along(const Block& block, const Lanes3<T>& normal, const Lanes3<T>& arm) const;
  void forgive_bounces(const Block& block);
  bool is_to_visit(const Block& block) const;
  void begin_impact(Block& block);
  bool collide(Block& block, uint32_t now);
  void accelerate(uint32_t begin, uint32_t end);
  void find_impact_islands(uint32_t begin);
  ImpactIsland& impact_island(const Block& block, size_t lane);
  void find_impacts(Block& block, const SolverSettings& settings, bool is_last);
  template <bool kSoft>
  void sweep(Block& block, T inverse_step);
  Lanes3<T> fall_between(const Weights<T, Block>& weights) const;
  Lanes<T> approach(const PointStart& start, const Lanes3<T>& normal, const Lanes3<T>& fall) const;
  Gathered gather(const Block& block, std::span<const Motion> motions) const;
  void gather_weights(Block& block) const;
  GatheredShifts gather_shifts(const Block& block) const;
  void scatter(const Block& block, const Gathered& gathered, std::span<Motion> motions) const;
  void fill_surfaces(std::span<const ContactRange> contacts);
  void run_on(const Block& block);
  void fill_torques(std::span<const ContactRange> contacts, double substep_s);
  void apply_torques(const Block& block);
  void hold_turning(const Block& block, bool of_impact);
  void store_torques(std::span<const ContactRange> contacts, double substep_s) const;
  void pull(size_t begin, size_t end, const SolverSettings& settings, T h, bool first);
  void move(std::span<const SolverBody> bodies, size_t begin, size_t end, const Vec3& gravity,
            T substep_s);
  void turn_freely(const SolverBody& body, size_t i, double h);
  void hold(std::span<SolverJoint> joints, T h, bool soft);
  static double axial_change(SolverJoint& joint, double spin, const Softness& soft, double step_s);
  void store(std::span<const ContactRange> contacts, double substep_s);

  size_t moving_ = 0;
  T slow_rate_ = 0, fastest_ = 0;  // 1/s, m/s
  V3 fall_ = V3::Zero();           // m: what moves falls so far in the step
  T per_step_ = 0;                 // 1/s
  std::vector<Motion> motions_;    // of all bodies, and of nobody
  std::vector<Inverse> inverse_;   // beside motions_
  std::vector<Motion> pulled_;     // of those that move: without what contacts give in the substep
  std::vector<Motion> given_;      // by the partner, in the step
  std::vector<Motion> turned_;     // by turning alone, in the step
  std::vector<Shift> shifts_;
  std::vector<uint32_t> order_;  // of contact ranges, kNone where a lane is empty
  // Batches of a stage share no body that moves. Stages come one after the other.
  std::vector<Batch> batches_;
  std::vector<uint32_t> stage_first_;  // in batches_
  std::vector<uint32_t> open_of_;      // by bodies: while blocks are packed; see contact_blocks.cpp
  std::vector<Block> blocks_;
  std::vector<Point> points_;
  std::vector<PointStart> starts_;  // beside points_
  std::vector<Torque> torques_;     // beside points_, where something holds back turning
  std::vector<Running> running_;    // beside points_, where surfaces run
  // Impacts: beside points_ what they give, what they gave before the sweep, and what the last step
  // changed of it; beside motions_ whether an impulse has reached a body, when impulses have last
  // changed its velocity, counted in visits of blocks in their order, and scratch. least_impact_
  // (m/s): what gravity gives in a step; less is no impact. least_change_ (m/s): impacts need not
  // agree any better.
  static constexpr uint32_t kSeveral = kNone - 1;
  std::vector<uint32_t> partners_;  // by body: the only one that it meets, kNone or kSeveral
  std::vector<T> bounce_times_;     // by body: s from the step's begin, or kNever
  std::vector<Impulse> impulses_;
  std::vector<Row> former_, directions_;
  std::vector<uint8_t> struck_;
  std::vector<uint32_t> changed_;
  std::vector<Motion> by_change_, by_direction_;
  DisjointSets impact_sets_;
  std::vector<ImpactIsland> impact_islands_;  // by bodies; of the first of each set
  std::vector<uint32_t> impact_roots_, reached_blocks_, open_blocks_;
  T least_impact_ = 0, least_change_ = 0;
  bool is_small_ = false;  // for one thread
};

}  // namespace pilesim::exact

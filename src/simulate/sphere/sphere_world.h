// Bodies as spheres of changing radius that collide by signature and lie by contact impulses: the
// engine of the statistical mode.
//
// A step: speed up, sort into a grid, find contacts, draw responses of what collides, solve what
// lies (Gauss-Seidel over blocks of the grid in eight colours, so that threads share nothing and
// the result does not depend on their number), move, put to rest.
//
// Bodies that sleep lie in a grid of their own, which is sorted anew when enough more have fallen
// asleep: they cost nothing until something comes near.
//
// What a step works on lies in the order of the grid ("places"); what stays from step to step in
// the order of the model's bodies.
#pragma once

#include <cmath>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/parallel_for.h"
#include "core/stage_timer.h"
#include "model/model.h"
#include "simulate/body_control.h"
#include "simulate/sphere/body_signature.h"
#include "simulate/sphere/collision_response.h"
#include "simulate/sphere/contact_groups.h"
#include "simulate/sphere/dispatch_table.h"
#include "simulate/sphere/sphere_grid.h"
#include "simulate/sphere/surface_geometry.h"

namespace pilesim {

struct SphereWorldSettings {
  Vec3f gravity;  // m/s^2
  float step_s;
  uint64_t seed;
  bool sleeping;
  bool rest_control;
  int sweeps;  // of the contact solver
  // How pairs are treated where `dispatch` is null.
  PairMethod method = PairMethod::statistical;
  const DispatchTable* dispatch = nullptr;  // must outlive the world
};

// A body of the model, dynamic ones that were added. A cache line: a step reads and writes them in
// the order of the grid.
struct alignas(64) SphereBody {
  static constexpr uint8_t kNoTarget = kMostRestTargets;
  Quatf orientation = Quatf::Identity();  // body to world
  Vec3f position = Vec3f::Zero();         // m, world
  Vec3f velocity = Vec3f::Zero();         // m/s
  Vec3f spin = Vec3f::Zero();             // rad/s
  float surface_radius_m = 0;             // of the sphere against surfaces: h_coll, later h_rest
  uint32_t kept = ~0u;                    // the last of the impulses that it keeps, or none
  uint16_t slow_steps = 0;                // for how long it has hardly moved
  uint8_t touched : 1 = 0;                // a surface, in the step before
  uint8_t rest_target : 7 = kNoTarget;    // to which it turns
  uint8_t : 0;                            // threads write those above and read those below
  bool asleep : 1 = false;
  bool still : 1 = false;    // lies among the sleepers
  bool changed : 1 = false;  // set by the world, cleared by who reads the state
  // By another engine that moves it too: surface_radius_m is given in each step.
  bool shared : 1 = false;
  bool propped : 1 = false;  // by what is no sphere and no surface: it keeps the pose that it has
  bool put_to_sleep : 1 = false;  // from outside: no touch wakes it
};
static_assert(sizeof(SphereBody) == 64);

// Bodies of one shape, material and mass.
struct SphereKind {
  const BodySignature* object = nullptr;  // null for what is not dynamic
  float mass_kg = 0;
  float radius_m = 0;       // among bodies, unless it stands in a structure
  float outer_m = 0;        // of the body
  float rolling_m = 0;      // see SphereContact
  float root_friction = 0;  // with what catches
  float root_restitution = 0;
  float lift = 0;                               // see SphereContact
  float inverse_mass = 0, inverse_inertia = 0;  // 1/kg, 1/(kg m^2)
};

class SphereWorld {
 public:
  // Of a round. Sweeps over a block of the grid before the next one: its contacts are in the cache.
  static constexpr int kSweepsAtOnce = 2;

  SphereWorld(const Model& model, const std::vector<BodySignature>& objects,
              const SphereWorldSettings& settings);

  void add(uint32_t body, const Pose& pose, const Vec3& velocity, const Vec3& spin, bool asleep);
  void remove(uint32_t body);  // wakes what lay on it
  // See BodyControl.
  void put_to_sleep(uint32_t body);
  void wake(uint32_t body);
  void set_velocity(uint32_t body, const Vec3& linear, const Vec3& angular);
  void set_friction(uint32_t body, double friction);
  // Appends the contacts of spheres as they lie now, of pairs that spheres are to solve.
  void read_contacts(std::vector<BodyContact>& contacts) const;
  // And of structures also what stands on it: it would hang in the air.
  void wake_with_load(uint32_t body);
  // And of structures as much around it as the impulse can move: faster than what rests.
  void wake_hit(uint32_t body, float impulse_ns);
  // An impulse in N s at a point, or at the centre; it wakes the body.
  void push(uint32_t body, const Vec3& impulse, const std::optional<Vec3>& point);
  SurfaceGeometry& surfaces() { return surfaces_; }
  void wake_near(uint32_t body);  // all that a body or surface of the world may carry

  void step(StageTimer& timer);
  // The same in parts, for bodies that another solver moves too: after the first, motions are those
  // that contacts are to change; each round of sweeps may begin with other velocities.
  void begin_step(StageTimer& timer);
  void sweep();                      // a round; nothing after the last one
  void end_step(StageTimer& timer);  // with what is left of the rounds
  bool is_swept() const { return sweeps_left_ == 0; }
  // Between begin_step() and end_step(), of an active body; zero inverses: it rests in this step.
  SphereMotion& motion(uint32_t body) { return motion_[place_of_[body]]; }
  // Between them, of any body: whether motion() has it and contacts change it.
  bool is_moving(uint32_t body) const {
    const uint32_t place = place_of_[body];
    return place < body_.size() && body_[place] == body && motion_[place].inverse_mass > 0;
  }
  // After the sweeps: what its contacts have pushed, N s.
  float pressed(uint32_t body) const {
    return surface_push_[place_of_[body]] + body_push_[place_of_[body]];
  }

  const SphereBody& body(uint32_t i) const { return bodies_[i]; }
  SphereBody& body(uint32_t i) { return bodies_[i]; }
  const SphereKind& kind(uint32_t body) const { return kinds_[kind_of_[body]]; }
  const std::vector<uint32_t>& members() const { return members_; }
  // Those that are awake, and all that have `changed`.
  const std::vector<uint32_t>& active() const { return active_; }
  uint32_t contact_count() const;
  float deepest_penetration_m() const;

 private:
  static constexpr uint32_t kSurface = 0x80000000;  // set in `other`: a surface of that body
  // A contact as one body or both find it again in the next step.
  struct Touch {
    uint32_t a, b;   // places; b of bodies only
    uint32_t other;  // body
    uint32_t slot;   // in the groups
    uint32_t next;   // the next one of a in the batch, or kNone
    bool level;      // a horizontal surface that does not move
  };
  struct KeptImpulse {
    uint32_t other, next;
    Vec3f normal;
    ContactImpulse impulse;
  };
  struct Impact {
    uint32_t a, b;  // places; b of bodies only
    uint32_t body_a, other;
    Vec3f normal, surface_velocity;
    float gap;
    PairMethod method;
  };
  struct Hit {
    uint32_t body;  // sleeps
    float impulse_ns;
  };
  // The contacts that one thread finds and solves.
  struct Batch {
    ContactGroups contacts;
    std::vector<SphereMotion> fixed;  // rows of the contacts' own: see ContactGroups
    uint32_t fixed_begin = 0;
    std::vector<Touch> touches;
    std::vector<Impact> impacts;  // contacts that collide in this step
    std::vector<Hit> hit;
    std::vector<uint32_t> left;  // bodies that sleep, by what they stand on
    uint32_t kept_begin = 0;     // of its touches among what is kept
    uint32_t pressed = 0;        // contacts that carry something
    float deepest_m = 0;
  };
  struct Level {
    SphereGrid grid;
    uint32_t offset = 0;  // of its places
  };
  // By place of a grid: where spheres are, and how far they reach from there, m. Some room after
  // the last place for vectors.
  struct Reaches {
    std::vector<float> x, y, z, reach;
    void resize(size_t count) {
      for (auto* floats : {&x, &y, &z, &reach}) floats->resize(count + kLanes);
    }
    void set(size_t place, const Vec3f& centre, float reach_m) {
      x[place] = centre.x();
      y[place] = centre.y();
      z[place] = centre.z();
      reach[place] = reach_m;
    }
    Vec3f centre(size_t place) const { return {x[place], y[place], z[place]}; }
  };
  // Bodies that sleep. Those that are not `still` have woken up since, or were removed.
  struct Sleepers {
    SphereGrid grid;
    std::vector<uint32_t> bodies;
    Reaches reaches;
  };
  // What a sphere touches: another one in the grid, or one that sleeps.
  struct Partner {
    uint32_t body, row;  // row: of motions, or fixed; see SphereContact
    Vec3f centre, velocity;
    const SphereKind& kind;
    float radius_m;
    uint32_t kept;  // see SphereBody
  };
  static constexpr uint32_t kNone = ~0u;
  static constexpr float kRestSpeed = 0.05F;  // of sqrt(g r)
  static constexpr float kNearby = 0.02F;     // contacts are kept up to this gap, in radii
  static constexpr size_t kBodiesPerTask = 1024;

  SphereKind kind_of(const ModelBody& body, const BodySignature* object) const;
  void search(StageTimer& timer);
  void wake_by_touch(uint32_t body);
  void wake_structure(uint32_t first, float steepness, float most_kg);
  void sort_dozing();
  bool wake_by_contacts();
  void join_woken();
  void lay_down();
  void speed_up();
  void sort();
  void gather();
  void find_contacts();
  // Calls visit(q) for those of the range within reach of the sphere.
  template <class Visit>
  static void for_each_near(const Vec3f& centre, float reach_m, const Reaches& others,
                            const SphereGrid::Range& range, const Visit& visit);
  void find_of_block(uint32_t block, std::vector<uint64_t>& used, Batch& batch);
  void find_of_coarse_levels(std::vector<uint64_t>& used, Batch& batch);
  // `used`: see ContactGroups.
  bool leaves_behind(uint32_t lower, const Vec3f& velocity, uint32_t upper, const Vec3f& up) const;
  void touch_if_near(uint32_t p, uint32_t q, std::vector<uint64_t>& used, Batch& batch);
  void touch(uint32_t p, uint32_t q, std::vector<uint64_t>& used, Batch& batch);
  void touch(uint32_t p, const Partner& partner, std::vector<uint64_t>& used, Batch& batch);
  void touch_sleepers(uint32_t p, std::vector<uint64_t>& used, Batch& batch);
  void meet_surfaces(SphereGrid::Range places, std::vector<uint64_t>& used, Batch& batch);
  void meet_surfaces(uint32_t p, float reach, std::span<const uint32_t> near,
                     std::vector<uint64_t>& used, Batch& batch);
  float root_friction(uint32_t body, const SphereKind& kind) const {
    return root_friction_.empty() ? kind.root_friction : root_friction_[body];
  }
  PairMethod method(uint32_t body, uint32_t other) const {
    return settings_.dispatch == nullptr ? settings_.method
                                         : settings_.dispatch->method(body, other);
  }
  bool collides(float closing, float gap, float arm_m) const {
    return gap <= closing * settings_.step_s && closing > impact_speed(arm_m);
  }
  void add_contact(const SphereContact& contact, uint32_t other, bool level,
                   std::vector<uint64_t>& used, Batch& batch);
  ContactImpulse former_impulse(uint32_t kept, uint32_t other, const Vec3f& normal) const;
  void collide_bodies();
  void collide(const Impact& impact);
  Collision collision(const Impact& impact) const;
  void prepare_contacts();
  void keep_impulses(Batch& batch);
  void read_contact(uint32_t a, uint32_t b, std::vector<BodyContact>& contacts) const;
  void read_surface_contacts(uint32_t body, std::vector<BodyContact>& contacts) const;
  template <class Do>
  void for_each_batch(const Do& work);
  // parallel_for, or a plain loop over [0, count) where there is little to do.
  template <class Do>
  void share_out(size_t count, size_t grain, const Do& work) const {
    if (worth_threads_) {
      parallel_for(count, grain, work);
    } else if (count > 0) {
      work(0, count);
    }
  }
  void separate();
  void move();
  void move_body(uint32_t place);
  void widen(uint32_t body);
  bool control_rest(uint32_t place);
  void settle_body(uint32_t place);
  // m/s; what is slower may sleep
  float rest_speed(const SphereKind& kind) const {
    return kRestSpeed * std::sqrt(settings_.gravity.norm() * kind.outer_m);
  }
  // m/s; what approaches faster collides
  float impact_speed(float radius_m) const {
    return impact_base_ + impact_rise_ * std::sqrt(radius_m);
  }

  const Model& model_;
  SphereWorldSettings settings_;
  float impact_base_, impact_rise_;
  bool has_structures_ = false;  // bodies that begin asleep: what stands on them goes with them
  SurfaceGeometry surfaces_;
  std::vector<SphereBody> bodies_;
  std::vector<SphereKind> kinds_;
  std::vector<uint32_t> kind_of_;  // by body
  std::vector<float> radius_m_;    // by body: among bodies
  // By body, in place of its kind's; empty until set_friction().
  std::vector<float> root_friction_;
  std::vector<uint32_t> members_;  // bodies in the world, ascending
  std::vector<uint32_t> active_;   // of them, those in the grid of the awake, ascending
  std::vector<uint32_t> woken_;    // to become active
  Sleepers sleepers_;
  Sleepers dozing_;  // of wake_structure() only, without reaches
  bool is_dozing_sorted_ = false;
  size_t waiting_for_sleep_ = 0;  // sleepers among the active, summed over steps
  Vec3f mean_velocity_ = Vec3f::Zero();
  uint64_t steps_ = 0;

  // By place, anew in each step. Motions and shifts go on with the batches' fixed rows.
  std::vector<Level> levels_;
  std::vector<uint32_t> body_;
  std::vector<uint32_t> place_of_;  // by body: of active ones
  std::vector<Vec3f> centre_;
  Reaches middle_;                              // where it is in the middle of the step
  std::vector<uint32_t> kind_;                  // of bodies
  std::vector<float> radius_at_m_;              // of bodies
  std::vector<uint32_t> last_touch_, kept_of_;  // of the batch; of the step before
  std::vector<SphereMotion> motion_;
  std::vector<SphereShift> shift_;
  std::vector<float> surface_push_, body_push_;  // N s, what carries it
  std::vector<uint32_t> waiting_, large_;        // bodies, of sort() only
  std::vector<Vec3f> sorted_middle_;
  std::vector<float> sorted_reach_;

  bool is_idle_ = true;  // nothing is awake in this step
  int sweeps_left_ = 0;
  bool worth_threads_ = false;
  std::vector<const Impact*> chosen_;
  std::vector<Batch> batches_;
  std::vector<std::vector<uint32_t>> colours_;  // batches; those of the coarse levels last
  std::vector<KeptImpulse> kept_, former_;      // by touch of all batches
  std::vector<uint32_t> collided_;              // by body: the step in which it last did
};

}  // namespace pilesim

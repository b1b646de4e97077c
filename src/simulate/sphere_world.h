// Bodies as spheres of changing radius that collide by signature and lie by contact impulses: the
// engine of the statistical mode.
//
// A step: speed up, sort into a grid, find contacts, draw responses of what collides, solve what
// lies (Gauss-Seidel over blocks of the grid in eight colours, so that threads share nothing and
// the result does not depend on their number), move, put to rest.
#pragma once

#include <cstdint>
#include <vector>

#include "core/parallel_for.h"
#include "core/stage_timer.h"
#include "scene/model.h"
#include "simulate/body_signature.h"
#include "simulate/sphere_contact.h"
#include "simulate/sphere_grid.h"
#include "simulate/surface_geometry.h"

namespace pilesim {

struct SphereWorldSettings {
  Vec3f gravity;  // m/s^2
  float step_s;
  uint64_t seed;
  bool sleeping;
  int sweeps;  // of the contact solver
};

// By body of the model. Only dynamic bodies that were added mean something.
struct SphereStates {
  std::vector<Vec3f> position, velocity, spin;  // m, m/s, rad/s; world
  std::vector<Quatf> orientation;               // body to world
  std::vector<float> mass_kg, friction;
  std::vector<const BodySignature*> object;
  std::vector<float> surface_radius_m;   // of the sphere against surfaces: h_coll, later h_rest
  std::vector<float> slow_s;             // for how long it has hardly moved
  std::vector<uint8_t> asleep, touched;  // touched: a surface, in the step before
  std::vector<float> surface_push, body_push;  // N s, what carried it in the step before
};

class SphereWorld {
 public:
  SphereWorld(const Model& model, const std::vector<BodySignature>& objects,
              const SphereWorldSettings& settings);

  void add(uint32_t body, const Pose& pose, const Vec3& velocity, const Vec3& spin);
  void remove(uint32_t body);  // wakes what lay on it
  void wake(uint32_t body);
  SurfaceGeometry& surfaces() { return surfaces_; }
  void wake_near(uint32_t body);  // all that a body or surface of the world may carry

  void step(StageTimer& timer);

  const SphereStates& states() const { return states_; }
  SphereStates& states() { return states_; }
  const std::vector<uint32_t>& members() const { return members_; }
  uint32_t contact_count() const;
  float deepest_penetration_m() const;

 private:
  // The contacts that one thread finds and solves.
  struct Batch {
    std::vector<SphereContact> contacts;
    std::vector<uint32_t> next;     // per contact: the next one of body_a, or kNone
    std::vector<uint32_t> impacts;  // contacts that collide in this step
    std::vector<uint32_t> woken;    // bodies
  };
  struct Place {
    uint32_t batch = 0, contact = kNone;
  };
  struct Level {
    SphereGrid grid;
    uint32_t offset = 0;  // of its places
    float widest_m = 0;
  };
  static constexpr uint32_t kNone = ~0u;
  static constexpr size_t kBodiesPerTask = 1024;

  void speed_up();
  void sort();
  void find_contacts();
  void find_of_block(uint32_t block, Batch& batch);
  void find_of_coarse_levels(Batch& batch);
  void meet(uint32_t p, uint32_t q, Batch& batch);
  void meet_surfaces(uint32_t p, Batch& batch);
  void add_contact(SphereContact contact, Batch& batch);
  FormerImpulse former_of(const SphereContact& contact) const;
  void collide_bodies();
  void solve_contacts();
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
  void settle();
  void settle_body(uint32_t place);
  float impact_speed(float radius_m) const;  // m/s

  const Model& model_;
  SphereWorldSettings settings_;
  SurfaceGeometry surfaces_;
  SphereStates states_;
  std::vector<uint32_t> members_;  // bodies in the world, ascending
  uint64_t steps_ = 0;

  // By place, anew in each step.
  std::vector<Level> levels_;
  std::vector<uint32_t> body_;
  std::vector<Vec3f> centre_, shift_;
  std::vector<float> reach_m_, radius_m_;
  std::vector<SphereMotion> motion_;

  bool worth_threads_ = false;
  std::vector<Batch> batches_, former_;
  std::vector<std::vector<uint32_t>> colours_;  // batches; those of the coarse levels last
  std::vector<Place> first_, former_first_;     // by body: the first contact it owns
  std::vector<uint32_t> collided_;              // by body: the step in which it last did
};

}  // namespace pilesim

// Collisions as chapter 3 of the dissertation has them (3.2.4, 3.2.5), without the statistical
// mode's own methods (docs/dissertation.md): a body is one sphere of the collision height of its
// motion, for surfaces and bodies alike; every contact is drawn from its signature and none is
// solved; it is drawn as if the other were fixed, for both independently; a slow body on level
// ground turns to the nearest rest pose by its collisions, a body that is nearly still elsewhere
// stops where it is.
//
// Choices that the dissertation leaves open stand in drawn_world.cpp.
#pragma once

#include <cmath>
#include <cstdint>
#include <optional>
#include <vector>

#include "core/philox.h"
#include "core/stage_timer.h"
#include "core/state_stream.h"
#include "model/model.h"
#include "simulate/sphere/sphere_grid.h"
#include "simulate/sphere/sphere_model.h"
#include "simulate/sphere/surface_geometry.h"

namespace pilesim {

struct DrawnBody {
  static constexpr uint32_t kNoTarget = ~0U;
  Quatf orientation = Quatf::Identity();  // body to world
  Vec3f position = Vec3f::Zero();         // m, world
  Vec3f velocity = Vec3f::Zero();         // m/s
  Vec3f spin = Vec3f::Zero();             // rad/s
  float radius_m = 0;                     // of the sphere: h_coll, or on its way to h_rest
  uint32_t rest_target = kNoTarget;       // to which it turns
  bool asleep = false;                    // at rest, until something hits it
  bool changed = false;                   // set by the world, cleared by who reads the state
  bool shared = false;                    // an exact engine moves it, too, and puts it to sleep

  static void fields(auto& self, auto& stream) {
    stream(self.orientation, self.position, self.velocity, self.spin, self.radius_m,
           self.rest_target, self.asleep, self.changed, self.shared);
  }
};

struct DrawnState {
  uint64_t steps = 0;
  std::vector<DrawnBody> bodies;  // (B)
  std::vector<uint32_t> members;  // bodies in the world, ascending
  uint32_t contacts = 0;          // of the last step
  float deepest_m = 0;

  static void fields(auto& self, auto& stream) {
    stream(self.steps, self.bodies, self.members, self.contacts, self.deepest_m);
  }
};

class DrawnWorld {
 public:
  DrawnWorld(const Model& model, const BodySignatures& objects,
             const SphereWorldSettings& settings);
  DrawnWorld(const DrawnWorld&) = delete;
  DrawnWorld& operator=(const DrawnWorld&) = delete;

  void add(uint32_t body, const Pose& pose, const Vec3& velocity, const Vec3& spin, bool asleep);
  void remove(uint32_t body);
  // An impulse in N s at a point, or at the centre; it wakes the body.
  void push(uint32_t body, const Vec3& impulse, const std::optional<Vec3>& point);
  SurfaceGeometry& surfaces() { return surfaces_; }
  // All that touches a body or a surface of the world.
  void wake_near(uint32_t body);

  void put_to_sleep(uint32_t body);
  void wake(uint32_t body) { state_.bodies[body].asleep = false; }
  void set_velocity(uint32_t body, const Vec3& linear, const Vec3& angular);

  void step(StageTimer& timer) {
    begin_step(timer);
    end_step(timer);
  }
  // The same in parts, for bodies that an exact engine moves: after the first, drawn() has a
  // member's velocities after its contacts; the second moves all but shared bodies.
  void begin_step(StageTimer& timer);
  void end_step(StageTimer& timer);
  struct Drawn {
    bool is_hit;  // else as before, but for gravity
    Vec3f velocity, spin;
  };
  Drawn drawn(uint32_t body) const;

  const DrawnBody& body(uint32_t i) const { return state_.bodies[i]; }
  DrawnBody& body(uint32_t i) { return state_.bodies[i]; }
  const SphereKind& kind(uint32_t body) const { return model_.kind(body); }
  const std::vector<uint32_t>& members() const { return state_.members; }
  const std::vector<uint32_t>& active() const { return state_.members; }
  uint32_t contact_count() const { return state_.contacts; }
  float deepest_penetration_m() const { return state_.deepest_m; }

  void save(StateWriter& writer) const { writer(state_, surfaces_.state()); }
  void load(StateReader& reader);  // between steps

 private:
  // The effect of a step's contacts on a body; scratch.
  struct Response {
    Vec3f velocity, spin;
    uint32_t contacts = 0;
    float deepest_m = 0;
    bool is_hit = false;
    bool is_on_ground = false;  // near a level surface that does not move
  };
  struct Contact {
    Vec3f normal;  // unit, towards the body
    Vec3f other_velocity;
    float gap_m;
  };

  void speed_up();
  void sort();
  Response respond(uint32_t body) const;
  void meet(const Contact& contact, uint32_t body, uint32_t other, Philox& random,
            Response& response) const;
  void draw(const Contact& contact, const BodySignature& object, const Quatf& orientation,
            Philox& random, Response& response) const;
  void bounce(const Contact& contact, uint32_t body, uint32_t other, Response& response) const;
  bool is_posed(uint32_t body) const {
    return model_.settings.dispatch == nullptr || model_.settings.dispatch->is_posed(body);
  }
  bool is_calm(uint32_t body, float least_speed) const;
  void choose_rest(uint32_t body, const Response& response);
  void move(uint32_t body, const Response& response);
  float collision_radius_m(uint32_t body) const;
  float fall_speed(const SphereKind& kind) const {  // sqrt(g r), m/s
    return std::sqrt(model_.settings.gravity.norm() * kind.outer_m);
  }

  SphereModel model_;
  SurfaceGeometry surfaces_;
  DrawnState state_;
  // Scratch of a step.
  SphereGrid grid_;
  std::vector<Vec3f> centres_;
  std::vector<float> reaches_;
  std::vector<Response> responses_;  // beside members
};

}  // namespace pilesim

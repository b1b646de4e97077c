#include "simulate/sphere_world.h"

#include <algorithm>
#include <cmath>

#include "simulate/collision_response.h"
#include "simulate/rest_control.h"

namespace pilesim {
namespace {

// With fewer awake, handing work to threads takes longer than doing it.
constexpr size_t kBodiesForThreads = 1500;
// Part of the radius:
constexpr float kSlop = 0.005F;  // spheres may stay sunk this far: contacts do not come and go
// Of sqrt(g r): what approaches faster collides, what is slower lies, rubs and rolls, and wakes
// nothing.
constexpr float kImpactSpeed = 0.15F;
constexpr float kRestSpeed = 0.05F;
constexpr float kRestTime = 3;  // in sqrt(r / g)
// Sunk spheres come up by e in this time, in sqrt(r / g); in so many sweeps.
constexpr float kPositionTime = 0.3F;
constexpr int kPositionSweeps = 2;

}  // namespace

SphereWorld::SphereWorld(const Model& model, const std::vector<BodySignature>& objects,
                         const SphereWorldSettings& settings)
    : model_(model), settings_(settings), surfaces_(model) {
  const size_t count = model.bodies.size();
  SphereStates& s = states_;
  for (auto* vectors : {&s.position, &s.velocity, &s.spin}) vectors->assign(count, Vec3f::Zero());
  s.orientation.assign(count, Quatf::Identity());
  for (auto* floats :
       {&s.mass_kg, &s.friction, &s.surface_radius_m, &s.slow_s, &s.surface_push, &s.body_push}) {
    floats->assign(count, 0.0F);
  }
  s.asleep.assign(count, 0);
  s.touched.assign(count, 0);
  s.object.assign(count, nullptr);
  first_.assign(count, {});
  former_first_.assign(count, {});
  collided_.assign(count, kNone);
  for (size_t i = 0; i < count; ++i) {
    const ModelBody& body = model.bodies[i];
    s.mass_kg[i] = static_cast<float>(body.mass_kg);
    s.friction[i] = static_cast<float>(model.materials[body.material].friction);
    if (body.role == Role::dynamic) s.object[i] = &objects[body.shape];
  }
}

void SphereWorld::add(uint32_t body, const Pose& pose, const Vec3& velocity, const Vec3& spin) {
  SphereStates& s = states_;
  s.position[body] = pose.position.cast<float>();
  s.orientation[body] = pose.orientation.cast<float>();
  s.velocity[body] = velocity.cast<float>();
  s.spin[body] = spin.cast<float>();
  s.surface_radius_m[body] = s.object[body]->packing_radius_m;
  s.slow_s[body] = 0;
  s.asleep[body] = s.touched[body] = 0;
  members_.insert(std::ranges::lower_bound(members_, body), body);
}

void SphereWorld::wake(uint32_t body) {
  states_.asleep[body] = 0;
  states_.slow_s[body] = 0;
}

void SphereWorld::remove(uint32_t body) {
  wake_near(body);
  std::erase(members_, body);
}

void SphereWorld::wake_near(uint32_t body) {
  // Some room for what moves within the step.
  constexpr float kRoom = 1.5F;
  const BodySignature* object = states_.object[body];
  const bool is_member = std::ranges::binary_search(members_, body);
  for (const uint32_t other : members_) {
    const float reach = kRoom * states_.object[other]->outer_radius_m;
    const Vec3f& centre = states_.position[other];
    const bool near = is_member ? (centre - states_.position[body]).norm() <
                                      reach + kRoom * object->outer_radius_m
                                : surfaces_.may_touch(body, centre, reach);
    if (near) wake(other);
  }
}

uint32_t SphereWorld::contact_count() const {
  size_t count = 0;
  for (const Batch& batch : former_) {
    count += static_cast<size_t>(std::ranges::count_if(
        batch.contacts, [](const SphereContact& c) { return c.normal_impulse > 0; }));
  }
  return static_cast<uint32_t>(count);
}

float SphereWorld::deepest_penetration_m() const {
  float deepest = 0;
  for (const Batch& batch : former_) {
    for (const SphereContact& c : batch.contacts) deepest = std::max(deepest, -c.gap);
  }
  return deepest;
}

float SphereWorld::impact_speed(float radius_m) const {
  const float gravity = settings_.gravity.norm();
  return 1.2F * gravity * settings_.step_s + kImpactSpeed * std::sqrt(gravity * radius_m);
}

void SphereWorld::step(StageTimer& timer) {
  ++steps_;
  const bool all_asleep =
      std::ranges::all_of(members_, [&](uint32_t body) { return states_.asleep[body] != 0; });
  if (all_asleep) return;
  {
    StageTimer::Scope scope(timer, Stage::integration);
    speed_up();
  }
  {
    StageTimer::Scope scope(timer, Stage::broad_phase);
    sort();
  }
  {
    StageTimer::Scope scope(timer, Stage::narrow_phase);
    find_contacts();
  }
  {
    StageTimer::Scope scope(timer, Stage::solver);
    collide_bodies();
    solve_contacts();
    separate();
  }
  {
    StageTimer::Scope scope(timer, Stage::integration);
    move();
    settle();
    former_.swap(batches_);
    former_first_.swap(first_);
  }
}

void SphereWorld::speed_up() {
  const Vec3f change = settings_.step_s * settings_.gravity;
  for (const uint32_t body : members_) {
    if (states_.asleep[body] == 0) states_.velocity[body] += change;
  }
}

// Each body collides at most once in a step, first come first served; what else approaches it is
// stopped as what lies is.
void SphereWorld::collide_bodies() {
  std::vector<const SphereContact*> chosen;
  const auto now = static_cast<uint32_t>(steps_);
  for (const Batch& batch : batches_) {
    for (const uint32_t index : batch.impacts) {
      const SphereContact& c = batch.contacts[index];
      if (collided_[c.body_a] == now || (!c.has_surface() && collided_[c.body_b] == now)) continue;
      collided_[c.body_a] = now;
      if (!c.has_surface()) collided_[c.body_b] = now;
      chosen.push_back(&c);
    }
  }
  share_out(chosen.size(), 64, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) {
      const SphereContact& c = *chosen[i];
      const auto random_of = [&](uint32_t body) {
        return Philox(settings_.seed, Stream::response, body, now);
      };
      const auto collider = [&](uint32_t place) {
        const uint32_t body = body_[place];
        return Collider{states_.object[body], states_.mass_kg[body], motion_[place].velocity,
                        motion_[place].spin};
      };
      Collider a = collider(c.a);
      Philox random_a = random_of(c.body_a);
      const auto after = [&](const Collider& body, uint32_t place, float share_s) {
        // It moves as before until the two touch.
        shift_[place] += share_s * (motion_[place].velocity - body.velocity);
        motion_[place].velocity = body.velocity;
        motion_[place].spin = body.spin;
      };
      const Vec3f other = c.has_surface() ? c.surface_velocity : motion_[c.b].velocity;
      const float closing = (other - a.velocity).dot(c.normal);
      const float until_s = std::max(0.0F, c.gap) / closing;
      if (c.has_surface()) {
        collide_with_surface(c.normal, c.surface_velocity, random_a, a);
      } else {
        Collider b = collider(c.b);
        Philox random_b = random_of(c.body_b);
        collide(c.normal, random_a, random_b, a, b);
        after(b, c.b, until_s);
      }
      after(a, c.a, until_s);
    }
  });
}

// Batches of one colour share no sphere, so that their order, and threads, change nothing.
template <class Do>
void SphereWorld::for_each_batch(const Do& work) {
  for (const std::vector<uint32_t>& batches : colours_) {
    share_out(batches.size(), 1, [&](size_t begin, size_t end) {
      for (size_t i = begin; i < end; ++i) work(batches_[batches[i]]);
    });
  }
}

void SphereWorld::solve_contacts() {
  const auto second = [&](const SphereContact& c) {
    return c.has_surface() ? nullptr : &motion_[c.b];
  };
  for_each_batch([&](Batch& batch) {
    for (SphereContact& c : batch.contacts) prepare(former_of(c), c, motion_[c.a], second(c));
  });
  const float inverse_step = 1 / settings_.step_s;
  for (int sweep = 0; sweep < settings_.sweeps; ++sweep) {
    for_each_batch([&](Batch& batch) {
      for (SphereContact& c : batch.contacts) solve(inverse_step, c, motion_[c.a], second(c));
    });
  }
  for_each_batch([&](Batch& batch) {
    for (const SphereContact& c : batch.contacts) {
      if (c.has_surface()) {
        states_.surface_push[c.body_a] += c.level ? c.normal_impulse : 0;
        states_.body_push[c.body_a] += c.level ? 0 : c.normal_impulse;
      } else {
        states_.body_push[c.body_a] += c.normal_impulse;
        states_.body_push[c.body_b] += c.normal_impulse;
      }
    }
  });
}

// How far each sphere moves: along its velocity, and apart from what it is sunk into.
void SphereWorld::separate() {
  const float dt = settings_.step_s;
  share_out(body_.size(), kBodiesPerTask, [&](size_t begin, size_t end) {
    for (size_t p = begin; p < end; ++p) {
      if (motion_[p].inverse_mass > 0) shift_[p] += dt * motion_[p].velocity;
    }
  });
  const float gravity = settings_.gravity.norm();
  for (int sweep = 0; sweep < kPositionSweeps; ++sweep) {
    for_each_batch([&](Batch& batch) {
      for (const SphereContact& c : batch.contacts) {
        const Vec3f other = c.has_surface() ? Vec3f(dt * c.surface_velocity) : shift_[c.b];
        const float depth = -(c.gap + c.normal.dot(shift_[c.a] - other)) - kSlop * c.arm_a;
        if (depth <= 0) continue;
        const float time_s = gravity > 0 ? kPositionTime * std::sqrt(c.arm_a / gravity) : 0.03F;
        const float share = -std::expm1(-dt / (time_s * kPositionSweeps));
        const Vec3f push = share * depth * c.normal_mass * c.normal;
        shift_[c.a] += motion_[c.a].inverse_mass * push;
        if (!c.has_surface()) shift_[c.b] -= motion_[c.b].inverse_mass * push;
      }
    });
  }
}

void SphereWorld::move() {
  const float dt = settings_.step_s;
  share_out(body_.size(), kBodiesPerTask, [&](size_t begin, size_t end) {
    for (size_t p = begin; p < end; ++p) {
      if (motion_[p].inverse_mass == 0) continue;
      const uint32_t body = body_[p];
      Vec3f way = shift_[p];
      // The centre of what is fast never passes through a surface.
      if (way.squaredNorm() > 0.25F * radius_m_[p] * radius_m_[p]) {
        const double hit =
            surfaces_.first_hit(centre_[p].cast<double>(), (centre_[p] + way).cast<double>());
        if (hit < 1) way *= static_cast<float>(0.9 * hit);
      }
      states_.position[body] = centre_[p] + way;
      states_.velocity[body] = motion_[p].velocity;
      states_.spin[body] = motion_[p].spin;
      const float angle = motion_[p].spin.norm() * dt;
      if (angle > 0) {
        const Quatf turn(Eigen::AngleAxisf(angle, motion_[p].spin.normalized()));
        states_.orientation[body] = (turn * states_.orientation[body]).normalized();
      }
    }
  });
}

void SphereWorld::settle() {
  share_out(body_.size(), kBodiesPerTask, [&](size_t begin, size_t end) {
    for (size_t p = begin; p < end; ++p) {
      if (motion_[p].inverse_mass > 0) settle_body(body_[p]);
    }
  });
}

void SphereWorld::settle_body(uint32_t body) {
  SphereStates& s = states_;
  const BodySignature& object = *s.object[body];
  const float gravity = settings_.gravity.norm();
  if (gravity == 0) return;
  const float dt = settings_.step_s;
  const float scale = std::sqrt(gravity * object.outer_radius_m);
  const float weight = s.mass_kg[body] * gravity * dt;
  bool posed = true;
  if (s.touched[body] != 0) {
    const float speed = s.velocity[body].norm() + object.gyration_m * s.spin[body].norm();
    const bool alone = s.surface_push[body] > 0.5F * weight && s.surface_push[body] < 2 * weight &&
                       s.body_push[body] < 0.2F * weight;
    if (alone && speed < kControlSpeed * scale) {
      posed = turn_towards_rest(object, gravity, dt, s.orientation[body], s.spin[body],
                                s.surface_radius_m[body]);
    } else {
      // Never wider: two bodies that lean on each other would raise and lower themselves for ever.
      const float narrower =
          std::max(object.packing_radius_m, s.surface_radius_m[body] - kEaseSpeed * scale * dt);
      s.surface_radius_m[body] = std::min(s.surface_radius_m[body], narrower);
    }
  }
  const bool slow = s.velocity[body].norm() < kRestSpeed * scale &&
                    object.outer_radius_m * s.spin[body].norm() < kRestSpeed * scale;
  const bool carried = s.surface_push[body] + s.body_push[body] > 0.5F * weight;
  s.slow_s[body] = slow && posed && carried ? s.slow_s[body] + dt : 0;
  if (settings_.sleeping &&
      s.slow_s[body] > kRestTime * std::sqrt(object.outer_radius_m / gravity)) {
    s.asleep[body] = 1;
    s.velocity[body].setZero();
    s.spin[body].setZero();
  }
}

}  // namespace pilesim

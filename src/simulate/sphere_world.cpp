#include "simulate/sphere_world.h"

#include <algorithm>
#include <cmath>

#include "core/parallel_for.h"
#include "signature/collision_height.h"
#include "simulate/collision_response.h"
#include "simulate/rest_control.h"

namespace pilesim {
namespace {

constexpr size_t kBodiesPerTask = 1024;
// With fewer awake, handing work to threads takes longer than doing it.
constexpr size_t kBodiesForThreads = 1500;
// Parts of the radius.
constexpr float kSlop = 0.005F;   // spheres may stay sunk this far: contacts do not come and go
constexpr float kNearby = 0.02F;  // contacts are kept up to this gap
// Of sqrt(g r): what approaches faster collides, what is slower lies, rubs and rolls, and wakes
// nothing.
constexpr float kImpactSpeed = 0.15F;
constexpr float kRestSpeed = 0.05F;
constexpr float kRestTime = 3;  // in sqrt(r / g)
// Sunk spheres come up by e in this time, in sqrt(r / g); in so many sweeps.
constexpr float kPositionTime = 0.3F;
constexpr int kPositionSweeps = 2;
// The cosine up to which a contact with a surface is the one of the step before.
constexpr float kSameContact = 0.8F;

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

template <class Do>
void SphereWorld::share_out(size_t count, size_t grain, const Do& work) const {
  if (worth_threads_) {
    parallel_for(count, grain, work);
  } else if (count > 0) {
    work(0, count);
  }
}

void SphereWorld::speed_up() {
  const Vec3f change = settings_.step_s * settings_.gravity;
  for (const uint32_t body : members_) {
    if (states_.asleep[body] == 0) states_.velocity[body] += change;
  }
}

// Levels of spheres by size and speed, each with a grid of its own.
void SphereWorld::sort() {
  const size_t count = members_.size();
  body_.resize(count);
  centre_.resize(count);
  reach_m_.resize(count);
  radius_m_.resize(count);
  motion_.resize(count);
  shift_.resize(count);

  std::vector<uint32_t> bodies = members_;
  uint32_t offset = 0;
  size_t level = 0;
  std::vector<Vec3f> centres;
  std::vector<float> reaches;
  while (!bodies.empty()) {
    if (levels_.size() <= level) levels_.emplace_back();
    Level& here = levels_[level++];
    centres.clear();
    reaches.clear();
    for (const uint32_t body : bodies) {
      centres.push_back(states_.position[body]);
      reaches.push_back(states_.object[body]->packing_radius_m * (1 + kNearby) +
                        states_.velocity[body].norm() * settings_.step_s);
    }
    here.grid.sort(centres, reaches);
    here.offset = offset;
    here.widest_m = 0;
    const std::span<const uint32_t> order = here.grid.order();
    for (size_t p = 0; p < here.grid.small_count(); ++p, ++offset) {
      body_[offset] = bodies[order[p]];
      reach_m_[offset] = reaches[order[p]];
      here.widest_m = std::max(here.widest_m, reach_m_[offset]);
    }
    std::vector<uint32_t> large;
    for (size_t p = here.grid.small_count(); p < order.size(); ++p) {
      large.push_back(bodies[order[p]]);
    }
    bodies = std::move(large);
  }
  levels_.resize(level);

  share_out(count, kBodiesPerTask, [&](size_t begin, size_t end) {
    for (size_t p = begin; p < end; ++p) {
      const uint32_t body = body_[p];
      const BodySignature& object = *states_.object[body];
      const float mass = states_.mass_kg[body];
      const bool moves = states_.asleep[body] == 0;
      centre_[p] = states_.position[body];
      radius_m_[p] = object.packing_radius_m;
      shift_[p].setZero();
      motion_[p] = {states_.velocity[body], moves ? 1 / mass : 0, states_.spin[body],
                    moves ? 1 / (mass * object.gyration_m * object.gyration_m) : 0};
      first_[body] = {};
      states_.surface_push[body] = states_.body_push[body] = 0;
    }
  });
}

void SphereWorld::find_contacts() {
  const SphereGrid& grid = levels_.front().grid;
  colours_.resize(SphereGrid::kColours + 1);
  uint32_t count = 0;
  std::vector<uint32_t> block_of;
  for (size_t colour = 0; colour < SphereGrid::kColours; ++colour) {
    colours_[colour].clear();
    for (const uint32_t block : grid.blocks(colour)) {
      colours_[colour].push_back(count++);
      block_of.push_back(block);
    }
  }
  colours_.back() = {count};
  batches_.resize(count + 1);
  for (Batch& batch : batches_) {
    batch.contacts.clear();
    batch.next.clear();
    batch.impacts.clear();
    batch.woken.clear();
  }
  share_out(count, 1, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) find_of_block(block_of[i], batches_[i]);
  });
  find_of_coarse_levels(batches_.back());
  for (const Batch& batch : batches_) {
    for (const uint32_t body : batch.woken) wake(body);
  }
}

void SphereWorld::find_of_block(uint32_t block, Batch& batch) {
  const SphereGrid& grid = levels_.front().grid;
  grid.for_each_pair(block, [&](uint32_t p, uint32_t q) { meet(p, q, batch); });
  const SphereGrid::Range places = grid.places(block);
  for (uint32_t p = places.begin; p < places.end; ++p) meet_surfaces(p, batch);
}

// What is large or fast meets its like and all that is smaller.
void SphereWorld::find_of_coarse_levels(Batch& batch) {
  for (size_t level = 1; level < levels_.size(); ++level) {
    const Level& here = levels_[level];
    for (size_t colour = 0; colour < SphereGrid::kColours; ++colour) {
      for (const uint32_t block : here.grid.blocks(colour)) {
        here.grid.for_each_pair(
            block, [&](uint32_t p, uint32_t q) { meet(here.offset + p, here.offset + q, batch); });
      }
    }
    for (uint32_t p = here.offset; p < here.offset + here.grid.small_count(); ++p) {
      for (size_t finer = 0; finer < level; ++finer) {
        const Vec3f around = Vec3f::Constant(reach_m_[p] + levels_[finer].widest_m);
        levels_[finer].grid.for_each_in(centre_[p] - around, centre_[p] + around, [&](uint32_t q) {
          meet(p, levels_[finer].offset + q, batch);
        });
      }
      meet_surfaces(p, batch);
    }
  }
}

void SphereWorld::meet(uint32_t p, uint32_t q, Batch& batch) {
  const Vec3f apart = centre_[p] - centre_[q];
  const float reach = reach_m_[p] + reach_m_[q];
  const float distance2 = apart.squaredNorm();
  if (distance2 > reach * reach) return;
  if (motion_[p].inverse_mass == 0 && motion_[q].inverse_mass == 0) return;
  const float distance = std::sqrt(distance2);
  // Of two in one place the order decides.
  const Vec3f normal = distance > 0 ? Vec3f(apart / distance) : Vec3f::UnitY();
  const float gap = distance - radius_m_[p] - radius_m_[q];
  const float closing = (motion_[q].velocity - motion_[p].velocity).dot(normal);
  const float small = std::min(radius_m_[p], radius_m_[q]);
  if (gap > std::max(closing, 0.0F) * settings_.step_s + kNearby * small) return;
  const uint32_t a = body_[p], b = body_[q];
  add_contact({.a = p,
               .b = q,
               .body_a = a,
               .body_b = b,
               .normal = normal,
               .gap = gap,
               .arm_a = radius_m_[p],
               .arm_b = radius_m_[q],
               .friction = std::sqrt(states_.friction[a] * states_.friction[b]),
               .rolling_m = std::min(states_.object[a]->rolling * radius_m_[p],
                                     states_.object[b]->rolling * radius_m_[q]),
               .surface_velocity = Vec3f::Zero()},
              batch);
}

void SphereWorld::meet_surfaces(uint32_t p, Batch& batch) {
  if (motion_[p].inverse_mass == 0) return;
  const uint32_t body = body_[p];
  const BodySignature& object = *states_.object[body];
  const Vec3f& velocity = motion_[p].velocity;
  const float way = velocity.norm() * settings_.step_s;
  thread_local std::vector<SurfaceContact> found;
  found.clear();
  surfaces_.find(centre_[p], 0, object.outer_radius_m * (1 + kNearby) + way, found);
  bool touches = false;
  for (const SurfaceContact& contact : found) {
    const float closing = (contact.velocity - velocity).dot(contact.normal);
    // What comes flying has the radius that it collides with; what lies keeps its own.
    float radius = states_.surface_radius_m[body];
    if (states_.touched[body] == 0 && closing > impact_speed(radius)) {
      radius = collision_height(object.signature->heights, object.gyration_m, contact.normal,
                                velocity - contact.velocity, motion_[p].spin)
                   .mean_m;
    }
    const float gap = contact.gap - radius;
    if (gap > std::max(closing, 0.0F) * settings_.step_s + kNearby * radius) continue;
    if (!touches && states_.touched[body] == 0) states_.surface_radius_m[body] = radius;
    touches = true;
    add_contact({.a = p,
                 .b = 0,
                 .body_a = body,
                 .body_b = contact.body | kSurface,
                 .normal = contact.normal,
                 .gap = gap,
                 .arm_a = radius,
                 .arm_b = 0,
                 .friction = std::sqrt(states_.friction[body] * states_.friction[contact.body]),
                 .rolling_m = object.rolling * radius,
                 .surface_velocity = contact.velocity},
                batch);
    batch.contacts.back().level = contact.level;
  }
  states_.touched[body] = touches ? 1 : 0;
}

void SphereWorld::add_contact(SphereContact contact, Batch& batch) {
  const auto index = static_cast<uint32_t>(batch.contacts.size());
  const SphereMotion& a = motion_[contact.a];
  const Vec3f other =
      contact.has_surface() ? contact.surface_velocity : motion_[contact.b].velocity;
  const float closing = (other - a.velocity).dot(contact.normal);
  const float impact = impact_speed(contact.arm_a);
  if (closing > impact && contact.gap <= closing * settings_.step_s) {
    batch.impacts.push_back(index);
  }
  if (!contact.has_surface() && closing > impact) {
    for (const uint32_t body : {contact.body_a, contact.body_b}) {
      if (states_.asleep[body] != 0) batch.woken.push_back(body);
    }
  }
  Place& first = first_[contact.body_a];
  batch.next.push_back(first.contact);
  first = {static_cast<uint32_t>(&batch - batches_.data()), index};
  batch.contacts.push_back(contact);
}

FormerImpulse SphereWorld::former_of(const SphereContact& contact) const {
  const auto find = [&](uint32_t owner, uint32_t other) -> const SphereContact* {
    const Place place = former_first_[owner];
    if (place.contact == kNone) return nullptr;
    const Batch& batch = former_[place.batch];
    for (uint32_t i = place.contact; i != kNone; i = batch.next[i]) {
      const SphereContact& c = batch.contacts[i];
      if (c.body_b == other &&
          c.normal.dot(contact.normal) > (other & kSurface ? kSameContact : -2)) {
        return &c;
      }
    }
    return nullptr;
  };
  if (const SphereContact* c = find(contact.body_a, contact.body_b)) {
    return {c->normal_impulse, c->friction_impulse, c->rolling_impulse};
  }
  if (contact.has_surface()) return {};
  if (const SphereContact* c = find(contact.body_b, contact.body_a)) {
    return {c->normal_impulse, -c->friction_impulse, -c->rolling_impulse};
  }
  return {};
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
      const float change = kEaseSpeed * scale * dt;
      s.surface_radius_m[body] +=
          std::clamp(object.packing_radius_m - s.surface_radius_m[body], -change, change);
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

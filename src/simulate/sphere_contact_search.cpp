// The part of SphereWorld that finds contacts.

#include <algorithm>
#include <cmath>

#include "signature/collision_height.h"
#include "simulate/sphere_world.h"

namespace pilesim {
namespace {

constexpr float kNearby = 0.02F;  // contacts are kept up to this gap, in radii
// The cosine up to which a contact with a surface is the one of the step before.
constexpr float kSameContact = 0.8F;

}  // namespace

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

}  // namespace pilesim

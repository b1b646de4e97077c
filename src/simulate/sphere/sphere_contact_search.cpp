// The part of SphereWorld that finds contacts.

#include <hwy/highway.h>

#include <algorithm>
#include <bit>
#include <cmath>

#include "signature/table/collision_height.h"
#include "simulate/sphere/sphere_world.h"

namespace pilesim {
namespace {

// The cosine up to which a contact with a surface is the one of the step before.
constexpr float kSameContact = 0.8F;

namespace hn = hwy::HWY_NAMESPACE;
using Lanes = hn::FixedTag<float, kLanes>;

}  // namespace

// Levels of spheres by size and speed, each with a grid of its own. A sphere is where it is in the
// middle of the step, and reaches as far as it then may be from there, seen from the mean motion.
void SphereWorld::sort() {
  const size_t count = active_.size();
  const float half_step = 0.5F * settings_.step_s;
  body_.resize(count);
  middle_.resize(count);
  waiting_ = active_;
  uint32_t offset = 0;
  size_t level = 0;
  while (!waiting_.empty()) {
    if (levels_.size() <= level) levels_.emplace_back();
    Level& here = levels_[level++];
    sorted_middle_.resize(waiting_.size());
    sorted_reach_.resize(waiting_.size());
    share_out(waiting_.size(), kBodiesPerTask, [&](size_t begin, size_t end) {
      for (size_t i = begin; i < end; ++i) {
        const uint32_t body = waiting_[i];
        const Vec3f& velocity = bodies_[body].velocity;
        sorted_middle_[i] = bodies_[body].position + half_step * velocity;
        sorted_reach_[i] =
            radius_m_[body] * (1 + kNearby) + half_step * (velocity - mean_velocity_).norm();
      }
    });
    here.grid.sort(sorted_middle_, sorted_reach_);
    here.offset = offset;
    const std::span<const uint32_t> order = here.grid.order();
    share_out(here.grid.small_count(), kBodiesPerTask, [&](size_t begin, size_t end) {
      for (size_t p = begin; p < end; ++p) {
        body_[offset + p] = waiting_[order[p]];
        middle_.set(offset + p, sorted_middle_[order[p]], sorted_reach_[order[p]]);
      }
    });
    offset += static_cast<uint32_t>(here.grid.small_count());
    large_.clear();
    for (size_t p = here.grid.small_count(); p < order.size(); ++p) {
      large_.push_back(waiting_[order[p]]);
    }
    waiting_.swap(large_);
  }
  levels_.resize(level);
}

// Brings what the step works on into the order of places.
void SphereWorld::gather() {
  const size_t count = body_.size();
  for (auto* places : {&kind_, &last_touch_, &kept_of_}) places->resize(count);
  for (auto* pushes : {&surface_push_, &body_push_}) pushes->assign(count, 0.0F);
  centre_.resize(count);
  motion_.resize(count);
  shift_.resize(count);
  radius_at_m_.resize(count);
  share_out(count, kBodiesPerTask, [&](size_t begin, size_t end) {
    for (size_t p = begin; p < end; ++p) {
      SphereBody& body = bodies_[body_[p]];
      kind_[p] = kind_of_[body_[p]];
      place_of_[body_[p]] = static_cast<uint32_t>(p);
      const SphereKind& kind = kinds_[kind_[p]];
      centre_[p] = body.position;
      radius_at_m_[p] = radius_m_[body_[p]];
      motion_[p] = {body.velocity, body.asleep ? 0 : kind.inverse_mass, body.spin,
                    body.asleep ? 0 : kind.inverse_inertia};
      shift_[p] = {Vec3f::Zero(), motion_[p].inverse_mass};
      last_touch_[p] = kNone;
      kept_of_[p] = body.kept;
      body.kept = kNone;
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
  share_out(count + 1, 1, [&](size_t begin, size_t end) {
    thread_local std::vector<uint64_t> used;
    if (used.size() < body_.size()) used.resize(body_.size());
    for (size_t i = begin; i < end; ++i) {
      Batch& batch = batches_[i];
      batch.contacts.clear();
      batch.fixed.assign(1, {});
      batch.touches.clear();
      batch.impacts.clear();
      batch.hit.clear();
      batch.left.clear();
      batch.pressed = 0;
      batch.deepest_m = 0;
      if (i < count) {
        find_of_block(block_of[i], used, batch);
      } else {
        find_of_coarse_levels(used, batch);
      }
      batch.contacts.clear_marks(used);
    }
  });
  auto rows = static_cast<uint32_t>(body_.size());
  uint32_t touches = 0;
  for (Batch& batch : batches_) {
    batch.kept_begin = touches;
    touches += static_cast<uint32_t>(batch.touches.size());
    batch.fixed_begin = rows;
    rows += static_cast<uint32_t>(batch.fixed.size());
  }
  motion_.resize(rows);
  shift_.resize(rows);
  kept_.resize(touches);
}

template <class Visit>
void SphereWorld::for_each_near(const Vec3f& centre, float reach_m, const Reaches& others,
                                const SphereGrid::Range& range, const Visit& visit) {
  const Lanes tag;
  const auto x = hn::Set(tag, centre.x()), y = hn::Set(tag, centre.y());
  const auto z = hn::Set(tag, centre.z()), reach = hn::Set(tag, reach_m);
  for (uint32_t q = range.begin; q < range.end; q += kLanes) {
    const auto dx = hn::Sub(hn::LoadU(tag, &others.x[q]), x);
    const auto dy = hn::Sub(hn::LoadU(tag, &others.y[q]), y);
    const auto dz = hn::Sub(hn::LoadU(tag, &others.z[q]), z);
    const auto both = hn::Add(hn::LoadU(tag, &others.reach[q]), reach);
    const auto distance2 = hn::MulAdd(dx, dx, hn::MulAdd(dy, dy, hn::Mul(dz, dz)));
    uint8_t near = 0;
    hn::StoreMaskBits(tag, hn::Le(distance2, hn::Mul(both, both)), &near);
    const uint32_t count = range.end - q;
    uint32_t bits = count < kLanes ? near & ((1U << count) - 1) : near;
    for (; bits != 0; bits &= bits - 1) visit(q + static_cast<uint32_t>(std::countr_zero(bits)));
  }
}

void SphereWorld::find_of_block(uint32_t block, std::vector<uint64_t>& used, Batch& batch) {
  const SphereGrid& grid = levels_.front().grid;
  grid.for_each_place(block, [&](uint32_t p, std::span<const SphereGrid::Range> ranges) {
    const Vec3f middle = middle_.centre(p);
    for (const SphereGrid::Range& range : ranges) {
      for_each_near(middle, middle_.reach[p], middle_, range,
                    [&](uint32_t q) { touch(p, q, used, batch); });
    }
    touch_sleepers(p, used, batch);
  });
  meet_surfaces(grid.places(block), used, batch);
}

void SphereWorld::touch_sleepers(uint32_t p, std::vector<uint64_t>& used, Batch& batch) {
  if (sleepers_.bodies.empty() || motion_[p].inverse_mass == 0) return;
  const Vec3f middle = middle_.centre(p);
  // Reaches are seen from the mean motion: sleepers move against it.
  const float reach = middle_.reach[p] + 0.5F * settings_.step_s * mean_velocity_.norm();
  const Vec3f around = Vec3f::Constant(reach + sleepers_.grid.widest_m());
  sleepers_.grid.for_each_range_in(
      middle - around, middle + around, [&](const SphereGrid::Range& range) {
        for_each_near(middle, reach, sleepers_.reaches, range, [&](uint32_t q) {
          const uint32_t body = sleepers_.bodies[q];
          if (!bodies_[body].still) return;
          touch(p,
                {body, ContactGroups::kFixed, bodies_[body].position, Vec3f::Zero(), kind(body),
                 radius_m_[body], kNone},
                used, batch);
        });
      });
}

// What is large or fast meets its like and all that is smaller.
void SphereWorld::find_of_coarse_levels(std::vector<uint64_t>& used, Batch& batch) {
  for (size_t level = 1; level < levels_.size(); ++level) {
    const Level& here = levels_[level];
    for (size_t colour = 0; colour < SphereGrid::kColours; ++colour) {
      for (const uint32_t block : here.grid.blocks(colour)) {
        here.grid.for_each_pair(block, [&](uint32_t p, uint32_t q) {
          touch_if_near(here.offset + p, here.offset + q, used, batch);
        });
      }
    }
    const auto end = here.offset + static_cast<uint32_t>(here.grid.small_count());
    for (uint32_t p = here.offset; p < end; ++p) {
      const Vec3f middle = middle_.centre(p);
      for (size_t finer = 0; finer < level; ++finer) {
        const Vec3f around = Vec3f::Constant(middle_.reach[p] + levels_[finer].grid.widest_m());
        levels_[finer].grid.for_each_in(middle - around, middle + around, [&](uint32_t q) {
          touch_if_near(p, levels_[finer].offset + q, used, batch);
        });
      }
      touch_sleepers(p, used, batch);
    }
    meet_surfaces({here.offset, end}, used, batch);
  }
}

void SphereWorld::touch_if_near(uint32_t p, uint32_t q, std::vector<uint64_t>& used, Batch& batch) {
  const float reach = middle_.reach[p] + middle_.reach[q];
  if ((middle_.centre(p) - middle_.centre(q)).squaredNorm() <= reach * reach) {
    touch(p, q, used, batch);
  }
}

inline void SphereWorld::touch(uint32_t p, uint32_t q, std::vector<uint64_t>& used, Batch& batch) {
  if (motion_[p].inverse_mass == 0 && motion_[q].inverse_mass == 0) return;
  touch(p,
        {body_[q], q, centre_[q], motion_[q].velocity, kinds_[kind_[q]], radius_at_m_[q],
         kept_of_[q]},
        used, batch);
}

void SphereWorld::touch(uint32_t p, const Partner& partner, std::vector<uint64_t>& used,
                        Batch& batch) {
  const SphereKind& kind = kinds_[kind_[p]];
  const float radius = radius_at_m_[p];
  const Vec3f apart = centre_[p] - partner.centre;
  const float distance = apart.norm();
  // Of two in one place the order decides.
  const Vec3f normal = distance > 0 ? Vec3f(apart / distance) : Vec3f::UnitY();
  const float gap = distance - radius - partner.radius_m;
  const float closing = (partner.velocity - motion_[p].velocity).dot(normal);
  const float small = std::min(radius, partner.radius_m);
  const uint32_t body = body_[p], other = partner.body;
  if (has_structures_) {
    if (leaves_behind(body, motion_[p].velocity, other, -normal)) batch.left.push_back(other);
    if (leaves_behind(other, partner.velocity, body, normal)) batch.left.push_back(body);
  }
  if (gap > std::max(closing, 0.0F) * settings_.step_s + kNearby * small) return;
  const PairMethod method = this->method(body, other);
  if (!by_spheres(method)) return;
  if (collides(closing, gap, radius)) {
    // What was put to sleep stands like a surface.
    if (bodies_[other].put_to_sleep) {
      batch.impacts.push_back({p, 0, body, other | kSurface, normal, Vec3f::Zero(), gap, method});
    } else if (bodies_[body].put_to_sleep) {
      batch.impacts.push_back(
          {partner.row, 0, other, body | kSurface, -normal, Vec3f::Zero(), gap, method});
    } else {
      batch.impacts.push_back({p, partner.row, body, other, normal, Vec3f::Zero(), gap, method});
      for (const uint32_t b : {body, other}) {
        if (bodies_[b].asleep) batch.hit.push_back({b, closing * this->kind(b).mass_kg});
      }
    }
  }
  ContactImpulse impulse = former_impulse(kept_of_[p], other, normal);
  if (impulse.normal == 0) {
    impulse = former_impulse(partner.kept, body, normal);
    impulse.friction = -impulse.friction;
    impulse.rolling = -impulse.rolling;
  }
  add_contact({.a = p,
               .b = partner.row,
               .normal = normal,
               .gap = gap,
               .arm_a = radius,
               .arm_b = partner.radius_m,
               .friction = root_friction(body, kind) * root_friction(other, partner.kind),
               .rolling_m = std::min(kind.rolling_m, partner.kind.rolling_m),
               .lift = kind.lift,
               .impulse = impulse},
              other, false, used, batch);
}

void SphereWorld::meet_surfaces(SphereGrid::Range places, std::vector<uint64_t>& used,
                                Batch& batch) {
  const auto reach_of = [&](uint32_t p) {
    return kinds_[kind_[p]].outer_m * (1 + kNearby) + motion_[p].velocity.norm() * settings_.step_s;
  };
  Eigen::AlignedBox3f box;
  float widest = 0;
  for (uint32_t p = places.begin; p < places.end; ++p) {
    if (motion_[p].inverse_mass == 0) continue;
    box.extend(centre_[p]);
    widest = std::max(widest, reach_of(p));
  }
  if (box.isEmpty()) return;
  thread_local std::vector<uint32_t> near;
  surfaces_.select(box, widest, near);
  if (near.empty()) {
    for (uint32_t p = places.begin; p < places.end; ++p) bodies_[body_[p]].touched = 0;
    return;
  }
  for (uint32_t p = places.begin; p < places.end; ++p) {
    if (motion_[p].inverse_mass > 0) meet_surfaces(p, reach_of(p), near, used, batch);
  }
}

void SphereWorld::meet_surfaces(uint32_t p, float reach, std::span<const uint32_t> near,
                                std::vector<uint64_t>& used, Batch& batch) {
  const uint32_t body = body_[p];
  const BodySignature& object = *kind(body).object;
  const Vec3f& velocity = motion_[p].velocity;
  thread_local std::vector<SurfaceContact> found;
  found.clear();
  surfaces_.find(near, centre_[p], 0, reach, found);
  bool touches = false;
  for (const SurfaceContact& contact : found) {
    const PairMethod method = this->method(body, contact.body);
    if (!by_spheres(method)) continue;
    const float closing = (contact.velocity - velocity).dot(contact.normal);
    // What comes flying has the radius that it collides with; what lies keeps its own.
    float radius = bodies_[body].surface_radius_m;
    if (method == PairMethod::statistical && bodies_[body].touched == 0 && !bodies_[body].shared &&
        closing > impact_speed(radius)) {
      radius = collision_height(object.signature->heights, object.gyration_m, contact.normal,
                                velocity - contact.velocity, motion_[p].spin)
                   .mean_m;
    }
    const float gap = contact.gap - radius;
    if (gap > std::max(closing, 0.0F) * settings_.step_s + kNearby * radius) continue;
    if (!touches && bodies_[body].touched == 0) bodies_[body].surface_radius_m = radius;
    touches = true;
    const uint32_t other = contact.body | kSurface;
    if (collides(closing, gap, radius)) {
      batch.impacts.push_back({p, 0, body, other, contact.normal, contact.velocity, gap, method});
    }
    // Row 0 does not move.
    const auto row = contact.velocity.isZero() ? 0 : static_cast<uint32_t>(batch.fixed.size());
    if (row > 0) batch.fixed.push_back({.velocity = contact.velocity});
    add_contact(
        {.a = p,
         .b = row | ContactGroups::kFixed,
         .normal = contact.normal,
         .gap = gap,
         .arm_a = radius,
         .arm_b = 0,
         .friction = root_friction(body, kinds_[kind_[p]]) * kind(contact.body).root_friction,
         .rolling_m = object.rolling * radius,
         .lift = kinds_[kind_[p]].lift,
         .impulse = former_impulse(kept_of_[p], other, contact.normal)},
        other, contact.level, used, batch);
  }
  bodies_[body].touched = touches ? 1 : 0;
}

void SphereWorld::add_contact(const SphereContact& contact, uint32_t other, bool level,
                              std::vector<uint64_t>& used, Batch& batch) {
  uint32_t& last = last_touch_[contact.a];
  batch.touches.push_back({.a = contact.a,
                           .b = contact.b,
                           .other = other,
                           .slot = batch.contacts.add(contact, used),
                           .next = last,
                           .level = level});
  last = static_cast<uint32_t>(batch.touches.size() - 1);
}

// What the contact with `other` did in the step before, of those of the body that kept it.
ContactImpulse SphereWorld::former_impulse(uint32_t kept, uint32_t other,
                                           const Vec3f& normal) const {
  for (; kept != kNone; kept = former_[kept].next) {
    const KeptImpulse& former = former_[kept];
    if (former.other != other) continue;
    if ((other & kSurface) != 0 && former.normal.dot(normal) < kSameContact) continue;
    return former.impulse;
  }
  return {};
}

}  // namespace pilesim

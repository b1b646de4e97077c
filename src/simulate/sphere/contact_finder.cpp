#include "simulate/sphere/contact_finder.h"

#include <hwy/highway.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

namespace pilesim {
namespace {

using namespace sphere_constants;

namespace hn = hwy::HWY_NAMESPACE;
using Lanes = hn::FixedTag<float, kLanes>;

constexpr uint32_t kNone = KeptImpulse::kLast;

// A hull that is farther from a surface than this share of its reach, in bounding radii, is tested
// in a later step, however the surface moves. Only affects speed.
constexpr float kSurelyNear = 0.75F;

// Calls visit(q) for the members of the range within reach of the sphere.
template <class Visit>
void for_each_near(const Vec3f& centre, float reach_m, const SphereReaches& others,
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

}  // namespace

void ContactFinder::find_of_block(uint32_t block) {
  const SphereGrid& grid = step_.levels.front().grid;
  const SphereReaches& middles = step_.middle;
  grid.for_each_place(block, [&](uint32_t p, std::span<const SphereGrid::Range> ranges) {
    const Vec3f middle = middles.centre(p);
    for (const SphereGrid::Range& range : ranges) {
      for_each_near(middle, middles.reach[p], middles, range, [&](uint32_t q) { touch(p, q); });
    }
    touch_sleepers(p);
  });
  find_surface_contacts(grid.places(block));
}

void ContactFinder::touch_sleepers(uint32_t p) {
  if (sleepers_.bodies.empty() || step_.motion[p].inverse_mass == 0) return;
  const Vec3f middle = step_.middle.centre(p);
  // Reaches are relative to the mean motion, against which sleepers move.
  const float reach =
      step_.middle.reach[p] + 0.5F * model_.settings.step_s * step_.mean_velocity.norm();
  const Vec3f around = Vec3f::Constant(reach + sleepers_.grid.widest_m());
  sleepers_.grid.for_each_range_in(
      middle - around, middle + around, [&](const SphereGrid::Range& range) {
        for_each_near(middle, reach, sleepers_.reaches, range, [&](uint32_t q) {
          const uint32_t body = sleepers_.bodies[q];
          if (!input_.bodies[body].still) return;
          touch(p,
                {body, ContactGroups::kFixed, input_.bodies[body].position, Vec3f::Zero(),
                 model_.kind(body), input_.radius_m[body], kNone,
                 model_.ellipsoid(body, input_.bodies[body].orientation, input_.radius_m[body])});
        });
      });
}

// Tests large or fast bodies against each other and all smaller ones.
void ContactFinder::find_of_coarse_levels() {
  for (size_t level = 1; level < step_.levels.size(); ++level) {
    const SphereStep::Level& here = step_.levels[level];
    for (size_t colour = 0; colour < SphereGrid::kColours; ++colour) {
      for (const uint32_t block : here.grid.blocks(colour)) {
        here.grid.for_each_pair(block, [&](uint32_t p, uint32_t q) {
          touch_if_near(here.offset + p, here.offset + q);
        });
      }
    }
    const auto end = here.offset + static_cast<uint32_t>(here.grid.small_count());
    for (uint32_t p = here.offset; p < end; ++p) {
      const Vec3f middle = step_.middle.centre(p);
      for (size_t finer = 0; finer < level; ++finer) {
        const SphereStep::Level& there = step_.levels[finer];
        const Vec3f around = Vec3f::Constant(step_.middle.reach[p] + there.grid.widest_m());
        there.grid.for_each_in(middle - around, middle + around,
                               [&](uint32_t q) { touch_if_near(p, there.offset + q); });
      }
      touch_sleepers(p);
    }
    find_surface_contacts({here.offset, end});
  }
}

void ContactFinder::touch_if_near(uint32_t p, uint32_t q) {
  const float reach = step_.middle.reach[p] + step_.middle.reach[q];
  if ((step_.middle.centre(p) - step_.middle.centre(q)).squaredNorm() <= reach * reach) {
    touch(p, q);
  }
}

inline void ContactFinder::touch(uint32_t p, uint32_t q) {
  if (step_.motion[p].inverse_mass == 0 && step_.motion[q].inverse_mass == 0) return;
  touch(p, {step_.body[q], q, step_.centre[q], step_.motion[q].velocity,
            model_.kinds[step_.kind[q]], step_.radius_m[q], step_.kept_of[q], step_.ellipsoid[q]});
}

void ContactFinder::touch(uint32_t p, const Partner& partner) {
  if (lie_on_faces(p, partner)) return touch_by_faces(p, partner);
  const SphereKind& kind = model_.kinds[step_.kind[p]];
  const Vec3f& velocity = step_.motion[p].velocity;
  const float radius = step_.radius_m[p];
  const Vec3f apart = step_.centre[p] - partner.centre;
  const float small = std::min(radius, partner.radius_m);
  const Vec3f nearing = partner.velocity - velocity;
  const float dt = model_.settings.step_s;
  const std::optional<EllipsoidContact> contact = contact_of(
      step_.ellipsoid[p], partner.ellipsoid, apart, dt * nearing.norm() + kNearby * small);
  if (!contact) return;
  const Vec3f& normal = contact->normal;
  const float gap = contact->gap, closing = nearing.dot(normal);
  const uint32_t body = step_.body[p], other = partner.body;
  note_left(p, partner, normal);
  if (gap > std::max(closing, 0.0F) * dt + kNearby * small) return;
  const PairMethod method = model_.method(body, other);
  if (!by_spheres(method)) return;
  if (collides(closing, gap, radius)) {
    note_impact(p, partner, {p, partner.row, body, other, normal, Vec3f::Zero(), gap, method},
                closing);
  }
  add_contact({.a = p,
               .b = partner.row,
               .normal = normal,
               .gap = gap,
               .arm_a = contact->arm_a,
               .arm_b = contact->arm_b,
               .friction = friction(body, kind) * friction(other, partner.kind),
               .rolling_m = std::min(contact->flatness_a * kind.rolling_m,
                                     contact->flatness_b * partner.kind.rolling_m),
               .lift = kind.lift,
               .impulse = former_impulse(p, partner, normal)},
              other, SurfaceFace::none);
}

bool ContactFinder::lie_on_faces(uint32_t p, const Partner& partner) const {
  if (!model_.has_structures) return false;
  const uint32_t body = step_.body[p];
  return input_.bodies[body].block && input_.bodies[partner.body].block &&
         model_.method(body, partner.body) == PairMethod::statistical;
}

// Colliding faces are stopped like resting ones: this keeps walls together.
void ContactFinder::touch_by_faces(uint32_t p, const Partner& partner) {
  const SphereKind& kind = model_.kinds[step_.kind[p]];
  const uint32_t body = step_.body[p], other = partner.body;
  const Vec3f& velocity = step_.motion[p].velocity;
  const Vec3f& centre = step_.centre[p];
  const float small = std::min(step_.radius_m[p], partner.radius_m);
  const float speed = (velocity - partner.velocity).norm();
  const float reach = speed * model_.settings.step_s + kNearby * small;
  if (!placed_ || placed_of_ != body) {
    placed_.emplace(block(body));
    placed_of_ = body;
  }
  const std::optional<FacePatch> patch = patch_between(*placed_, block(other), reach);
  if (!patch) return;
  const Vec3f& normal = patch->normal;
  note_left(p, partner, normal);
  const Vec3f lever_a = patch->middle - centre, lever_b = patch->middle - partner.centre;
  const Vec3f spin_a = input_.bodies[step_.body[p]].spin, spin_b = input_.bodies[other].spin;
  const float closing =
      (partner.velocity + spin_b.cross(lever_b) - velocity - spin_a.cross(lever_a)).dot(normal);
  if (patch->gap_m > std::max(closing, 0.0F) * model_.settings.step_s + kNearby * small) return;
  if (collides(closing, patch->gap_m, small)) {
    for (const uint32_t b : {body, other}) {
      const SphereBody& hit = input_.bodies[b];
      if (!hit.asleep || hit.put_to_sleep) continue;
      batch_.hit.push_back({b, closing * model_.kind(b).mass_kg});
    }
  }
  add_patch({.a = p,
             .b = partner.row,
             .lever_a = lever_a,
             .lever_b = lever_b,
             .patch = *patch,
             .friction = surface_friction(body, kind) * surface_friction(other, partner.kind),
             .lift = kind.lift,
             .slop_m = kFaceSlop * small,
             .impulse = former_impulse(p, partner, normal)},
            other, SurfaceFace::none);
}

// Records a sleeper of the pair whose support moves away. `normal`: towards the body at p.
void ContactFinder::note_left(uint32_t p, const Partner& partner, const Vec3f& normal) {
  const uint32_t body = step_.body[p], other = partner.body;
  const Vec3f& velocity = step_.motion[p].velocity;
  if (leaves_behind(model_, input_.bodies, body, velocity, other, -normal)) {
    batch_.left.push_back(other);
  }
  if (leaves_behind(model_, input_.bodies, other, partner.velocity, body, normal)) {
    batch_.left.push_back(body);
  }
}

// A body that was put to sleep acts as a surface.
void ContactFinder::note_impact(uint32_t p, const Partner& partner, const SphereImpact& impact,
                                float closing) {
  const uint32_t body = impact.body_a, other = impact.other;
  if (input_.bodies[other].put_to_sleep) {
    batch_.impacts.push_back(
        {p, 0, body, other | kSurface, impact.normal, Vec3f::Zero(), impact.gap, impact.method});
  } else if (input_.bodies[body].put_to_sleep) {
    batch_.impacts.push_back({partner.row, 0, other, body | kSurface, -impact.normal, Vec3f::Zero(),
                              impact.gap, impact.method});
  } else {
    batch_.impacts.push_back(impact);
    for (const uint32_t b : {body, other}) {
      if (input_.bodies[b].asleep) batch_.hit.push_back({b, closing * model_.kind(b).mass_kg});
    }
  }
}

void ContactFinder::find_surface_contacts(SphereGrid::Range places) {
  const auto reach_of = [&](uint32_t p) {
    return model_.kinds[step_.kind[p]].outer_m * (1 + kNearby) +
           step_.motion[p].velocity.norm() * model_.settings.step_s;
  };
  Eigen::AlignedBox3f box;
  float widest = 0;
  for (uint32_t p = places.begin; p < places.end; ++p) {
    if (step_.motion[p].inverse_mass == 0) continue;
    box.extend(step_.centre[p]);
    widest = std::max(widest, reach_of(p));
  }
  if (box.isEmpty()) return;
  thread_local std::vector<uint32_t> near;
  surfaces_.select(box, widest, near);
  if (near.empty()) {
    return;
  }
  for (uint32_t p = places.begin; p < places.end; ++p) {
    if (step_.motion[p].inverse_mass > 0) find_surface_contacts(p, reach_of(p), near);
  }
}

void ContactFinder::find_surface_contacts(uint32_t p, float reach, std::span<const uint32_t> near) {
  const uint32_t index = step_.body[p];
  SphereBody& body = input_.bodies[index];
  const SphereKind& kind = model_.kinds[step_.kind[p]];
  const BodySignature& object = *kind.object;
  const Vec3f& velocity = step_.motion[p].velocity;
  thread_local std::vector<SurfaceContact> found;
  found.clear();
  SurfaceProbe probe{
      .centre = step_.centre[p], .farthest_m = reach, .orientation = body.orientation};
  for (const uint32_t surface : near) {
    const uint32_t other = surfaces_.body(surface);
    const bool has_extent = model_.has_extent(index, body, input_.radius_m[index], other);
    probe.hull = has_extent ? &kind.hull : nullptr;
    probe.near_m = has_extent ? reach - kSurelyNear * kind.outer_m : reach;
    probe.radius_m = body.surface_radius_m;
    surfaces_.find(surface, probe, found);
  }
  bool touches = false;
  float least_gap = std::numeric_limits<float>::infinity();
  for (const SurfaceContact& contact : found) {
    const PairMethod method = model_.method(index, contact.body);
    if (!by_spheres(method)) continue;
    const float closing = (contact.velocity - velocity).dot(contact.normal);
    const uint32_t other = contact.body | kSurface;
    if (contact.normal.dot(model_.up) > kWall && contact.gap < least_gap) {
      least_gap = contact.gap;
      step_.ground_velocity[p] = contact.velocity;
    }
    // A belt runs, but its faces stay where they are.
    const bool stands =
        contact.velocity.isZero() || model_.model.bodies[contact.body].role == Role::fixed;
    const SurfaceFace face = !contact.face ? SurfaceFace::none
                             : stands      ? SurfaceFace::still
                                           : SurfaceFace::moving;
    // Row 0 does not move.
    const auto row_of_surface = [&] {
      const auto row = contact.velocity.isZero() ? 0 : static_cast<uint32_t>(batch_.fixed.size());
      if (row > 0) batch_.fixed.push_back({.velocity = contact.velocity});
      return row | ContactGroups::kFixed;
    };
    if (body.block && contact.face && method == PairMethod::statistical) {
      const FacePatch patch =
          patch_on_plane(block(index), step_.centre[p], contact.normal, contact.gap);
      const float speed = velocity.norm() + kind.outer_m * step_.motion[p].spin.norm();
      if (patch.gap_m > speed * model_.settings.step_s + kNearby * body.surface_radius_m) continue;
      touches = true;
      add_patch(
          {.a = p,
           .b = row_of_surface(),
           .lever_a = patch.middle - step_.centre[p],
           .lever_b = Vec3f::Zero(),
           .patch = patch,
           .friction = surface_friction(index, kind) * model_.kind(contact.body).root_friction,
           .lift = kind.lift,
           .slop_m = kFaceSlop * body.surface_radius_m,
           .impulse = former_impulse(step_.kept_of[p], other, contact.normal)},
          other, face);
      continue;
    }
    const bool has_extent = model_.has_extent(index, body, input_.radius_m[index], contact.body);
    const float radius = has_extent ? contact.reach_m : body.surface_radius_m;
    const float gap = contact.gap - radius;
    if (gap > std::max(closing, 0.0F) * model_.settings.step_s + kNearby * radius) continue;
    // A body that leans on a wall still counts as flying.
    if (std::abs(contact.normal.y()) > kWall) {
      if (!touches) body.surface_radius_m = radius;
      touches = true;
    }
    if (collides(closing, gap, radius)) {
      batch_.impacts.push_back({p, 0, index, other, contact.normal, contact.velocity, gap, method});
    }
    add_contact(
        {.a = p,
         .b = row_of_surface(),
         .normal = contact.normal,
         .gap = gap,
         .arm_a = radius,
         .arm_b = 0,
         .friction = surface_friction(index, kind) * model_.kind(contact.body).root_friction,
         .rolling_m = object.rolling * radius,
         .lift = has_extent ? std::min(1.0F, kFirmness * kind.lift) : kind.lift,
         .impulse = former_impulse(step_.kept_of[p], other, contact.normal)},
        other, face);
  }
}

void ContactFinder::add_contact(const SphereContact& contact, uint32_t other, SurfaceFace face) {
  uint32_t& last = step_.last_touch[contact.a];
  batch_.touches.push_back({.a = contact.a,
                            .b = contact.b,
                            .other = other,
                            .slot = batch_.contacts.add(contact, used_),
                            .next = last,
                            .face = face,
                            .patch = false,
                            .parallel = false,
                            .former_ns = contact.impulse.normal});
  last = static_cast<uint32_t>(batch_.touches.size() - 1);
}

void ContactFinder::add_patch(const PatchContact& contact, uint32_t other, SurfaceFace face) {
  uint32_t& last = step_.last_touch[contact.a];
  batch_.touches.push_back({.a = contact.a,
                            .b = contact.b,
                            .other = other,
                            .slot = batch_.patches.add(contact, patches_used_),
                            .next = last,
                            .face = face,
                            .patch = true,
                            .parallel = contact.patch.tilt.norm() < kFaceToFace,
                            .former_ns = contact.impulse.normal});
  last = static_cast<uint32_t>(batch_.touches.size() - 1);
}

// As stored with either of the two bodies.
ContactImpulse ContactFinder::former_impulse(uint32_t p, const Partner& partner,
                                             const Vec3f& normal) const {
  ContactImpulse impulse = former_impulse(step_.kept_of[p], partner.body, normal);
  if (impulse.normal != 0) return impulse;
  impulse = former_impulse(partner.kept, step_.body[p], normal);
  impulse.friction = -impulse.friction;
  impulse.rolling = -impulse.rolling;
  return impulse;
}

// The impulses of the contact with `other` in the previous step, among those stored with the body.
ContactImpulse ContactFinder::former_impulse(uint32_t kept, uint32_t other,
                                             const Vec3f& normal) const {
  for (; kept != kNone; kept = input_.kept[kept].next) {
    const KeptImpulse& former = input_.kept[kept];
    if (former.other != other) continue;
    if ((other & kSurface) != 0 && former.normal.dot(normal) < kSameContact) continue;
    return former.impulse;
  }
  return {};
}

}  // namespace pilesim

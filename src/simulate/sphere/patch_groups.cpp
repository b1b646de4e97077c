#include "simulate/sphere/patch_groups.h"

#include "simulate/sphere/contact_lanes.h"

namespace pilesim {
namespace {

using namespace contact_lanes;

HWY_INLINE void apply(const Vec3v& push, const Vec3v& turn, const Vec3v& lever_a,
                      const Vec3v& lever_b, Motions& a, Motions& b) {
  a.velocity = add_scaled(a.velocity, a.inverse_mass, push);
  b.velocity = sub_scaled(b.velocity, b.inverse_mass, push);
  const Vec3v turn_a = add_scaled(cross(lever_a, push), hn::Set(kTag, 1.0F), turn);
  const Vec3v turn_b = add_scaled(cross(lever_b, push), hn::Set(kTag, 1.0F), turn);
  a.spin = add_scaled(a.spin, a.inverse_inertia, turn_a);
  b.spin = sub_scaled(b.spin, b.inverse_inertia, turn_b);
}

HWY_INLINE Vec3v slip_of(const Motions& a, const Motions& b, const Vec3v& lever_a,
                         const Vec3v& lever_b) {
  const Vec one = hn::Set(kTag, 1.0F);
  const Vec3v of_a = add_scaled(a.velocity, one, cross(a.spin, lever_a));
  const Vec3v of_b = add_scaled(b.velocity, one, cross(b.spin, lever_b));
  return of_a - of_b;
}

// Inverse effective mass of an impulse along `n`.
HWY_INLINE Vec inverse_along(const Vec3v& n, const Vec3v& lever_a, const Vec3v& lever_b,
                             const Motions& a, const Motions& b) {
  const Vec3v turn_a = cross(lever_a, n), turn_b = cross(lever_b, n);
  return hn::MulAdd(
      dot(turn_a, turn_a), a.inverse_inertia,
      hn::MulAdd(dot(turn_b, turn_b), b.inverse_inertia, hn::Add(a.inverse_mass, b.inverse_mass)));
}

HWY_INLINE void prepare(PatchGroup& g, SphereMotion* motions) {
  Motions a = gather(g.a, motions), b = gather(g.b, motions);
  const Vec3v lever_a = load(g.lever_a), lever_b = load(g.lever_b), n = load(g.normal);
  const Vec inverse_mass = hn::Add(a.inverse_mass, b.inverse_mass);
  // The largest in any direction.
  const Vec across = hn::MulAdd(dot(lever_a, lever_a), a.inverse_inertia,
                                hn::MulAdd(dot(lever_b, lever_b), b.inverse_inertia, inverse_mass));
  store(inverse_or_zero(inverse_mass), g.normal_mass);
  store(inverse_or_zero(across), g.tangent_mass);
  store(inverse_or_zero(hn::Add(a.inverse_inertia, b.inverse_inertia)), g.turn_inertia);
  Vec3v friction = load(g.friction_impulse);
  friction = sub_scaled(friction, dot(friction, n), n);
  store(friction, g.friction_impulse);
  apply(add_scaled(friction, load(g.normal_impulse), n), load(g.rolling_impulse), lever_a, lever_b,
        a, b);
  scatter(a, g.a, motions);
  scatter(b, g.b, motions);
}

HWY_INLINE Vec within(Vec value, Vec limit) {
  return hn::Max(hn::Neg(limit), hn::Min(limit, value));
}

HWY_INLINE void solve(Vec inverse_step, PatchGroup& g, SphereMotion* motions) {
  Motions a = gather(g.a, motions), b = gather(g.b, motions);
  const Vec3v lever_a = load(g.lever_a), lever_b = load(g.lever_b), n = load(g.normal);
  const Vec3v along = load(g.along), across = cross(n, along);
  const Vec half_along = load(g.half_along), half_across = load(g.half_across);
  const Vec zero = hn::Zero(kTag), one = hn::Set(kTag, 1.0F);
  const Vec3v rolling_before = load(g.rolling_impulse);
  // Tipping velocity beyond that which closes the faces.
  const auto tipping = [&](const Vec3v& axis, Vec tilt) {
    return hn::NegMulAdd(tilt, inverse_step, dot(a.spin - b.spin, axis));
  };
  const Vec tilt_along = load(g.tilt_along), tilt_across = load(g.tilt_across);
  // The impulse acts at the centre of pressure, which tipping may move to an edge. Without pressure
  // it acts at the corner that approaches most.
  const Vec before = load(g.normal_impulse);
  const auto pressed = hn::Gt(before, zero);
  const Vec inverse_push = hn::Div(one, hn::IfThenElse(pressed, before, one));
  const Vec y =
      within(hn::IfThenElse(pressed, hn::Mul(dot(rolling_before, along), inverse_push),
                            hn::CopySign(half_across, hn::Neg(tipping(along, tilt_along)))),
             half_across);
  const Vec x =
      within(hn::IfThenElse(pressed, hn::Neg(hn::Mul(dot(rolling_before, across), inverse_push)),
                            hn::CopySign(half_along, tipping(across, tilt_across))),
             half_along);
  const Vec3v place = add_scaled(x * along, y, across);
  const Vec3v push_a = add_scaled(lever_a, one, place), push_b = add_scaled(lever_b, one, place);
  const Vec mass = inverse_or_zero(inverse_along(n, push_a, push_b, a, b));
  const Vec closing =
      hn::MulAdd(hn::Max(zero, load(g.gap)), inverse_step, dot(slip_of(a, b, push_a, push_b), n));
  const Vec normal = hn::Max(zero, hn::NegMulAdd(mass, closing, before));
  const Vec3v still{zero, zero, zero};
  apply(hn::Sub(normal, before) * n, still, push_a, push_b, a, b);
  const Vec tipped_along = hn::Mul(y, normal), tipped_across = hn::Neg(hn::Mul(x, normal));
  // Friction, with the velocities after the normal impulse.
  Vec3v slip = slip_of(a, b, lever_a, lever_b);
  slip = sub_scaled(slip, dot(slip, n), n);
  const Vec3v friction_before = load(g.friction_impulse);
  const Vec most = hn::Mul(load(g.friction), normal);
  const Vec3v friction = limited(sub_scaled(friction_before, load(g.tangent_mass), slip), most);
  apply(friction - friction_before, still, lever_a, lever_b, a, b);
  // Tipping, which moves the centre of pressure, and twisting.
  const Vec inertia = load(g.turn_inertia);
  const Vec tip_along = within(hn::NegMulAdd(inertia, tipping(along, tilt_along), tipped_along),
                               hn::Mul(half_across, normal));
  const Vec tip_across = within(hn::NegMulAdd(inertia, tipping(across, tilt_across), tipped_across),
                                hn::Mul(half_along, normal));
  const Vec twisted = dot(rolling_before, n);
  const Vec twist = within(hn::NegMulAdd(inertia, dot(a.spin - b.spin, n), twisted),
                           hn::Mul(load(g.twist_m), most));
  const Vec3v turn =
      add_scaled(add_scaled(hn::Sub(twist, twisted) * n, hn::Sub(tip_along, tipped_along), along),
                 hn::Sub(tip_across, tipped_across), across);
  a.spin = add_scaled(a.spin, a.inverse_inertia, turn);
  b.spin = sub_scaled(b.spin, b.inverse_inertia, turn);
  store(normal, g.normal_impulse);
  store(friction, g.friction_impulse);
  store(add_scaled(add_scaled(twist * n, tip_along, along), tip_across, across), g.rolling_impulse);
  scatter(a, g.a, motions);
  scatter(b, g.b, motions);
}

}  // namespace

uint32_t PatchGroups::add(const PatchContact& contact, std::vector<uint64_t>& used) {
  const uint32_t slot = take(contact.a, contact.b, used);
  const size_t lane = slot % kLanes;
  PatchGroup& g = of(slot);
  const FacePatch& patch = contact.patch;
  const Vec3f across = patch.normal.cross(patch.along);
  set(g.normal, lane, patch.normal);
  set(g.lever_a, lane, contact.lever_a);
  set(g.lever_b, lane, contact.lever_b);
  set(g.along, lane, patch.along);
  g.gap[lane] = patch.gap_m;
  g.arm_a[lane] = contact.slop_m;
  g.half_along[lane] = patch.half_along_m;
  g.half_across[lane] = patch.half_across_m;
  g.tilt_along[lane] = patch.tilt.dot(patch.along);
  g.tilt_across[lane] = patch.tilt.dot(across);
  g.twist_m[lane] = patch.twist_m;
  g.friction[lane] = contact.friction;
  g.lift[lane] = contact.lift;
  g.normal_impulse[lane] = contact.impulse.normal;
  set(g.friction_impulse, lane, contact.impulse.friction);
  set(g.rolling_impulse, lane, contact.impulse.rolling);
  return slot;
}

void prepare(std::span<PatchGroup> groups, std::span<SphereMotion> motions) {
  for (PatchGroup& group : groups) prepare(group, motions.data());
}

void solve(float inverse_step, std::span<PatchGroup> groups, std::span<SphereMotion> motions) {
  const Vec inverse = hn::Set(kTag, inverse_step);
  for (PatchGroup& group : groups) solve(inverse, group, motions.data());
}

void separate(std::span<const PatchGroup> groups, std::span<SphereShift> shifts) {
  const Vec all = hn::Set(kTag, 1.0F);
  for (const PatchGroup& group : groups) {
    contact_lanes::separate(all, load(group.normal_mass), group, shifts.data());
  }
}

}  // namespace pilesim

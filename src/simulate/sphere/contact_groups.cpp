#include "simulate/sphere/contact_groups.h"

#include "simulate/sphere/contact_lanes.h"

namespace pilesim {
namespace {

using namespace contact_lanes;

// `arm` n x push is the torque.
HWY_INLINE void apply(const Vec3v& push, const Vec3v& lever, const Vec3v& turn, Vec arm_a,
                      Vec arm_b, Motions& a, Motions& b) {
  a.velocity = add_scaled(a.velocity, a.inverse_mass, push);
  a.spin = add_scaled(a.spin, a.inverse_inertia, sub_scaled(turn, arm_a, lever));
  b.velocity = sub_scaled(b.velocity, b.inverse_mass, push);
  b.spin = sub_scaled(b.spin, b.inverse_inertia, add_scaled(turn, arm_b, lever));
}

HWY_INLINE void prepare(ContactGroup& g, SphereMotion* motions) {
  Motions a = gather(g.a, motions), b = gather(g.b, motions);
  const Vec arm_a = load(g.arm_a), arm_b = load(g.arm_b);
  const Vec inverse_mass = hn::Add(a.inverse_mass, b.inverse_mass);
  const Vec across = hn::MulAdd(hn::Mul(arm_a, arm_a), a.inverse_inertia,
                                hn::MulAdd(hn::Mul(arm_b, arm_b), b.inverse_inertia, inverse_mass));
  store(inverse_or_zero(inverse_mass), g.normal_mass);
  store(inverse_or_zero(across), g.tangent_mass);
  store(inverse_or_zero(hn::Add(a.inverse_inertia, b.inverse_inertia)), g.turn_inertia);
  const Vec3v n = load(g.normal);
  Vec3v friction = load(g.friction_impulse);
  friction = sub_scaled(friction, dot(friction, n), n);
  store(friction, g.friction_impulse);
  apply(add_scaled(friction, load(g.normal_impulse), n), cross(n, friction),
        load(g.rolling_impulse), arm_a, arm_b, a, b);
  scatter(a, g.a, motions);
  scatter(b, g.b, motions);
}

HWY_INLINE void solve(Vec inverse_step, ContactGroup& g, SphereMotion* motions) {
  Motions a = gather(g.a, motions), b = gather(g.b, motions);
  const Vec3v n = load(g.normal);
  const Vec arm_a = load(g.arm_a), arm_b = load(g.arm_b);
  Vec3v slip = a.velocity - b.velocity;
  const Vec approach = dot(slip, n);
  const Vec before = load(g.normal_impulse);
  const Vec zero = hn::Zero(kTag);
  const Vec closing = hn::MulAdd(hn::Max(zero, load(g.gap)), inverse_step, approach);
  const Vec normal = hn::Max(zero, hn::NegMulAdd(load(g.normal_mass), closing, before));
  slip = sub_scaled(slip, approach, n);
  slip = slip - cross(add_scaled(arm_a * a.spin, arm_b, b.spin), n);
  const Vec3v friction_before = load(g.friction_impulse);
  const Vec3v friction = limited(sub_scaled(friction_before, load(g.tangent_mass), slip),
                                 hn::Mul(load(g.friction), normal));
  const Vec3v rolling_before = load(g.rolling_impulse);
  const Vec3v rolling = limited(sub_scaled(rolling_before, load(g.turn_inertia), a.spin - b.spin),
                                hn::Mul(load(g.rolling_m), normal));
  const Vec3v rub = friction - friction_before;
  apply(add_scaled(rub, hn::Sub(normal, before), n), cross(n, rub), rolling - rolling_before, arm_a,
        arm_b, a, b);
  store(normal, g.normal_impulse);
  store(friction, g.friction_impulse);
  store(rolling, g.rolling_impulse);
  scatter(a, g.a, motions);
  scatter(b, g.b, motions);
}

}  // namespace

Vec3f ContactGroup::normal_of(size_t lane) const { return get(normal, lane); }

ContactImpulse ContactGroup::impulse(size_t lane) const {
  return {normal_impulse[lane], get(friction_impulse, lane), get(rolling_impulse, lane)};
}

uint32_t ContactGroups::add(const SphereContact& contact, std::vector<uint64_t>& used) {
  const uint32_t slot = take(contact.a, contact.b, used);
  const size_t lane = slot % kLanes;
  ContactGroup& g = of(slot);
  set(g.normal, lane, contact.normal);
  g.gap[lane] = contact.gap;
  g.arm_a[lane] = contact.arm_a;
  g.arm_b[lane] = contact.arm_b;
  g.friction[lane] = contact.friction;
  g.rolling_m[lane] = contact.rolling_m;
  g.lift[lane] = contact.lift;
  g.normal_impulse[lane] = contact.impulse.normal;
  set(g.friction_impulse, lane, contact.impulse.friction);
  set(g.rolling_impulse, lane, contact.impulse.rolling);
  return slot;
}

void prepare(std::span<ContactGroup> groups, std::span<SphereMotion> motions) {
  for (ContactGroup& group : groups) prepare(group, motions.data());
}

void solve(float inverse_step, std::span<ContactGroup> groups, std::span<SphereMotion> motions) {
  const Vec inverse = hn::Set(kTag, inverse_step);
  for (ContactGroup& group : groups) solve(inverse, group, motions.data());
}

void separate(float slop, std::span<const ContactGroup> groups, std::span<SphereShift> shifts) {
  const Vec part = hn::Set(kTag, slop);
  for (const ContactGroup& group : groups)
    contact_lanes::separate(part, load(group.normal_mass), group, shifts.data());
}

}  // namespace pilesim

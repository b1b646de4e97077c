#include "simulate/sphere/contact_groups.h"

#include <hwy/highway.h>

#include <algorithm>
#include <bit>

namespace pilesim {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

// Eight floats on every machine: the groups, and with them the results, do not depend on it.
using Lanes = hn::FixedTag<float, kLanes>;
using Vec = hn::Vec<Lanes>;
constexpr Lanes kTag;

struct Vec3v {
  Vec x, y, z;
};
HWY_INLINE Vec3v operator-(const Vec3v& a, const Vec3v& b) {
  return {hn::Sub(a.x, b.x), hn::Sub(a.y, b.y), hn::Sub(a.z, b.z)};
}
HWY_INLINE Vec3v operator*(Vec s, const Vec3v& a) {
  return {hn::Mul(s, a.x), hn::Mul(s, a.y), hn::Mul(s, a.z)};
}
// a + s b, a - s b
HWY_INLINE Vec3v add_scaled(const Vec3v& a, Vec s, const Vec3v& b) {
  return {hn::MulAdd(s, b.x, a.x), hn::MulAdd(s, b.y, a.y), hn::MulAdd(s, b.z, a.z)};
}
HWY_INLINE Vec3v sub_scaled(const Vec3v& a, Vec s, const Vec3v& b) {
  return {hn::NegMulAdd(s, b.x, a.x), hn::NegMulAdd(s, b.y, a.y), hn::NegMulAdd(s, b.z, a.z)};
}
HWY_INLINE Vec dot(const Vec3v& a, const Vec3v& b) {
  return hn::MulAdd(a.x, b.x, hn::MulAdd(a.y, b.y, hn::Mul(a.z, b.z)));
}
HWY_INLINE Vec3v cross(const Vec3v& a, const Vec3v& b) {
  return {hn::MulSub(a.y, b.z, hn::Mul(a.z, b.y)), hn::MulSub(a.z, b.x, hn::Mul(a.x, b.z)),
          hn::MulSub(a.x, b.y, hn::Mul(a.y, b.x))};
}
// v shortened to `limit`.
HWY_INLINE Vec3v limited(const Vec3v& v, Vec limit) {
  const Vec size2 = dot(v, v);
  const auto longer = hn::Gt(size2, hn::Mul(limit, limit));
  const Vec one = hn::Set(kTag, 1.0F);
  const Vec scale = hn::Div(limit, hn::Sqrt(hn::IfThenElse(longer, size2, one)));
  return hn::IfThenElse(longer, scale, one) * v;
}

HWY_INLINE Vec load(const ContactGroup::Row& row) { return hn::Load(kTag, row.data()); }
HWY_INLINE Vec3v load(const ContactGroup::Rows& rows) {
  return {load(rows[0]), load(rows[1]), load(rows[2])};
}
HWY_INLINE void store(Vec v, ContactGroup::Row& row) { hn::Store(v, kTag, row.data()); }
HWY_INLINE void store(const Vec3v& v, ContactGroup::Rows& rows) {
  store(v.x, rows[0]);
  store(v.y, rows[1]);
  store(v.z, rows[2]);
}

// Four rows to columns, in each half of the registers.
HWY_INLINE void transpose_halves(Vec* r) {
  const hn::Repartition<double, Lanes> pairs;
  const auto low = [&](Vec a, Vec b) {
    return hn::BitCast(kTag,
                       hn::InterleaveLower(pairs, hn::BitCast(pairs, a), hn::BitCast(pairs, b)));
  };
  const auto high = [&](Vec a, Vec b) {
    return hn::BitCast(kTag,
                       hn::InterleaveUpper(pairs, hn::BitCast(pairs, a), hn::BitCast(pairs, b)));
  };
  const Vec low01 = hn::InterleaveLower(kTag, r[0], r[1]);
  const Vec high01 = hn::InterleaveUpper(kTag, r[0], r[1]);
  const Vec low23 = hn::InterleaveLower(kTag, r[2], r[3]);
  const Vec high23 = hn::InterleaveUpper(kTag, r[2], r[3]);
  r[0] = low(low01, low23);
  r[1] = high(low01, low23);
  r[2] = low(high01, high23);
  r[3] = high(high01, high23);
}

// Eight rows to columns.
HWY_INLINE void transpose(std::array<Vec, 8>& r) {
  transpose_halves(r.data());
  transpose_halves(r.data() + 4);
  for (size_t i = 0; i < 4; ++i) {
    const Vec left = r[i], right = r[i + 4];
    r[i] = hn::ConcatLowerLower(kTag, right, left);
    r[i + 4] = hn::ConcatUpperUpper(kTag, right, left);
  }
}

struct Motions {
  Vec3v velocity;
  Vec inverse_mass;
  Vec3v spin;
  Vec inverse_inertia;
};

static_assert(sizeof(SphereMotion) == kLanes * sizeof(float));

HWY_INLINE Motions gather(const std::array<uint32_t, kLanes>& places, const SphereMotion* motions) {
  std::array<Vec, 8> rows;
  for (size_t i = 0; i < kLanes; ++i) {
    rows[i] = hn::Load(kTag, reinterpret_cast<const float*>(motions + places[i]));
  }
  transpose(rows);
  return {{rows[0], rows[1], rows[2]}, rows[3], {rows[4], rows[5], rows[6]}, rows[7]};
}

HWY_INLINE void scatter(const Motions& m, const std::array<uint32_t, kLanes>& places,
                        SphereMotion* motions) {
  std::array<Vec, 8> rows = {m.velocity.x, m.velocity.y, m.velocity.z, m.inverse_mass,
                             m.spin.x,     m.spin.y,     m.spin.z,     m.inverse_inertia};
  transpose(rows);
  for (size_t i = 0; i < kLanes; ++i) {
    hn::Store(rows[i], kTag, reinterpret_cast<float*>(motions + places[i]));
  }
}

// `arm` n x push is what the push turns.
HWY_INLINE void apply(const Vec3v& push, const Vec3v& lever, const Vec3v& turn, Vec arm_a,
                      Vec arm_b, Motions& a, Motions& b) {
  a.velocity = add_scaled(a.velocity, a.inverse_mass, push);
  a.spin = add_scaled(a.spin, a.inverse_inertia, sub_scaled(turn, arm_a, lever));
  b.velocity = sub_scaled(b.velocity, b.inverse_mass, push);
  b.spin = sub_scaled(b.spin, b.inverse_inertia, add_scaled(turn, arm_b, lever));
}

HWY_INLINE Vec inverse_or_zero(Vec v) {
  const Vec zero = hn::Zero(kTag), one = hn::Set(kTag, 1.0F);
  const auto positive = hn::Gt(v, zero);
  return hn::IfThenElseZero(positive, hn::Div(one, hn::IfThenElse(positive, v, one)));
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

HWY_INLINE void separate(Vec slop, const ContactGroup& g, SphereShift* shifts) {
  std::array<Vec, 8> rows;
  const auto row_of = [&](uint32_t place) {
    return hn::Load(hn::FixedTag<float, 4>(), reinterpret_cast<const float*>(shifts + place));
  };
  // Four of a and four of b to each half of a register: transposed in halves.
  for (size_t i = 0; i < 4; ++i) {
    rows[i] = hn::Combine(kTag, row_of(g.a[i + 4]), row_of(g.a[i]));
    rows[i + 4] = hn::Combine(kTag, row_of(g.b[i + 4]), row_of(g.b[i]));
  }
  transpose_halves(rows.data());
  transpose_halves(rows.data() + 4);
  Vec3v a{rows[0], rows[1], rows[2]}, b{rows[4], rows[5], rows[6]};
  const Vec3v n = load(g.normal);
  const Vec gap = hn::Add(load(g.gap), dot(n, a - b));
  const Vec depth = hn::Max(hn::Zero(kTag), hn::NegMulAdd(slop, load(g.arm_a), hn::Neg(gap)));
  const Vec push = hn::Mul(hn::Mul(load(g.lift), depth), load(g.normal_mass));
  a = add_scaled(a, hn::Mul(rows[3], push), n);
  b = sub_scaled(b, hn::Mul(rows[7], push), n);
  std::array<Vec, 8> back = {a.x, a.y, a.z, rows[3], b.x, b.y, b.z, rows[7]};
  transpose_halves(back.data());
  transpose_halves(back.data() + 4);
  const auto keep = [&](Vec both, uint32_t low, uint32_t high) {
    const hn::FixedTag<float, 4> half;
    hn::Store(hn::LowerHalf(half, both), half, reinterpret_cast<float*>(shifts + low));
    hn::Store(hn::UpperHalf(half, both), half, reinterpret_cast<float*>(shifts + high));
  };
  for (size_t i = 0; i < 4; ++i) {
    keep(back[i], g.a[i], g.a[i + 4]);
    keep(back[i + 4], g.b[i], g.b[i + 4]);
  }
}

void set(ContactGroup::Rows& rows, size_t lane, const Vec3f& v) {
  rows[0][lane] = v.x();
  rows[1][lane] = v.y();
  rows[2][lane] = v.z();
}
Vec3f get(const ContactGroup::Rows& rows, size_t lane) {
  return {rows[0][lane], rows[1][lane], rows[2][lane]};
}

}  // namespace

Vec3f ContactGroup::normal_of(size_t lane) const { return get(normal, lane); }

ContactImpulse ContactGroup::impulse(size_t lane) const {
  return {normal_impulse[lane], get(friction_impulse, lane), get(rolling_impulse, lane)};
}

void ContactGroups::clear() {
  groups_.clear();
  open_.fill({});
}

uint32_t ContactGroups::add(const SphereContact& contact, std::vector<uint64_t>& used) {
  const bool fixed = (contact.b & kFixed) != 0;
  const uint64_t taken = used[contact.a] | (fixed ? 0 : used[contact.b]);
  const auto colour = static_cast<size_t>(std::countr_one(taken));
  auto group = static_cast<uint32_t>(groups_.size());
  uint32_t lane = 0;
  // Beyond all colours each has a group of its own.
  if (colour < kColours) {
    used[contact.a] |= uint64_t{1} << colour;
    if (!fixed) used[contact.b] |= uint64_t{1} << colour;
    Open& open = open_[colour];
    if (open.lanes % kLanes == 0) open = {group, 0};
    group = open.group;
    lane = open.lanes++;
  }
  if (lane == 0) {
    ContactGroup& fresh = groups_.emplace_back();
    fresh.a.fill(kFixed);
    fresh.b.fill(kFixed);
  }
  ContactGroup& g = groups_[group];
  g.a[lane] = contact.a;
  g.b[lane] = contact.b;
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
  return group * static_cast<uint32_t>(kLanes) + lane;
}

void ContactGroups::clear_marks(std::vector<uint64_t>& used) const {
  for (const ContactGroup& g : groups_) {
    for (const auto* places : {&g.a, &g.b}) {
      for (const uint32_t place : *places) {
        if ((place & kFixed) == 0) used[place] = 0;
      }
    }
  }
}

void ContactGroups::close(uint32_t begin) {
  for (ContactGroup& g : groups_) {
    for (auto* places : {&g.a, &g.b}) {
      for (uint32_t& place : *places) {
        if ((place & kFixed) != 0) place = begin + (place & ~kFixed);
      }
    }
  }
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
  for (const ContactGroup& group : groups) separate(part, group, shifts.data());
}

}  // namespace pilesim

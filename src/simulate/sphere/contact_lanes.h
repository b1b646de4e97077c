// SIMD arithmetic on the eight contacts of a group. Only for files that solve groups.
#pragma once

#include <hwy/highway.h>

#include <array>
#include <cstdint>

#include "simulate/sphere/contact_groups.h"

namespace pilesim::contact_lanes {

namespace hn = hwy::HWY_NAMESPACE;

// Eight floats on every machine, so that groups and results do not depend on it.
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

HWY_INLINE Vec inverse_or_zero(Vec v) {
  const Vec zero = hn::Zero(kTag), one = hn::Set(kTag, 1.0F);
  const auto positive = hn::Gt(v, zero);
  return hn::IfThenElseZero(positive, hn::Div(one, hn::IfThenElse(positive, v, one)));
}

// Separates contacts deeper than `slop` times their arm; `mass`: effective, along the normal.
HWY_INLINE void separate(Vec slop, Vec mass, const ContactGroup& g, SphereShift* shifts) {
  std::array<Vec, 8> rows;
  const auto row_of = [&](uint32_t place) {
    return hn::Load(hn::FixedTag<float, 4>(), reinterpret_cast<const float*>(shifts + place));
  };
  // Four of a and four of b in each half of a register, transposed within halves.
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
  const Vec push = hn::Mul(hn::Mul(load(g.lift), depth), mass);
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

inline void set(ContactGroup::Rows& rows, size_t lane, const Vec3f& v) {
  rows[0][lane] = v.x();
  rows[1][lane] = v.y();
  rows[2][lane] = v.z();
}
inline Vec3f get(const ContactGroup::Rows& rows, size_t lane) {
  return {rows[0][lane], rows[1][lane], rows[2][lane]};
}

}  // namespace pilesim::contact_lanes

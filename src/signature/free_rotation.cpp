#include "signature/free_rotation.h"

#include <hwy/highway.h>

#include <algorithm>

namespace pilesim {
namespace {

namespace hn = hwy::HWY_NAMESPACE;
using Tag = hn::FixedTag<double, kFlightLanes>;
using V = hn::Vec<Tag>;

V load(const Lanes& lanes) { return hn::Load(Tag(), lanes.of.data()); }
void store(V v, Lanes& lanes) { hn::Store(v, Tag(), lanes.of.data()); }

struct V3 {
  V x, y, z;
};
V3 load(const LaneVectors& v) { return {load(v.x), load(v.y), load(v.z)}; }
void store(const V3& v, LaneVectors& lanes) {
  store(v.x, lanes.x);
  store(v.y, lanes.y);
  store(v.z, lanes.z);
}
V3 scaled(const V3& a, V s) { return {hn::Mul(a.x, s), hn::Mul(a.y, s), hn::Mul(a.z, s)}; }

V3 sum(const V3& a, const V3& b) {
  return {hn::Add(a.x, b.x), hn::Add(a.y, b.y), hn::Add(a.z, b.z)};
}
V3 add_scaled(const V3& a, double s, const V3& b) {
  const V v = hn::Set(Tag(), s);
  return {hn::MulAdd(v, b.x, a.x), hn::MulAdd(v, b.y, a.y), hn::MulAdd(v, b.z, a.z)};
}
V3 absolute(const V3& a) { return {hn::Abs(a.x), hn::Abs(a.y), hn::Abs(a.z)}; }
V norm(const V3& a) {
  return hn::Sqrt(hn::MulAdd(a.x, a.x, hn::MulAdd(a.y, a.y, hn::Mul(a.z, a.z))));
}

V3 horner(const std::array<LaneVectors, RotationSeries::kOrder + 1>& coefficients, V s) {
  V3 sum = load(coefficients.back());
  for (size_t k = RotationSeries::kOrder; k-- > 0;) {
    const V3 c = load(coefficients[k]);
    sum = {hn::MulAdd(sum.x, s, c.x), hn::MulAdd(sum.y, s, c.y), hn::MulAdd(sum.z, s, c.z)};
  }
  return sum;
}

// What the term j of a series adds to those of a segment's cubic, and to the bound of the rest.
struct SegmentTerms {
  std::array<std::array<double, RotationSeries::kOrder + 1>, 4> cubic{};
  std::array<double, RotationSeries::kOrder + 1> tail{};
};
constexpr auto kSegmentTerms = [] {
  std::array<SegmentTerms, DirectionSegment::kSegments> all{};
  for (size_t i = 0; i < all.size(); ++i) {
    const double length = DirectionSegment::kLength, begin = static_cast<double>(i) * length;
    for (size_t j = 0; j <= RotationSeries::kOrder; ++j) {
      // (begin + length u)^j
      double binomial = 1;
      for (size_t k = 0; k <= j; ++k) {
        double term = binomial;
        for (size_t p = 0; p < j - k; ++p) term *= begin;
        for (size_t p = 0; p < k; ++p) term *= length;
        if (k < 4) {
          all[i].cubic[k][j] = term;
        } else {
          all[i].tail[j] += term;
        }
        binomial = binomial * static_cast<double>(j - k) / static_cast<double>(k + 1);
      }
    }
  }
  return all;
}();

}  // namespace

// With time counted in steps: d' = d x w, and Euler's w' = euler * (w_y w_z, w_z w_x, w_x w_y).
void expand_rotation(const Vec3& euler, const LaneVectors& direction, const LaneVectors& spin,
                     const Lanes& step_s, RotationSeries& series) {
  const Tag d;
  constexpr size_t kOrder = RotationSeries::kOrder;
  std::array<V3, kOrder + 1> n, w;
  n[0] = load(direction);
  w[0] = scaled(load(spin), load(step_s));
  const V3 e = {hn::Set(d, euler.x()), hn::Set(d, euler.y()), hn::Set(d, euler.z())};
#pragma GCC unroll 16
  for (size_t k = 0; k < kOrder; ++k) {
    // Products with a plus and with a minus apart: shorter chains.
    V3 spins{hn::Zero(d), hn::Zero(d), hn::Zero(d)}, plus = spins, minus = spins;
#pragma GCC unroll 16
    for (size_t j = 0; j <= k; ++j) {
      const V3 &a = w[j], &b = w[k - j], &r = n[j];
      spins = {hn::MulAdd(a.y, b.z, spins.x), hn::MulAdd(a.z, b.x, spins.y),
               hn::MulAdd(a.x, b.y, spins.z)};
      plus = {hn::MulAdd(r.y, b.z, plus.x), hn::MulAdd(r.z, b.x, plus.y),
              hn::MulAdd(r.x, b.y, plus.z)};
      minus = {hn::MulAdd(r.z, b.y, minus.x), hn::MulAdd(r.x, b.z, minus.y),
               hn::MulAdd(r.y, b.x, minus.z)};
    }
    const V part = hn::Set(d, 1.0 / static_cast<double>(k + 1));
    n[k + 1] = scaled(
        {hn::Sub(plus.x, minus.x), hn::Sub(plus.y, minus.y), hn::Sub(plus.z, minus.z)}, part);
    w[k + 1] = {hn::Mul(spins.x, hn::Mul(part, e.x)), hn::Mul(spins.y, hn::Mul(part, e.y)),
                hn::Mul(spins.z, hn::Mul(part, e.z))};
  }
  for (size_t k = 0; k <= kOrder; ++k) {
    store(n[k], series.direction[k]);
    store(w[k], series.turn[k]);
  }
}

void cut_segment(const RotationSeries& series, size_t number, DirectionSegment& segment) {
  const Tag d;
  constexpr size_t kOrder = RotationSeries::kOrder;
  const SegmentTerms& terms = kSegmentTerms[number];
  std::array<V3, 4> c;
  const V3 zero{hn::Zero(d), hn::Zero(d), hn::Zero(d)};
  c.fill(zero);
  V3 tail = zero;
#pragma GCC unroll 16
  for (size_t j = 0; j <= kOrder; ++j) {
    const V3 n = load(series.direction[j]);
#pragma GCC unroll 4
    for (size_t k = 0; k <= std::min<size_t>(j, 3); ++k)
      c[k] = add_scaled(c[k], terms.cubic[k][j], n);
    if (j >= 4) tail = add_scaled(tail, terms.tail[j], absolute(n));
  }
  for (size_t k = 0; k < 4; ++k) store(c[k], segment.direction[k]);
  const V tail_size = norm(tail);
  store(tail_size, segment.tail);
  store(add_scaled(add_scaled(add_scaled(c[0], 0.5, c[1]), 0.25, c[2]), 0.125, c[3]),
        segment.middle);
  // For a cubic q, |q(u) - q(1/2)| <= |q'(1/2)| / 2 + max |q''| / 8.
  const V rate = norm(add_scaled(sum(c[1], c[2]), 0.75, c[3]));
  const V bend = hn::MulAdd(hn::Set(d, 3.0), norm(c[3]), norm(c[2]));
  store(hn::Add(tail_size, hn::MulAdd(rate, hn::Set(d, 0.5), hn::Mul(bend, hn::Set(d, 0.25)))),
        segment.deviation);
}

void evaluate_rotation(const RotationSeries& series, const Lanes& part, const Lanes& step_s,
                       LaneVectors& direction, LaneVectors& spin) {
  const Tag d;
  const V s = load(part), step = load(step_s);
  store(horner(series.direction, s), direction);
  const auto moves = hn::Gt(step, hn::Zero(d));
  const V rate = hn::Div(hn::Set(d, 1.0), step);
  const V3 now = scaled(horner(series.turn, s), rate), before = load(spin);
  store({hn::IfThenElse(moves, now.x, before.x), hn::IfThenElse(moves, now.y, before.y),
         hn::IfThenElse(moves, now.z, before.z)},
        spin);
}

}  // namespace pilesim

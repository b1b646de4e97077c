#include "signature/trial/free_rotation.h"

#include <hwy/highway.h>

#include <algorithm>
#include <array>
#include <cassert>

namespace pilesim {
namespace {

namespace hn = hwy::HWY_NAMESPACE;
using Tag = hn::FixedTag<double, 4>;
using V = hn::Vec<Tag>;

struct V3 {
  V x, y, z;
};

V3 operator+(const V3& a, const V3& b) {
  return {hn::Add(a.x, b.x), hn::Add(a.y, b.y), hn::Add(a.z, b.z)};
}

// a + s b
V3 add_scaled(const V3& a, V s, const V3& b) {
  return {hn::MulAdd(s, b.x, a.x), hn::MulAdd(s, b.y, a.y), hn::MulAdd(s, b.z, a.z)};
}
V3 add_scaled(const V3& a, double s, const V3& b) { return add_scaled(a, hn::Set(Tag(), s), b); }

V3 scaled(double s, const V3& a) {
  const V v = hn::Set(Tag(), s);
  return {hn::Mul(v, a.x), hn::Mul(v, a.y), hn::Mul(v, a.z)};
}

V3 cross(const V3& a, const V3& b) {
  return {hn::NegMulAdd(a.z, b.y, hn::Mul(a.y, b.z)), hn::NegMulAdd(a.x, b.z, hn::Mul(a.z, b.x)),
          hn::NegMulAdd(a.y, b.x, hn::Mul(a.x, b.y))};
}

// Transposes four vectors of four components.
void transpose(V& a, V& b, V& c, V& d) {
  const Tag t;
  const V ab_even = hn::InterleaveLower(t, a, b), ab_odd = hn::InterleaveUpper(t, a, b);
  const V cd_even = hn::InterleaveLower(t, c, d), cd_odd = hn::InterleaveUpper(t, c, d);
  a = hn::ConcatLowerLower(t, cd_even, ab_even);
  b = hn::ConcatLowerLower(t, cd_odd, ab_odd);
  c = hn::ConcatUpperUpper(t, cd_even, ab_even);
  d = hn::ConcatUpperUpper(t, cd_odd, ab_odd);
}

// Four bodies; repetitions are harmless.
using Four = std::array<RotatingBody*, 4>;

V3 load(const Four& bodies, Eigen::Vector4d RotatingBody::*vector) {
  const Tag t;
  const auto row = [&](size_t i) { return hn::Load(t, (bodies[i]->*vector).data()); };
  V x = row(0), y = row(1), z = row(2), padding = row(3);
  transpose(x, y, z, padding);
  return {x, y, z};
}

void store(const V3& v, const Four& bodies, Eigen::Vector4d RotatingBody::*vector) {
  const Tag t;
  V rows[4] = {v.x, v.y, v.z, hn::Zero(t)};
  transpose(rows[0], rows[1], rows[2], rows[3]);
  for (size_t i = 0; i < 4; ++i) hn::Store(rows[i], t, (bodies[i]->*vector).data());
}

constexpr int kHighestOrder = 10;

// moment[i][k]: the integral of s^i t^k over a part of a step, with s from -1/2 to 1/2 over it.
using Moments = std::array<std::array<double, kHighestOrder + 1>, 3>;
constexpr Moments moments_of(double begin, double length) {
  // t = middle + length s; the even powers of s integrate to 1 / ((n + 1) 2^n).
  Moments moments{};
  const double middle = begin + length / 2;
  for (int i = 0; i < 3; ++i) {
    for (int k = 0; k <= kHighestOrder; ++k) {
      double sum = 0, binomial = 1;
      for (int j = 0; j <= k; ++j) {
        const int n = i + j;
        if (n % 2 == 0) {
          double term = binomial * length / (n + 1);
          for (int p = 0; p < n; ++p) term /= 2;
          for (int p = 0; p < j; ++p) term *= length;
          for (int p = 0; p < k - j; ++p) term *= middle;
          sum += term;
        }
        binomial = binomial * (k - j) / (j + 1);
      }
      moments[static_cast<size_t>(i)][static_cast<size_t>(k)] = sum;
    }
  }
  return moments;
}

// The rotation vector of a part of a step in which the spin is the power series `w` (kOrder + 1
// terms): a Magnus series of sixth order from the spin's moments (Blanes, Casas, Ros 2000).
template <int kOrder>
V3 rotation_vector(const V3* w, const Moments& moments) {
  std::array<V3, 3> a;
  for (size_t i = 0; i < 3; ++i) {
    a[i] = scaled(-moments[i][0], w[0]);
    for (size_t k = 1; k <= kOrder; ++k) a[i] = add_scaled(a[i], -moments[i][k], w[k]);
  }
  const V3 a1 = add_scaled(scaled(9.0 / 4, a[0]), -15, a[2]);
  const V3 a2 = scaled(12, a[1]);
  const V3 a3 = add_scaled(scaled(-15, a[0]), 180, a[2]);
  const V3 c1 = cross(a1, a2);
  const V3 c2 = scaled(-1.0 / 60, cross(a1, add_scaled(c1, 2, a3)));
  const V3 inner = add_scaled(add_scaled(c1, -20, a1), -1, a3);
  return add_scaled(a[0], 1.0 / 240, cross(inner, a2 + c2));
}

// Turns `a` and `b` by the rotation vector of at most 0.6 rad.
void turn(const V3& rotation, V3& a, V3& b) {
  const Tag d;
  V angle2 = hn::Mul(rotation.x, rotation.x);
  angle2 = hn::MulAdd(rotation.y, rotation.y, angle2);
  angle2 = hn::MulAdd(rotation.z, rotation.z, angle2);
  // sin(x) / x and (1 - cos(x)) / x^2 by their series in x^2.
  constexpr std::array<double, 6> kSine = {1.0,         -1.0 / 6,     1.0 / 120,
                                           -1.0 / 5040, 1.0 / 362880, -1.0 / 39916800};
  constexpr std::array<double, 6> kCosine = {1.0 / 2,      -1.0 / 24,     1.0 / 720,
                                             -1.0 / 40320, 1.0 / 3628800, -1.0 / 479001600};
  V sine = hn::Set(d, kSine[5]), cosine = hn::Set(d, kCosine[5]);
  for (size_t i = 5; i-- > 0;) {
    sine = hn::MulAdd(sine, angle2, hn::Set(d, kSine[i]));
    cosine = hn::MulAdd(cosine, angle2, hn::Set(d, kCosine[i]));
  }
  for (V3* v : {&a, &b}) {
    const V3 once = cross(rotation, *v);
    *v = add_scaled(add_scaled(*v, sine, once), cosine, cross(rotation, once));
  }
}

// Time is in units of the step, so the series are plain sums.
template <int kOrder>
void rotate(const Vec3& euler, const Four& bodies) {
  const Tag d;
  alignas(32) const double steps[4] = {bodies[0]->step_s, bodies[1]->step_s, bodies[2]->step_s,
                                       bodies[3]->step_s};
  const V step = hn::Load(d, steps);
  const V3 before = load(bodies, &RotatingBody::spin);
  V3 w[kOrder + 1];
  w[0] = {hn::Mul(before.x, step), hn::Mul(before.y, step), hn::Mul(before.z, step)};
  V3 change{hn::Zero(d), hn::Zero(d), hn::Zero(d)};
  for (int k = 0; k < kOrder; ++k) {
    V x = hn::Zero(d), y = hn::Zero(d), z = hn::Zero(d);
    for (int j = 0; j <= k; ++j) {
      x = hn::MulAdd(w[j].y, w[k - j].z, x);
      y = hn::MulAdd(w[j].z, w[k - j].x, y);
      z = hn::MulAdd(w[j].x, w[k - j].y, z);
    }
    const double part = 1.0 / (k + 1);
    w[k + 1] = {hn::Mul(x, hn::Set(d, part * euler.x())), hn::Mul(y, hn::Set(d, part * euler.y())),
                hn::Mul(z, hn::Set(d, part * euler.z()))};
    change = change + w[k + 1];
  }
  V3 world_x = load(bodies, &RotatingBody::x_axis), world_y = load(bodies, &RotatingBody::normal);
  // Beyond a quarter of a radian the Magnus series needs two parts.
  if constexpr (kOrder < kHighestOrder) {
    static constexpr Moments kWhole = moments_of(0, 1);
    turn(rotation_vector<kOrder>(w, kWhole), world_x, world_y);
  } else {
    static constexpr Moments kFirst = moments_of(0, 0.5), kSecond = moments_of(0.5, 0.5);
    turn(rotation_vector<kOrder>(w, kFirst), world_x, world_y);
    turn(rotation_vector<kOrder>(w, kSecond), world_x, world_y);
  }
  store(world_x, bodies, &RotatingBody::x_axis);
  store(world_y, bodies, &RotatingBody::normal);
  store(add_scaled(before, hn::Div(hn::Set(d, 1.0), step), change), bodies, &RotatingBody::spin);
}

// Largest rotations, rad, for each number of terms.
constexpr std::array<double, 3> kTurns = {0.01, 0.1, 0.25};

void rotate_by_order(size_t turns, const Vec3& euler, const Four& bodies) {
  switch (turns) {
    case 0:
      return rotate<4>(euler, bodies);
    case 1:
      return rotate<6>(euler, bodies);
    case 2:
      return rotate<8>(euler, bodies);
    default:
      return rotate<kHighestOrder>(euler, bodies);
  }
}

}  // namespace

void rotate_freely(const Vec3& euler, std::span<RotatingBody> bodies) {
  assert(bodies.size() <= kFlightLanes);
  // Bodies with similar rotations are processed together.
  std::array<std::array<RotatingBody*, kFlightLanes>, kTurns.size() + 1> alike;
  std::array<size_t, kTurns.size() + 1> count{};
  for (RotatingBody& body : bodies) {
    const double turn = body.step_s * body.spin.head<3>().norm();
    if (turn == 0) continue;
    size_t turns = 0;
    while (turns < kTurns.size() && turn > kTurns[turns]) ++turns;
    alike[turns][count[turns]++] = &body;
  }
  for (size_t turns = 0; turns < alike.size(); ++turns) {
    for (size_t first = 0; first < count[turns]; first += 4) {
      Four four;
      for (size_t i = 0; i < 4; ++i) four[i] = alike[turns][std::min(first + i, count[turns] - 1)];
      rotate_by_order(turns, euler, four);
    }
  }
}

}  // namespace pilesim

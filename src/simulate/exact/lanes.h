// Registers of 32 bytes: eight floats or four doubles, the same on every machine, so that results
// do not depend on it.
#pragma once

#include <hwy/highway.h>

#include <array>

namespace pilesim::exact {

template <typename T>
struct Lanes {
  using Tag = hwy::HWY_NAMESPACE::FixedTag<T, 32 / sizeof(T)>;
  using Vec = hwy::HWY_NAMESPACE::Vec<Tag>;
  using Mask = hwy::HWY_NAMESPACE::Mask<Tag>;
  static constexpr size_t kCount = 32 / sizeof(T);

  Lanes() = default;
  explicit Lanes(T value) : v(hwy::HWY_NAMESPACE::Set(Tag(), value)) {}
  static Lanes of(Vec v) {
    Lanes lanes;
    lanes.v = v;
    return lanes;
  }
  static Lanes load(const T* from) { return of(hwy::HWY_NAMESPACE::LoadU(Tag(), from)); }
  void store(T* to) const { hwy::HWY_NAMESPACE::StoreU(v, Tag(), to); }

  Vec v;
};

namespace hn = hwy::HWY_NAMESPACE;

template <typename T>
HWY_INLINE Lanes<T> operator+(Lanes<T> a, Lanes<T> b) {
  return Lanes<T>::of(hn::Add(a.v, b.v));
}
template <typename T>
HWY_INLINE Lanes<T> operator-(Lanes<T> a, Lanes<T> b) {
  return Lanes<T>::of(hn::Sub(a.v, b.v));
}
template <typename T>
HWY_INLINE Lanes<T> operator*(Lanes<T> a, Lanes<T> b) {
  return Lanes<T>::of(hn::Mul(a.v, b.v));
}
template <typename T>
HWY_INLINE Lanes<T> operator/(Lanes<T> a, Lanes<T> b) {
  return Lanes<T>::of(hn::Div(a.v, b.v));
}
template <typename T>
HWY_INLINE auto operator>(Lanes<T> a, Lanes<T> b) {
  return hn::Gt(a.v, b.v);
}
template <typename T>
HWY_INLINE Lanes<T> mul_add(Lanes<T> a, Lanes<T> b, Lanes<T> c) {  // a b + c
  return Lanes<T>::of(hn::MulAdd(a.v, b.v, c.v));
}
template <typename T>
HWY_INLINE Lanes<T> neg_mul_add(Lanes<T> a, Lanes<T> b, Lanes<T> c) {  // c - a b
  return Lanes<T>::of(hn::NegMulAdd(a.v, b.v, c.v));
}
template <typename T>
HWY_INLINE Lanes<T> max(Lanes<T> a, Lanes<T> b) {
  return Lanes<T>::of(hn::Max(a.v, b.v));
}
template <typename T>
HWY_INLINE Lanes<T> min(Lanes<T> a, Lanes<T> b) {
  return Lanes<T>::of(hn::Min(a.v, b.v));
}
template <typename T>
HWY_INLINE Lanes<T> sqrt(Lanes<T> a) {
  return Lanes<T>::of(hn::Sqrt(a.v));
}
template <typename T, typename Mask>
HWY_INLINE Lanes<T> select(Mask mask, Lanes<T> yes, Lanes<T> no) {
  return Lanes<T>::of(hn::IfThenElse(mask, yes.v, no.v));
}

template <typename T>
struct Lanes3 {
  Lanes<T> x, y, z;
};
template <typename T>
HWY_INLINE Lanes3<T> operator+(const Lanes3<T>& a, const Lanes3<T>& b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
template <typename T>
HWY_INLINE Lanes3<T> operator-(const Lanes3<T>& a, const Lanes3<T>& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
template <typename T>
HWY_INLINE Lanes3<T> operator*(Lanes<T> s, const Lanes3<T>& a) {
  return {s * a.x, s * a.y, s * a.z};
}
template <typename T>
HWY_INLINE Lanes<T> dot(const Lanes3<T>& a, const Lanes3<T>& b) {
  return mul_add(a.x, b.x, mul_add(a.y, b.y, a.z * b.z));
}
template <typename T>
HWY_INLINE Lanes3<T> cross(const Lanes3<T>& a, const Lanes3<T>& b) {
  return {neg_mul_add(a.z, b.y, a.y * b.z), neg_mul_add(a.x, b.z, a.z * b.x),
          neg_mul_add(a.y, b.x, a.x * b.y)};
}
// a + s b, a - s b
template <typename T>
HWY_INLINE Lanes3<T> add_scaled(const Lanes3<T>& a, Lanes<T> s, const Lanes3<T>& b) {
  return {mul_add(s, b.x, a.x), mul_add(s, b.y, a.y), mul_add(s, b.z, a.z)};
}
template <typename T>
HWY_INLINE Lanes3<T> sub_scaled(const Lanes3<T>& a, Lanes<T> s, const Lanes3<T>& b) {
  return {neg_mul_add(s, b.x, a.x), neg_mul_add(s, b.y, a.y), neg_mul_add(s, b.z, a.z)};
}

template <typename T>
HWY_INLINE Lanes3<T> load3(const std::array<std::array<T, Lanes<T>::kCount>, 3>& rows) {
  return {Lanes<T>::load(rows[0].data()), Lanes<T>::load(rows[1].data()),
          Lanes<T>::load(rows[2].data())};
}
template <typename T>
HWY_INLINE void store3(const Lanes3<T>& v, std::array<std::array<T, Lanes<T>::kCount>, 3>& rows) {
  v.x.store(rows[0].data());
  v.y.store(rows[1].data());
  v.z.store(rows[2].data());
}

// A symmetric matrix by lanes.
template <typename T>
struct Sym {
  Lanes<T> xx, yy, zz, xy, xz, yz;
};
template <typename T>
HWY_INLINE Sym<T> load_sym(const std::array<std::array<T, Lanes<T>::kCount>, 6>& rows) {
  return {Lanes<T>::load(rows[0].data()), Lanes<T>::load(rows[1].data()),
          Lanes<T>::load(rows[2].data()), Lanes<T>::load(rows[3].data()),
          Lanes<T>::load(rows[4].data()), Lanes<T>::load(rows[5].data())};
}
template <typename T>
HWY_INLINE Lanes3<T> operator*(const Sym<T>& m, const Lanes3<T>& v) {
  return {mul_add(m.xx, v.x, mul_add(m.xy, v.y, m.xz * v.z)),
          mul_add(m.xy, v.x, mul_add(m.yy, v.y, m.yz * v.z)),
          mul_add(m.xz, v.x, mul_add(m.yz, v.y, m.zz * v.z))};
}

// Rows of eight values to eight registers, one a value.
HWY_INLINE void transpose(std::array<Lanes<float>, 8>& r) {
  using F = Lanes<float>;
  const F::Tag tag;
  const hn::Repartition<double, F::Tag> pairs;
  const auto low = [&](F a, F b) {
    return F::of(hn::BitCast(
        tag, hn::InterleaveLower(pairs, hn::BitCast(pairs, a.v), hn::BitCast(pairs, b.v))));
  };
  const auto high = [&](F a, F b) {
    return F::of(hn::BitCast(
        tag, hn::InterleaveUpper(pairs, hn::BitCast(pairs, a.v), hn::BitCast(pairs, b.v))));
  };
  for (size_t half = 0; half < 8; half += 4) {
    const F l01 = F::of(hn::InterleaveLower(tag, r[half].v, r[half + 1].v));
    const F h01 = F::of(hn::InterleaveUpper(tag, r[half].v, r[half + 1].v));
    const F l23 = F::of(hn::InterleaveLower(tag, r[half + 2].v, r[half + 3].v));
    const F h23 = F::of(hn::InterleaveUpper(tag, r[half + 2].v, r[half + 3].v));
    r[half] = low(l01, l23);
    r[half + 1] = high(l01, l23);
    r[half + 2] = low(h01, h23);
    r[half + 3] = high(h01, h23);
  }
  for (size_t i = 0; i < 4; ++i) {
    const F left = r[i], right = r[i + 4];
    r[i] = F::of(hn::ConcatLowerLower(tag, right.v, left.v));
    r[i + 4] = F::of(hn::ConcatUpperUpper(tag, right.v, left.v));
  }
}
HWY_INLINE void transpose4(Lanes<double>* r) {
  using D = Lanes<double>;
  const D::Tag tag;
  const D l01 = D::of(hn::InterleaveLower(tag, r[0].v, r[1].v));
  const D h01 = D::of(hn::InterleaveUpper(tag, r[0].v, r[1].v));
  const D l23 = D::of(hn::InterleaveLower(tag, r[2].v, r[3].v));
  const D h23 = D::of(hn::InterleaveUpper(tag, r[2].v, r[3].v));
  r[0] = D::of(hn::ConcatLowerLower(tag, l23.v, l01.v));
  r[1] = D::of(hn::ConcatLowerLower(tag, h23.v, h01.v));
  r[2] = D::of(hn::ConcatUpperUpper(tag, l23.v, l01.v));
  r[3] = D::of(hn::ConcatUpperUpper(tag, h23.v, h01.v));
}

HWY_INLINE void gather8(const float* const* rows, std::array<Lanes<float>, 8>& r) {
  for (size_t i = 0; i < 8; ++i) r[i] = Lanes<float>::load(rows[i]);
  transpose(r);
}
HWY_INLINE void gather8(const double* const* rows, std::array<Lanes<double>, 8>& r) {
  for (size_t i = 0; i < 4; ++i) {
    r[i] = Lanes<double>::load(rows[i]);
    r[i + 4] = Lanes<double>::load(rows[i] + 4);
  }
  transpose4(r.data());
  transpose4(r.data() + 4);
}
HWY_INLINE void scatter8(std::array<Lanes<float>, 8>& r, float* const* rows) {
  transpose(r);
  for (size_t i = 0; i < 8; ++i) {
    if (rows[i] != nullptr) r[i].store(rows[i]);
  }
}
HWY_INLINE void scatter8(std::array<Lanes<double>, 8>& r, double* const* rows) {
  transpose4(r.data());
  transpose4(r.data() + 4);
  for (size_t i = 0; i < 4; ++i) {
    if (rows[i] == nullptr) continue;
    r[i].store(rows[i]);
    r[i + 4].store(rows[i] + 4);
  }
}

}  // namespace pilesim::exact

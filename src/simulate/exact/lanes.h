// Registers of 32 bytes: eight floats or four doubles, the same on every machine, so that results
// do not depend on it.
#pragma once

#include <hwy/highway.h>

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

}  // namespace pilesim::exact

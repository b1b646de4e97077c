// The state of a simulation as bytes, and back, for checkpoints. Numbers are as they lie in memory,
// so bytes are for the program that wrote them (core/checkpoint_file.h sees to that).
//
// A struct of state lists its fields once, for both ways:
//   static void fields(auto& state, auto& stream) { stream(state.position, state.speed); }
// Numbers, enums, fixed Eigen types, strings, vectors, arrays, pairs, optionals and maps of such go
// without, and so does a struct of numbers that has `static constexpr bool kStoredAsItLies = true`.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "core/error.h"
#include "core/types.h"

namespace pilesim {

namespace state_stream {

template <class T>
concept Number = (std::is_arithmetic_v<T> && !std::is_same_v<T, bool>) || std::is_enum_v<T>;

// Numbers one after the other: their bytes are stored.
template <class T>
struct IsNumbers : std::bool_constant<Number<T>> {};
template <class Scalar, int Rows, int Columns, int Options>
struct IsNumbers<Eigen::Matrix<Scalar, Rows, Columns, Options>>
    : std::bool_constant<Rows != Eigen::Dynamic && Columns != Eigen::Dynamic> {};
template <class Scalar>
struct IsNumbers<Eigen::Quaternion<Scalar>> : std::true_type {};
template <class T, size_t N>
struct IsNumbers<std::array<T, N>> : IsNumbers<T> {};
// A struct says so itself: numbers without padding between them.
template <class T>
requires(T::kStoredAsItLies) struct IsNumbers<T> : std::true_type {
};
template <class T>
concept Numbers = IsNumbers<T>::value;

}  // namespace state_stream

class StateWriter {
 public:
  template <class... T>
  void operator()(const T&... values) {
    (put(values), ...);
  }

  std::span<const std::byte> bytes() const { return bytes_; }

 private:
  void append(const void* data, size_t size) {
    // States are large: not for twice as many bytes, as a vector would.
    const size_t needed = bytes_.size() + size;
    if (bytes_.capacity() < needed) bytes_.reserve(needed + needed / 4);
    const auto* first = static_cast<const std::byte*>(data);
    bytes_.insert(bytes_.end(), first, first + size);
  }
  template <class T>
  void put(const T& value) {
    if constexpr (state_stream::Numbers<T>) {
      append(&value, sizeof(T));
    } else {
      T::fields(value, *this);
    }
  }
  void put(const bool& value) { put(static_cast<uint8_t>(value)); }
  void put(const Bounds& box) { (*this)(box.min(), box.max()); }
  void put(const Pose& pose) { (*this)(pose.position, pose.orientation); }
  void put(const std::string& text) {
    put(uint64_t{text.size()});
    append(text.data(), text.size());
  }
  template <class T>
  void put(const std::vector<T>& values) {
    put(uint64_t{values.size()});
    if constexpr (state_stream::Numbers<T>) {
      append(values.data(), values.size() * sizeof(T));
    } else {
      for (const T& value : values) put(value);
    }
  }
  template <class T, size_t N>
  requires(!state_stream::Numbers<T>) void put(const std::array<T, N>& values) {
    for (const T& value : values) put(value);
  }
  template <class A, class B>
  void put(const std::pair<A, B>& value) {
    (*this)(value.first, value.second);
  }
  template <class T>
  void put(const std::optional<T>& value) {
    put(value.has_value());
    if (value) put(*value);
  }
  template <class Key, class T>
  void put(const std::map<Key, T>& values) {
    put(uint64_t{values.size()});
    for (const auto& value : values) put(value);
  }

  std::vector<std::byte> bytes_;
};

// Throws Error(input) where the bytes end too early or are no value of the type. Takes no more
// memory than the bytes are worth. The loader checks further conditions with require(), such as the
// range of an index.
class StateReader {
 public:
  // The bytes must outlive it.
  explicit StateReader(std::span<const std::byte> bytes) : left_(bytes) {}

  template <class... T>
  void operator()(T&... values) {
    (take(values), ...);
  }

  static void require(bool holds, const char* expected) {
    if (!holds) fail(expected);
  }
  // All of `indices` < `end`.
  static void require_below(const std::vector<uint32_t>& indices, size_t end) {
    for (const uint32_t index : indices) require(index < end, "an index in range");
  }
  size_t left() const { return left_.size(); }  // bytes

 private:
  [[noreturn]] static void fail(const char* expected) {
    Problem problem;
    problem.found = "holds a state that cannot be";
    problem.expected = expected;
    throw Error(ErrorKind::input, problem);
  }
  void copy(void* data, size_t size) {
    require(size <= left_.size(), "more bytes");
    if (size > 0) std::memcpy(data, left_.data(), size);
    left_ = left_.subspan(size);
  }
  size_t count(size_t least_bytes_each) {
    uint64_t count = 0;
    take(count);
    require(count <= left_.size() / least_bytes_each, "as many values as there are bytes for");
    return static_cast<size_t>(count);
  }
  template <class T>
  void take(T& value) {
    if constexpr (state_stream::Numbers<T>) {
      copy(static_cast<void*>(&value), sizeof(T));
    } else {
      T::fields(value, *this);
    }
  }
  void take(bool& value) {
    uint8_t byte = 0;
    take(byte);
    require(byte <= 1, "true or false");
    value = byte != 0;
  }
  void take(Bounds& box) { (*this)(box.min(), box.max()); }
  void take(Pose& pose) { (*this)(pose.position, pose.orientation); }
  void take(std::string& text) {
    text.resize(count(1));
    copy(text.data(), text.size());
  }
  template <class T>
  void take(std::vector<T>& values) {
    values.clear();
    if constexpr (state_stream::Numbers<T>) {
      values.resize(count(sizeof(T)));
      copy(static_cast<void*>(values.data()), values.size() * sizeof(T));
    } else {
      for (size_t left = count(1); left > 0; --left) take(values.emplace_back());
    }
  }
  template <class T, size_t N>
  requires(!state_stream::Numbers<T>) void take(std::array<T, N>& values) {
    for (T& value : values) take(value);
  }
  template <class A, class B>
  void take(std::pair<A, B>& value) {
    (*this)(value.first, value.second);
  }
  template <class T>
  void take(std::optional<T>& value) {
    bool has = false;
    take(has);
    value.reset();
    if (has) take(value.emplace());
  }
  template <class Key, class T>
  void take(std::map<Key, T>& values) {
    values.clear();
    for (size_t left = count(1); left > 0; --left) {
      std::pair<Key, T> value;
      take(value);
      values.insert(std::move(value));
    }
  }

  std::span<const std::byte> left_;
};

}  // namespace pilesim

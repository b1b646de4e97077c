// Counter-based random numbers (Philox4x32-10, Salmon et al. 2011). A draw is a pure function of
// (scene seed, stream, object, event), so results never depend on threads or on order. The
// transforms to reals are our own because std::*_distribution differs between libraries.
#pragma once

#include <Random123/philox.h>

#include <array>
#include <cmath>
#include <cstdint>

#include "core/types.h"

namespace pilesim {

// Users of random numbers. A new user takes a new stream; values are part of the file format.
enum class Stream : uint32_t {
  emitter = 1,
  signature = 2,
  response = 3,
  rest = 4,
  bootstrap = 9,
  camera = 10,
  batch = 20,
  picture = 21,
  mould = 22,
  pour = 23,
  nail = 24,
  test = 100
};

class Philox {
 public:
  Philox(uint64_t seed, Stream stream, uint64_t object, uint32_t event = 0)
      : key_{{static_cast<uint32_t>(seed) ^ static_cast<uint32_t>(stream) * 0x9E3779B9u,
              static_cast<uint32_t>(seed >> 32) ^ static_cast<uint32_t>(stream)}},
        counter_{{0, event, static_cast<uint32_t>(object), static_cast<uint32_t>(object >> 32)}} {}

  uint32_t bits() {
    if (used_ == 4) {
      block_ = generator_(counter_, key_);
      ++counter_[0];
      used_ = 0;
    }
    return block_[used_++];
  }

  // Uniform in (0, 1), 53 bits, never 0 or 1.
  double uniform() {
    const uint64_t high = bits();
    const uint64_t low = bits();
    return (static_cast<double>((high << 32 | low) >> 12) + 0.5) * 0x1p-52;
  }
  double uniform(double low, double high) { return low + (high - low) * uniform(); }

  // Uniform integer in [0, count), count > 0 (bias below count / 2^32).
  uint32_t index(uint32_t count) {
    return static_cast<uint32_t>((static_cast<uint64_t>(bits()) * count) >> 32);
  }

  // Standard normal (Box-Muller; one of the pair is used, so that draws stay one-to-one).
  double normal() {
    const double radius = std::sqrt(-2.0 * std::log(uniform()));
    return radius * std::cos(2.0 * kPi * uniform());
  }

  // Uniform on the unit sphere.
  Vec3 direction() {
    const double z = uniform(-1.0, 1.0);
    const double azimuth = 2.0 * kPi * uniform();
    const double r = std::sqrt(1.0 - z * z);
    return {r * std::cos(azimuth), r * std::sin(azimuth), z};
  }

  // Uniform over rotations (Shoemake 1992).
  Quat rotation() {
    const double u = uniform();
    const double a = 2.0 * kPi * uniform();
    const double b = 2.0 * kPi * uniform();
    return {std::sqrt(u) * std::cos(b), std::sqrt(1 - u) * std::sin(a),
            std::sqrt(1 - u) * std::cos(a), std::sqrt(u) * std::sin(b)};
  }

 private:
  r123::Philox4x32 generator_;
  r123::Philox4x32::key_type key_;
  r123::Philox4x32::ctr_type counter_;
  r123::Philox4x32::ctr_type block_{};
  int used_ = 4;
};

}  // namespace pilesim

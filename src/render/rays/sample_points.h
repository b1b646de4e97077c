// Where the samples of a pixel lie in the unit squares that a path draws from: its place in the
// pixel, on the lens, on the sun, and so on. Points of one pixel and square fill it evenly whatever
// their number (Sobol's first two dimensions), those of different pixels and squares have nothing
// to do with each other (nested uniform scrambling, Owen 1995, by hashing as in Burley, "Practical
// Hash-based Owen Scrambling", 2020). Keyed by Philox, so that a sample is the same whoever draws
// it, and whatever was drawn before.
#pragma once

#include <array>
#include <cstdint>

#include "core/philox.h"
#include "core/types.h"

namespace pilesim {

// The draws of a path, a square each. Values are part of the look of pictures.
enum class PathSquare : uint32_t {
  pixel,
  lens,
  moment,  // when; which lobe the first bounce follows
  sun_0,   // from the visible surface
  turn_0,
  sun_1,  // from where the first bounce ends
  turn_1,
  sun_2,
  turn_2,
  sun_3,
  turn_3,
  sun_4,
  turn_4,
  chance,  // of paths that are mirrored by metals or go through clear bodies: see chance_seed()
  count
};
inline constexpr uint32_t kPathSquares = static_cast<uint32_t>(PathSquare::count);

namespace sample_points {

constexpr uint32_t reversed(uint32_t x) {
  x = (x & 0x55555555u) << 1 | (x >> 1 & 0x55555555u);
  x = (x & 0x33333333u) << 2 | (x >> 2 & 0x33333333u);
  x = (x & 0x0F0F0F0Fu) << 4 | (x >> 4 & 0x0F0F0F0Fu);
  x = (x & 0x00FF00FFu) << 8 | (x >> 8 & 0x00FF00FFu);
  return x << 16 | x >> 16;
}

// A permutation of which each bit depends on lower ones only (Laine and Karras 2011, with Burley's
// constants).
constexpr uint32_t permuted(uint32_t x, uint32_t seed) {
  x += seed;
  x ^= x * 0x6C50B47Cu;
  x ^= x * 0xB82F1E52u;
  x ^= x * 0xC7AFE638u;
  x ^= x * 0x8D22F6E6u;
  return x;
}

// Pascal's triangle modulo 2, by which Sobol's second dimension follows from its first.
constexpr uint32_t second_dimension(uint32_t x) {
  x ^= x >> 1 & 0x55555555u;
  x ^= x >> 2 & 0x33333333u;
  x ^= x >> 4 & 0x0F0F0F0Fu;
  x ^= x >> 8 & 0x00FF00FFu;
  return x ^ (x >> 16 & 0x0000FFFFu);
}

// [0, 1), 24 bits.
constexpr float unit(uint32_t x) { return static_cast<float>(x >> 8) * 0x1p-24f; }

}  // namespace sample_points

// Point `sample` of a square whose seed is `seed`, in [0, 1)^2.
inline Eigen::Vector2f sample_point(uint32_t sample, uint32_t seed) {
  using namespace sample_points;
  const uint32_t index = reversed(permuted(reversed(sample), seed));
  const uint32_t second = second_dimension(index);
  return {unit(reversed(permuted(index, seed * 0x9E3779B9u + 0x7F4A7C15u))),
          unit(reversed(permuted(second, seed * 0x85EBCA6Bu + 0xC2B2AE35u)))};
}

// Seed of the k-th of many squares that follow from one (the last steps of MurmurHash3).
constexpr uint32_t chance_seed(uint32_t seed, uint32_t k) {
  uint32_t x = seed + 0x9E3779B9u * k;
  x = (x ^ x >> 16) * 0x85EBCA6Bu;
  x = (x ^ x >> 13) * 0xC2B2AE35u;
  return x ^ x >> 16;
}

using PixelSeeds = std::array<uint32_t, kPathSquares>;

// Seeds of a pixel of a picture of frame `frame`.
inline PixelSeeds pixel_seeds(uint64_t frame, uint32_t column, uint32_t row) {
  Philox random(frame, Stream::picture, uint64_t{row} << 32 | column);
  PixelSeeds seeds;
  for (uint32_t& seed : seeds) seed = random.bits();
  return seeds;
}

}  // namespace pilesim

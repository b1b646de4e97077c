// Content hashes that name caches and pin results (XXH3, 128 bits). Not cryptographic.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

namespace pilesim {

// 32 lower-case hexadecimal digits.
std::string content_hash(std::span<const std::byte> bytes);
std::string content_hash(const std::string& text);

// The same hash as it is stored in files that are checked by it.
using Checksum = std::array<uint8_t, 16>;
Checksum checksum_of(std::span<const std::byte> bytes);

// Feeds several pieces into one hash.
class Hasher {
 public:
  Hasher();
  ~Hasher();
  Hasher(const Hasher&) = delete;
  Hasher& operator=(const Hasher&) = delete;

  void add(std::span<const std::byte> bytes);
  template <typename T>
  void add_values(std::span<const T> values) {
    add(std::as_bytes(values));
  }
  std::string digest() const;
  Checksum checksum() const;

 private:
  void* state_;
};

}  // namespace pilesim

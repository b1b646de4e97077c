#include "geometry/png_chunks.h"

#include <cstddef>
#include <cstdint>

namespace pilesim {
namespace {

constexpr std::string_view kSignature = "\x89PNG\r\n\x1a\n";

uint32_t big_endian(std::string_view bytes, size_t at) {
  uint32_t value = 0;
  for (size_t i = at; i < at + 4; ++i) value = value << 8 | static_cast<uint8_t>(bytes[i]);
  return value;
}

}  // namespace

bool may_be_decoded(std::string_view picture) {
  constexpr size_t kHead = 8, kChecksum = 4;  // of a chunk
  if (!picture.starts_with(kSignature)) return true;
  for (size_t at = kSignature.size(); at + kHead <= picture.size();) {
    const size_t length = big_endian(picture, at);
    if (picture.substr(at + 4, 4) == "IDAT") return length > 0;
    at += kHead + length + kChecksum;
  }
  return false;
}

}  // namespace pilesim

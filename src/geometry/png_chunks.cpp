#include "geometry/png_chunks.h"

#include <zlib.h>

#include <algorithm>
#include <array>
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

// Calls visit(kind, content) for each chunk until it gives false.
template <typename Visit>
void for_each_chunk(std::string_view picture, const Visit& visit) {
  constexpr size_t kHead = 8, kChecksum = 4;
  for (size_t at = kSignature.size(); at + kHead <= picture.size();) {
    const size_t length = big_endian(picture, at);
    if (!visit(picture.substr(at + 4, 4), picture.substr(at + kHead, length))) return;
    at += kHead + length + kChecksum;
  }
}

// Bytes of the pixels and of each row's filter, of seven interlaced passes, too.
uint64_t pixel_bytes(std::string_view header) {
  if (header.size() < 13) return 0;
  const uint64_t width = big_endian(header, 0), height = big_endian(header, 4);
  constexpr uint64_t kMostChannels = 4;
  const auto depth = static_cast<uint64_t>(static_cast<uint8_t>(header[8]));
  const uint64_t row = width * kMostChannels * std::max<uint64_t>(depth, 8) / 8;
  return height * (row + 1) + 7 * (row + height + 1);
}

// Whether a zlib stream in pieces holds more than so many bytes. A broken stream counts up to its
// fault.
class Inflater {
 public:
  explicit Inflater(uint64_t most) : most_(most) { is_sound_ = inflateInit(&stream_) == Z_OK; }
  ~Inflater() { inflateEnd(&stream_); }
  Inflater(const Inflater&) = delete;
  Inflater& operator=(const Inflater&) = delete;

  void add(std::string_view piece) {
    stream_.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(piece.data()));
    stream_.avail_in = static_cast<uInt>(piece.size());
    while (is_sound_ && !holds_more()) {
      stream_.next_out = reinterpret_cast<Bytef*>(buffer_.data());
      stream_.avail_out = static_cast<uInt>(buffer_.size());
      is_sound_ = inflate(&stream_, Z_NO_FLUSH) == Z_OK;
      bytes_ += buffer_.size() - stream_.avail_out;
      if (stream_.avail_out > 0) break;  // it wants more
    }
  }
  bool holds_more() const { return bytes_ > most_; }

 private:
  uint64_t most_, bytes_ = 0;
  z_stream stream_{};
  bool is_sound_ = false;
  std::array<char, 1 << 16> buffer_;
};

}  // namespace

bool may_be_decoded(std::string_view picture) {
  if (!picture.starts_with(kSignature)) return true;
  bool has_data = false;
  for_each_chunk(picture, [&](std::string_view kind, std::string_view content) {
    if (kind == "IDAT") has_data = !content.empty();
    return kind != "IDAT";
  });
  return has_data;
}

std::string png_fault(std::string_view picture) {
  if (!may_be_decoded(picture)) return "has no bytes in its first IDAT chunk";
  if (!picture.starts_with(kSignature)) return {};
  uint64_t most = 0;
  for_each_chunk(picture, [&](std::string_view kind, std::string_view content) {
    if (kind == "IHDR") most = pixel_bytes(content);
    return kind != "IHDR";
  });
  Inflater inflater(most);
  for_each_chunk(picture, [&](std::string_view kind, std::string_view content) {
    if (kind == "IDAT") inflater.add(content);
    return !inflater.holds_more();
  });
  if (!inflater.holds_more()) return {};
  return "holds more compressed data than its pixels, " + std::to_string(most) + " bytes";
}

}  // namespace pilesim

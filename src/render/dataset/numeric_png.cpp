#include "render/dataset/numeric_png.h"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <string>
#include <string_view>

#include "core/atomic_file.h"
#include "core/error.h"

namespace pilesim {
namespace {

// PNG specification (ISO/IEC 15948), section 11.2.2.
constexpr uint8_t kGrey = 0, kColour = 2;
// Filter of section 9.2: each byte less that of the pixel to the left.
constexpr uint8_t kDifferenceFilter = 1;
constexpr int kCompression = 3;

void append_u32(std::string& text, uint32_t value) {
  for (int shift = 24; shift >= 0; shift -= 8) text += static_cast<char>(value >> shift & 0xFF);
}

void append_chunk(std::string& file, std::string_view type, std::string_view data) {
  append_u32(file, static_cast<uint32_t>(data.size()));
  const size_t checked = file.size();
  file += type;
  file += data;
  append_u32(file,
             static_cast<uint32_t>(crc32(0, reinterpret_cast<const Bytef*>(file.data() + checked),
                                         static_cast<uInt>(file.size() - checked))));
}

std::string compressed(const std::string& bytes, const std::filesystem::path& file) {
  uLongf size = compressBound(bytes.size());
  std::string result(size, '\0');
  if (compress2(reinterpret_cast<Bytef*>(result.data()), &size,
                reinterpret_cast<const Bytef*>(bytes.data()), bytes.size(), kCompression) != Z_OK) {
    throw Error(ErrorKind::internal,
                Problem{.file = file.string(), .found = "not enough memory to compress a picture"});
  }
  result.resize(size);
  return result;
}

// `rows`: bytes of all rows in PNG's order, most significant ones first.
void write(const std::filesystem::path& file, int width, int height, int bits,
           const std::string& rows) {
  const size_t row_bytes = rows.size() / static_cast<size_t>(height);
  const size_t pixel_bytes = row_bytes / static_cast<size_t>(width);
  const bool is_colour = pixel_bytes * 8 > static_cast<size_t>(bits);
  std::string filtered(rows.size() + static_cast<size_t>(height), '\0');
  char* out = filtered.data();
  for (size_t row = 0; row < rows.size(); row += row_bytes) {
    const char* in = rows.data() + row;
    *out++ = static_cast<char>(kDifferenceFilter);
    std::copy_n(in, pixel_bytes, out);
    for (size_t i = pixel_bytes; i < row_bytes; ++i) {
      out[i] = static_cast<char>(in[i] - in[i - pixel_bytes]);
    }
    out += row_bytes;
  }
  std::string header;
  append_u32(header, static_cast<uint32_t>(width));
  append_u32(header, static_cast<uint32_t>(height));
  header += static_cast<char>(bits);
  header += static_cast<char>(is_colour ? kColour : kGrey);
  header.append(3, '\0');  // the only compression and filtering there are; not interlaced
  std::string bytes = "\x89PNG\r\n\x1a\n";
  append_chunk(bytes, "IHDR", header);
  append_chunk(bytes, "IDAT", compressed(filtered, file));
  append_chunk(bytes, "IEND", "");
  write_file_atomically(file, bytes);
}

}  // namespace

void write_png8(const std::filesystem::path& file, int width, int height,
                std::span<const uint8_t> values) {
  write(file, width, height, 8, std::string(values.begin(), values.end()));
}

void write_png16(const std::filesystem::path& file, int width, int height,
                 std::span<const uint16_t> values) {
  std::string rows(2 * values.size(), '\0');
  for (size_t i = 0; i < values.size(); ++i) {
    rows[2 * i] = static_cast<char>(values[i] >> 8);
    rows[2 * i + 1] = static_cast<char>(values[i] & 0xFF);
  }
  write(file, width, height, 16, rows);
}

}  // namespace pilesim

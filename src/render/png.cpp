#include <png.h>

#include "core/atomic_file.h"
#include "core/error.h"
#include "render/image_output.h"

namespace pilesim {
namespace {

void append_bytes(png_structp png, png_bytep bytes, size_t count) {
  auto& file = *static_cast<std::string*>(png_get_io_ptr(png));
  file.append(reinterpret_cast<const char*>(bytes), count);
}

void no_flush(png_structp) {}

[[noreturn]] void fail(png_structp, png_const_charp reason) {
  throw Error(ErrorKind::internal, Problem{.found = std::string("libpng: ") + reason});
}

void no_warning(png_structp, png_const_charp) {}

struct PngWriter {
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, fail, no_warning);
  png_infop info = png_create_info_struct(png);
  PngWriter() = default;
  PngWriter(const PngWriter&) = delete;
  PngWriter& operator=(const PngWriter&) = delete;
  ~PngWriter() { png_destroy_write_struct(&png, &info); }
};

}  // namespace

void write_png(const Image& image, const std::filesystem::path& file) {
  std::string bytes;
  PngWriter writer;
  png_set_write_fn(writer.png, &bytes, append_bytes, no_flush);
  png_set_IHDR(writer.png, writer.info, static_cast<png_uint_32>(image.width),
               static_cast<png_uint_32>(image.height), 8, PNG_COLOR_TYPE_RGB, PNG_INTERLACE_NONE,
               PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  png_set_sRGB(writer.png, writer.info, PNG_sRGB_INTENT_PERCEPTUAL);
  png_set_filter(writer.png, PNG_FILTER_TYPE_BASE, PNG_FILTER_SUB);
  png_set_compression_level(writer.png, 2);
  png_write_info(writer.png, writer.info);
  const size_t row_bytes = 3 * static_cast<size_t>(image.width);
  for (int row = 0; row < image.height; ++row) {
    png_write_row(writer.png, image.rgb.data() + static_cast<size_t>(row) * row_bytes);
  }
  png_write_end(writer.png, writer.info);
  write_file_atomically(file, bytes);
}

}  // namespace pilesim

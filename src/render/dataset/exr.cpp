#include "render/dataset/exr.h"

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wconversion"
#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfIO.h>
#include <OpenEXR/ImfOutputFile.h>
#pragma GCC diagnostic pop

#include <string>
#include <utility>

#include "core/atomic_file.h"
#include "core/error.h"

namespace pilesim {
namespace {

// Where OpenEXR writes to: it goes back to fill in where rows are.
class TextStream final : public Imf::OStream {
 public:
  TextStream() : Imf::OStream("memory") {}
  void write(const char bytes[], int count) override {
    text_.replace(at_, std::min(text_.size() - at_, static_cast<size_t>(count)), bytes,
                  static_cast<size_t>(count));
    at_ += static_cast<size_t>(count);
  }
  uint64_t tellp() override { return at_; }
  void seekp(uint64_t place) override {
    at_ = place;
    if (at_ > text_.size()) text_.resize(at_);
  }
  std::string text() && { return std::move(text_); }

 private:
  std::string text_;
  size_t at_ = 0;
};

template <class T>
Imf::Slice slice(Imf::PixelType type, const T* values, size_t stride, int width) {
  // OpenEXR reads from it only.
  auto* bytes = const_cast<char*>(reinterpret_cast<const char*>(values));
  const size_t step = stride * sizeof(T);
  return {type, bytes, step, step * static_cast<size_t>(width)};
}

}  // namespace

std::string exr_bytes(const std::filesystem::path& file, int width, int height,
                      const std::vector<ExrChannel>& channels) {
  Imf::Header header(width, height);
  header.compression() = Imf::ZIP_COMPRESSION;
  Imf::FrameBuffer buffer;
  for (const ExrChannel& channel : channels) {
    const auto add = [&](Imf::PixelType type, const auto* values) {
      header.channels().insert(channel.name, Imf::Channel(type));
      buffer.insert(channel.name, slice(type, values, channel.stride, width));
    };
    if (const auto* floats = std::get_if<const float*>(&channel.values)) {
      add(Imf::FLOAT, *floats);
    } else {
      add(Imf::UINT, std::get<const uint32_t*>(channel.values));
    }
  }
  TextStream stream;
  try {
    Imf::OutputFile output(stream, header, 0);
    output.setFrameBuffer(buffer);
    output.writePixels(height);
  } catch (const std::exception& fault) {
    throw Error(ErrorKind::internal, Problem{.file = file.string(), .found = fault.what()});
  }
  return std::move(stream).text();
}

void write_exr(const std::filesystem::path& file, int width, int height,
               const std::vector<ExrChannel>& channels) {
  write_file_atomically(file, exr_bytes(file, width, height, channels));
}

}  // namespace pilesim

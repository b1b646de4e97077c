#include "render/exr.h"

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wconversion"
#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfIO.h>
#include <OpenEXR/ImfInputFile.h>
#include <OpenEXR/ImfOutputFile.h>
#pragma GCC diagnostic pop

#include <cstring>
#include <string>
#include <utility>

#include "core/atomic_file.h"
#include "core/error.h"

namespace pilesim {
namespace {

// Pixels. Sides of what is written, too.
constexpr int kLongestSide = 16384, kLongestTile = 4096;

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

class BytesStream final : public Imf::IStream {
 public:
  explicit BytesStream(const std::string& bytes) : Imf::IStream("memory"), bytes_(bytes) {}
  bool read(char to[], int count) override {
    const auto size = static_cast<size_t>(count);
    if (count < 0 || at_ > bytes_.size() || size > bytes_.size() - at_) {
      throw UnreadableExr("ends too early");
    }
    std::memcpy(to, bytes_.data() + at_, size);
    at_ += size;
    return at_ < bytes_.size();
  }
  uint64_t tellg() override { return at_; }
  void seekg(uint64_t place) override { at_ = place; }

 private:
  const std::string& bytes_;
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

ExrColours read_exr_colours(const std::string& bytes,
                            const std::function<void(int64_t, int64_t)>& check_size) {
  // OpenEXR takes memory for rows and tiles before it can be asked for their size.
  Imf::Header::setMaxImageSize(kLongestSide, kLongestSide);
  Imf::Header::setMaxTileSize(kLongestTile, kLongestTile);
  BytesStream stream(bytes);
  ExrColours result;
  std::exception_ptr refusal;
  try {
    Imf::InputFile input(stream, 0);
    const auto& window = input.header().dataWindow();
    const int64_t width = int64_t{window.max.x} - window.min.x + 1;
    const int64_t height = int64_t{window.max.y} - window.min.y + 1;
    try {
      check_size(width, height);
    } catch (...) {
      refusal = std::current_exception();
      throw;
    }
    result.width = static_cast<int>(width);
    result.height = static_cast<int>(height);
    result.rgb.resize(3 * static_cast<size_t>(width * height));
    const size_t step = 3 * sizeof(float), row = step * static_cast<size_t>(width);
    Imf::FrameBuffer buffer;
    for (size_t i = 0; i < 3; ++i) {
      const char name[] = {"RGB"[i], '\0'};
      const Imf::Channel* channel = input.header().channels().findChannel(name);
      if (channel == nullptr) throw UnreadableExr("has no channel " + std::string(name));
      if (channel->xSampling != 1 || channel->ySampling != 1) {
        throw UnreadableExr("has not all pixels of the channel " + std::string(name));
      }
      buffer.insert(name, Imf::Slice::Make(Imf::FLOAT, result.rgb.data() + i, window, step, row));
    }
    input.setFrameBuffer(buffer);
    input.readPixels(window.min.y, window.max.y);
  } catch (const std::exception& fault) {
    if (refusal) std::rethrow_exception(refusal);
    throw UnreadableExr(fault.what());
  }
  return result;
}

}  // namespace pilesim

// Images to files: PNG, MP4 through ffmpeg, contact sheets.
#pragma once

#include <array>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "render/scene_renderer.h"

namespace pilesim {

// The bytes of its file. Throws Error(internal) where memory runs out.
std::string png_of(const Image& image);
std::string png_of(const Texture& texture);

// Written beside its place and renamed. Throws Error(io).
void write_png(const Image& image, const std::filesystem::path& file);

// The picture that write_png() wrote; none where the file is missing or has another size.
std::optional<Image> read_png(const std::filesystem::path& file, std::array<int, 2> size);

// Feeds frames to an ffmpeg process through a pipe (H.264, yuv420p, faststart). Odd sizes lose
// their last row or column of pixels in the video only. The file appears when finish() returns.
class VideoWriter {
 public:
  // Throws Error(io) if ffmpeg is not installed, naming the package.
  VideoWriter(const std::filesystem::path& file, int width, int height, double frame_rate);
  ~VideoWriter();  // without finish(): stops ffmpeg and removes the unfinished file
  VideoWriter(const VideoWriter&) = delete;
  VideoWriter& operator=(const VideoWriter&) = delete;

  void append(const Image& image);  // Error(io) with ffmpeg's last words
  void finish();                    // Error(io)

 private:
  struct State;
  std::unique_ptr<State> state_;
};

// Pictures side by side, row by row, with a thin gap; all of one size. Each bears its label (UTF-8,
// label.h) in its lower left corner.
Image contact_sheet(const std::vector<Image>& pictures, const std::vector<std::string>& labels,
                    int columns);
// Width and height in pixels of such a sheet, from those of a picture.
std::array<int, 2> contact_sheet_size(std::array<int, 2> picture, size_t count, int columns);

}  // namespace pilesim

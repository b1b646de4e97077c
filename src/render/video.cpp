#include <string>
#include <system_error>

#include "core/error.h"
#include "core/subprocess.h"
#include "core/text.h"
#include "render/image_output.h"

namespace pilesim {

struct VideoWriter::State {
  std::filesystem::path file;
  std::filesystem::path unfinished;
  Subprocess ffmpeg;
  bool finished = false;
};

VideoWriter::VideoWriter(const std::filesystem::path& file, int width, int height,
                         double frame_rate) {
  const std::filesystem::path unfinished =
      file.parent_path() / ("." + file.filename().string() + ".tmp");
  // yuv420p wants even sizes, and players take untagged video for what they like: say BT.709.
  const std::vector<std::string> command = {
      "ffmpeg",
      "-hide_banner",
      "-loglevel",
      "error",
      "-y",
      "-f",
      "rawvideo",
      "-pixel_format",
      "rgb24",
      "-video_size",
      std::to_string(width) + "x" + std::to_string(height),
      "-framerate",
      with_digits(frame_rate, 9),
      "-i",
      "-",
      "-vf",
      "crop=trunc(iw/2)*2:trunc(ih/2)*2,scale=out_color_matrix=bt709:out_range=tv",
      "-c:v",
      "libx264",
      "-preset",
      "veryfast",
      "-crf",
      "18",
      "-pix_fmt",
      "yuv420p",
      "-colorspace",
      "bt709",
      "-color_primaries",
      "bt709",
      "-color_trc",
      "bt709",
      "-movflags",
      "+faststart",
      "-f",
      "mp4",
      unfinished.string()};
  state_.reset(new State{file, unfinished, Subprocess(command, "ffmpeg")});
}

VideoWriter::~VideoWriter() {
  if (state_->finished) return;
  const std::filesystem::path unfinished = state_->unfinished;
  state_.reset();  // ends ffmpeg
  std::error_code ignored;
  std::filesystem::remove(unfinished, ignored);
}

void VideoWriter::append(const Image& image) {
  state_->ffmpeg.write(std::as_bytes(std::span(image.rgb)));
}

void VideoWriter::finish() {
  state_->ffmpeg.finish();
  std::error_code fault;
  std::filesystem::rename(state_->unfinished, state_->file, fault);
  if (fault) throw io_error(state_->file.string(), "cannot be written", fault.value());
  state_->finished = true;
}

}  // namespace pilesim

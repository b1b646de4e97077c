#include <string>

#include "core/error.h"
#include "core/subprocess.h"
#include "core/temporary_file.h"
#include "core/text.h"
#include "render/image_output.h"

namespace pilesim {

struct VideoWriter::State {
  std::filesystem::path file;
  TemporaryFile unfinished;
  Subprocess ffmpeg;  // last: it ends before its file is removed

  // The command lacks its last word, the file to write.
  State(const std::filesystem::path& place, std::vector<std::string> command)
      : file(place), unfinished(place), ffmpeg(completed(std::move(command)), "ffmpeg") {}

  // "file:": a name may begin with a dash or hold a colon.
  std::vector<std::string> completed(std::vector<std::string> command) const {
    command.push_back("file:" + unfinished.name().string());
    return command;
  }
};

namespace {

// Turns ffmpeg's complaints into an error of the user's file.
Error about(const std::filesystem::path& file, const Error& error) {
  std::vector<Problem> problems = error.problems();
  problems.front().found =
      "cannot be written: " + problems.front().file + " " + problems.front().found;
  problems.front().file = file.string();
  return {error.kind(), std::move(problems)};
}

}  // namespace

VideoWriter::VideoWriter(const std::filesystem::path& file, int width, int height,
                         double frame_rate) {
  // yuv420p wants even sizes, and players take untagged video for what they like: say BT.709.
  std::vector<std::string> command = {
      "ffmpeg",
      "-hide_banner",
      "-loglevel",
      "error",
      "-xerror",  // without it a disk that is full at the very end is no fault
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
      "mp4"};
  state_ = std::make_unique<State>(file, std::move(command));
}

VideoWriter::~VideoWriter() = default;

void VideoWriter::append(const Image& image) {
  try {
    state_->ffmpeg.write(std::as_bytes(std::span(image.rgb)));
  } catch (const Error& error) {
    throw about(state_->file, error);
  }
}

void VideoWriter::finish() {
  try {
    state_->ffmpeg.finish();
  } catch (const Error& error) {
    throw about(state_->file, error);
  }
  state_->unfinished.take_place();
}

}  // namespace pilesim

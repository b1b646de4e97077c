#include "render/render_job.h"

#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <deque>
#include <exception>
#include <mutex>
#include <thread>

#include "core/error.h"
#include "core/interrupt.h"
#include "render/image_output.h"
#include "render/scene_renderer.h"

namespace pilesim {
namespace {

namespace fs = std::filesystem;

std::string frame_name(uint64_t frame) {
  char name[48];
  std::snprintf(name, sizeof name, "frame.%04llu.png", static_cast<unsigned long long>(frame));
  return name;
}

std::string time_label(double time_s) {
  char label[32];
  std::snprintf(label, sizeof label, "%.2f s", time_s);
  return label;
}

// Compresses and encodes on a thread of its own while the next frame is drawn. At most a few
// pictures wait, so that memory stays bounded where encoding is the slower part.
class PictureSink {
 public:
  PictureSink(fs::path frames, VideoWriter& video)
      : frames_(std::move(frames)), video_(video), worker_([this] { work(); }) {}

  ~PictureSink() {
    if (worker_.joinable()) end();
  }
  PictureSink(const PictureSink&) = delete;
  PictureSink& operator=(const PictureSink&) = delete;

  // Throws what the thread threw.
  void push(uint64_t frame, const Image& image) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return queue_.size() < kWaiting || fault_; });
    if (fault_) std::rethrow_exception(fault_);
    queue_.emplace_back(frame, image);
    changed_.notify_all();
  }

  // All pictures are on disk and in the video's pipe afterwards.
  void finish() {
    end();
    if (fault_) std::rethrow_exception(fault_);
  }

 private:
  static constexpr size_t kWaiting = 4;

  void end() {
    {
      const std::lock_guard lock(mutex_);
      ended_ = true;
    }
    changed_.notify_all();
    worker_.join();
  }

  void work() {
    try {
      for (;;) {
        std::unique_lock lock(mutex_);
        changed_.wait(lock, [&] { return !queue_.empty() || ended_; });
        if (queue_.empty()) return;
        const auto [frame, image] = std::move(queue_.front());
        queue_.pop_front();
        changed_.notify_all();
        lock.unlock();
        write_png(image, frames_ / frame_name(frame));
        video_.append(image);
      }
    } catch (...) {
      const std::lock_guard lock(mutex_);
      fault_ = std::current_exception();
      changed_.notify_all();
    }
  }

  fs::path frames_;
  VideoWriter& video_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<std::pair<uint64_t, Image>> queue_;
  bool ended_ = false;
  std::exception_ptr fault_;
  std::thread worker_;  // last: starts when the rest is there
};

bool is_frame(const fs::path& file) {
  const std::string name = file.filename().string();
  return name.starts_with("frame.") && name.ends_with(".png");
}

// Refuses, or removes with `force`, the pictures of an earlier run.
void clear_place(const fs::path& output, const RenderJob& job) {
  std::error_code fault;
  std::vector<fs::path> old;
  if (job.sheet) {
    if (fs::exists(output / "sheet.png")) old.push_back(output / "sheet.png");
  } else {
    if (fs::exists(output / "video.mp4")) old.push_back(output / "video.mp4");
    for (const auto& entry : fs::directory_iterator(output / "frames", fault)) {
      if (is_frame(entry.path())) old.push_back(entry.path());
    }
  }
  if (!old.empty() && !job.force) {
    throw Error(ErrorKind::usage,
                Problem{.file = old.front().string(),
                        .found = "exists already",
                        .remedy = "Name another directory with -o, or pass --force to replace it"});
  }
  for (const fs::path& file : old) {
    if (!fs::remove(file, fault)) throw io_error(file.string(), "cannot be removed", fault.value());
  }
  const fs::path directory = job.sheet ? output : output / "frames";
  fs::create_directories(directory, fault);
  if (fault) throw io_error(directory.string(), "cannot be created", fault.value());
}

CameraKey camera_of_frame(const Camera& camera, const TrajectoryHeader& header, uint64_t frame) {
  return camera_at(camera, static_cast<double>(frame) / header.frame_rate);
}

void draw_sheet(TrajectoryReader& trajectory, const RenderJob& job, const Camera& camera,
                SceneRenderer& renderer, Progress& progress) {
  const auto [columns, rows] = *job.sheet;
  const size_t count =
      std::min(job.frames.size(), static_cast<size_t>(columns) * static_cast<size_t>(rows));
  std::vector<Image> pictures;
  std::vector<std::string> labels;
  TrajectoryFrame frame;
  for (size_t i = 0; i < count; ++i) {
    const uint64_t index =
        job.frames[count == 1 ? job.frames.size() - 1 : i * (job.frames.size() - 1) / (count - 1)];
    trajectory.read(index, frame);
    pictures.push_back(renderer.draw(frame, camera_of_frame(camera, trajectory.header(), index)));
    labels.push_back(time_label(static_cast<double>(index) / trajectory.header().frame_rate));
    progress.update(i + 1);
    if (interrupted()) {
      throw Error(ErrorKind::interrupted, Problem{.found = "interrupted; no sheet was written"});
    }
  }
  write_png(contact_sheet(pictures, labels, columns), job.output / "sheet.png");
}

// The number of frames drawn; fewer than asked where it was interrupted.
size_t draw_frames(TrajectoryReader& trajectory, const RenderJob& job, const Camera& camera,
                   SceneRenderer& renderer, VideoWriter& video, Progress& progress) {
  PictureSink sink(job.output / "frames", video);
  TrajectoryFrame frame;
  size_t drawn = 0;
  for (const uint64_t index : job.frames) {
    trajectory.read(index, frame);
    sink.push(index, renderer.draw(frame, camera_of_frame(camera, trajectory.header(), index)));
    progress.update(++drawn);
    if (interrupted()) break;
  }
  sink.finish();
  return drawn;
}

}  // namespace

RenderSummary run_render(TrajectoryReader& trajectory, const RenderJob& job, ProgressMode mode) {
  const auto start = std::chrono::steady_clock::now();
  const auto [width, height] = job.settings.size;
  Camera camera = job.camera;
  if (camera.keys.empty()) {
    camera.keys.push_back(frame_action(trajectory, static_cast<double>(width) / height));
  }
  SceneRenderer renderer(trajectory.header(), job.settings);
  RenderSummary summary;
  if (job.sheet) {
    clear_place(job.output, job);
    summary.frames = std::min(job.frames.size(), static_cast<size_t>((*job.sheet)[0]) *
                                                     static_cast<size_t>((*job.sheet)[1]));
    Progress progress(mode, "render", summary.frames, "frames");
    draw_sheet(trajectory, job, camera, renderer, progress);
    summary.result = (job.output / "sheet.png").string();
  } else {
    const uint64_t step = job.frames.size() > 1 ? job.frames[1] - job.frames[0] : 1;
    clear_place(job.output, job);
    VideoWriter video(job.output / "video.mp4", width, height,
                      trajectory.header().frame_rate / static_cast<double>(step));
    Progress progress(mode, "render", job.frames.size(), "frames");
    summary.frames = draw_frames(trajectory, job, camera, renderer, video, progress);
    video.finish();
    summary.result = (job.output / "video.mp4").string();
    if (summary.frames < job.frames.size()) {
      throw Error(
          ErrorKind::interrupted,
          Problem{.file = summary.result,
                  .found = "interrupted; holds the first " + std::to_string(summary.frames) +
                           " of " + std::to_string(job.frames.size()) + " frames"});
    }
  }
  summary.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return summary;
}

}  // namespace pilesim

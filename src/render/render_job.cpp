#include "render/render_job.h"

#include <condition_variable>
#include <cstdio>
#include <deque>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <span>
#include <thread>

#include "core/checkpoint_file.h"
#include "core/clock.h"
#include "core/error.h"
#include "core/hash.h"
#include "core/interrupt.h"
#include "core/naming.h"
#include "core/output_directory.h"
#include "render/cameras.h"
#include "render/image_output.h"
#include "render/scene_renderer.h"
#include "scene/camera_path.h"
#include "scene/scene_loader.h"

namespace pilesim {
namespace {

namespace fs = std::filesystem;

std::string frame_name(uint64_t frame) {
  char name[48];
  std::snprintf(name, sizeof name, "frame.%04llu", static_cast<unsigned long long>(frame));
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
  // Without a video, pictures only. `written` is called after each picture that has come to disk.
  PictureSink(fs::path output, VideoWriter* video, std::function<void()> written)
      : output_(std::move(output)),
        video_(video),
        written_(std::move(written)),
        worker_([this] { work(); }) {}

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
        write_png(image, frame_file(output_, frame));
        written_();
        if (video_ != nullptr) video_->append(image);
      }
    } catch (...) {
      const std::lock_guard lock(mutex_);
      fault_ = std::current_exception();
      changed_.notify_all();
    }
  }

  fs::path output_;
  VideoWriter* video_;
  std::function<void()> written_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<std::pair<uint64_t, Image>> queue_;
  bool ended_ = false;
  std::exception_ptr fault_;
  std::thread worker_;  // last: starts when the rest is there
};

std::unique_ptr<FrameRenderer> renderer_of(const RenderJob& job, const TrajectoryHeader& header,
                                           BodyColours colours) {
  if (job.make_renderer) return job.make_renderer(header, job.settings, colours);
  return std::make_unique<SceneRenderer>(header, job.settings, colours);
}

// A trajectory's pictures.
class Side {
 public:
  Side(TrajectoryReader& trajectory, const RenderJob& job, BodyColours colours)
      : trajectory_(trajectory),
        still_(job.still),
        renderer_(renderer_of(job, trajectory.header(), colours)) {}

  const Image& draw(uint64_t index, const Camera& camera) {
    const auto camera_of = [&](uint64_t frame) {
      return camera_at(camera, static_cast<double>(frame) / trajectory_.header().frame_rate);
    };
    DrawnFrame drawn{.index = index, .camera = camera_of(index)};
    if (renderer_->wants_neighbours()) {
      if (index > 0) {
        drawn.before = &frame(index - 1);
        drawn.camera_before = camera_of(index - 1);
      }
      drawn.frame = &frame(index);
      if (still_ || index + 1 < trajectory_.frame_count()) {
        drawn.after = &frame(index + 1);
        drawn.camera_after = camera_of(index + 1);
      }
    } else {
      drawn.frame = &frame(index);
    }
    return renderer_->draw(drawn);
  }
  // The frame that a picture shows: one of the last three that were asked for.
  const TrajectoryFrame& frame(uint64_t picture) {
    const uint64_t index = still_.value_or(picture);
    Kept& kept = kept_[index % kept_.size()];
    if (kept.index != index) {
      kept.index.reset();
      trajectory_.read(index, kept.frame);
      kept.index = index;
    }
    return kept.frame;
  }

 private:
  struct Kept {
    std::optional<uint64_t> index;
    TrajectoryFrame frame;
  };
  TrajectoryReader& trajectory_;
  std::optional<uint64_t> still_;
  std::unique_ptr<FrameRenderer> renderer_;
  std::array<Kept, 3> kept_;
};

// Pictures of the trajectory, or of two side by side.
class Painter {
 public:
  Painter(TrajectoryReader& trajectory, const RenderJob& job)
      : frame_rate_(trajectory.header().frame_rate), job_(job) {
    if (job.overlay) overlay_ = make_overlay(*job.overlay, job.overlay_source);
    side_.emplace(trajectory, job, job.overlay ? colours_of(*job.overlay) : BodyColours::own);
    if (job.beside != nullptr) side_beside_.emplace(*job.beside, job, BodyColours::own);
  }

  // The time of what a picture shows.
  std::string label(uint64_t picture) const {
    return time_label(time_s(job_.still.value_or(picture)));
  }
  // On a sheet, pictures bear the time.
  Image draw(uint64_t frame, bool on_sheet) {
    Image picture = side_->draw(frame, job_.camera);
    if (overlay_) {
      overlay_->draw(job_.still.value_or(frame), side_->frame(frame),
                     camera_at(job_.camera, time_s(frame)), picture);
    }
    if (!side_beside_) return picture;
    return contact_sheet({picture, side_beside_->draw(frame, job_.camera)},
                         {job_.labels[0] + (on_sheet ? ", " + label(frame) : ""), job_.labels[1]},
                         2);
  }

 private:
  double time_s(uint64_t frame) const { return static_cast<double>(frame) / frame_rate_; }

  double frame_rate_;
  const RenderJob& job_;
  std::optional<Side> side_, side_beside_;
  std::unique_ptr<Overlay> overlay_;
};

size_t pictures_on_sheet(const RenderJob& job) {
  const auto [columns, rows] = *job.sheet;
  return std::min(job.frames.size(), static_cast<size_t>(columns) * static_cast<size_t>(rows));
}

void draw_sheet(const RenderJob& job, Painter& painter, Progress& progress) {
  const size_t count = pictures_on_sheet(job);
  std::vector<Image> pictures;
  std::vector<std::string> labels;
  for (size_t i = 0; i < count; ++i) {
    const uint64_t index =
        job.frames[count == 1 ? job.frames.size() - 1 : i * (job.frames.size() - 1) / (count - 1)];
    pictures.push_back(painter.draw(index, true));
    labels.push_back(job.beside != nullptr ? "" : painter.label(index));
    progress.update(i + 1);
    if (interrupted()) {
      throw Error(ErrorKind::interrupted, Problem{.found = "interrupted; no sheet was written"});
    }
  }
  write_png(contact_sheet(pictures, labels, std::min((*job.sheet)[0], static_cast<int>(count))),
            job.output / kSheetFile);
}

std::array<int, 2> picture_size(const RenderJob& job) {
  return job.beside != nullptr ? contact_sheet_size(job.settings.size, 2, 2) : job.settings.size;
}

// All that the pictures depend on, but for the samples where films are kept.
CheckpointKey key_of(const TrajectoryReader& trajectory, const RenderJob& job) {
  StateWriter work;
  const auto add_trajectory = [&](const TrajectoryReader& reader) {
    work(reader.header().scene_hash, reader.header().resolved_scene, reader.hidden());
  };
  add_trajectory(trajectory);
  work(job.beside != nullptr);
  if (job.beside != nullptr) add_trajectory(*job.beside);
  for (const CameraKey& key : job.camera.keys) {
    work(key.time_s, key.position, key.target, key.field_of_view, key.roll, key.lens_shift);
  }
  RenderSettings settings = job.settings;
  if (job.film_samples) settings.rays.samples.reset();  // RenderProgress looks at them
  work(job.frames, settings_text(settings),
       job.overlay.has_value() ? static_cast<int>(*job.overlay) : -1, job.labels, job.video,
       job.film_samples.has_value(), job.still.has_value(), job.still.value_or(0));
  return {.command = "render",
          .program = program_hash(),
          .scene = content_hash(work.bytes()),
          .start = ""};
}

// How many pictures are done: on disk after each one.
class RenderProgress {
 public:
  // Done before: as the checkpoint of the same work says, where job.resume asks for it.
  RenderProgress(const TrajectoryReader& trajectory, const RenderJob& job, bool has_pictures)
      : file_(job.output / kRenderCheckpointFile),
        key_(key_of(trajectory, job)),
        samples_(job.film_samples.value_or(0)) {
    if (!job.resume) return;
    if (!fs::exists(file_)) {
      if (!has_pictures) return;
      throw Error(ErrorKind::usage,
                  Problem{.file = job.output.string(),
                          .found = "has pictures but nothing to resume",
                          .remedy = "Replace them with --force in place of --resume"});
    }
    const Checkpoint checkpoint(file_);
    checkpoint.require(key_);
    StateReader reader(checkpoint.state());
    uint32_t samples = 0;
    naming(file_.string(), [&] {
      reader(samples, done_);
      StateReader::require(done_ <= job.frames.size(), "no more pictures than were asked for");
    });
    if (samples > samples_) throw_too_many(samples);
    if (samples < samples_) done_ = 0;  // their films go on
  }

  uint64_t done() const { return done_; }
  void add_picture() {
    ++done_;
    write();
  }
  void write() const {
    StateWriter writer;
    writer(samples_, done_);
    write_checkpoint(file_, key_, writer.bytes());
  }

 private:
  [[noreturn]] void throw_too_many(uint32_t samples) const {
    throw Error(ErrorKind::input,
                Problem{.file = file_.string(),
                        .found = "is of " + std::to_string(samples) + " samples a pixel",
                        .expected = "at most " + std::to_string(samples_) + ", as was asked for",
                        .remedy = "Ask for --samples " + std::to_string(samples) +
                                  " or more, or start again with --force"});
  }

  fs::path file_;
  CheckpointKey key_;
  uint32_t samples_;  // a pixel, of a renderer that keeps films; 0 of others
  uint64_t done_ = 0;
};

// None: interrupted in the midst of it.
std::optional<Image> draw_or_stop(Painter& painter, uint64_t frame) {
  try {
    return painter.draw(frame, false);
  } catch (const Error& error) {
    if (error.kind() != ErrorKind::interrupted) throw;
    return std::nullopt;
  }
}

// The number of frames drawn; fewer than asked where it was interrupted.
size_t draw_frames(const RenderJob& job, Painter& painter, VideoWriter* video, RenderProgress& done,
                   Progress& progress) {
  // The video begins again, with the existing pictures.
  size_t drawn = 0;
  for (const uint64_t kept = done.done(); drawn < kept; progress.update(++drawn)) {
    const fs::path file = frame_file(job.output, job.frames[drawn]);
    std::optional<Image> picture = read_png(file, picture_size(job));
    if (!picture) {
      picture = draw_or_stop(painter, job.frames[drawn]);
      if (!picture) return drawn;
      write_png(*picture, file);
    }
    if (video != nullptr) video->append(*picture);
  }
  PictureSink sink(job.output, video, [&] { done.add_picture(); });
  while (drawn < job.frames.size()) {
    const std::optional<Image> picture = draw_or_stop(painter, job.frames[drawn]);
    if (!picture) break;
    sink.push(job.frames[drawn], *picture);
    progress.update(++drawn);
    if (interrupted()) break;
  }
  sink.finish();
  return drawn;
}

// Starts ffmpeg before anything is replaced: it may be missing.
std::unique_ptr<VideoWriter> start_video(const RenderJob& job, double frame_rate) {
  if (!job.video) return nullptr;
  // Frames that are listed one by one may lie unevenly.
  uint64_t step = std::max<uint64_t>(1, job.frames.back() - job.frames.front());
  for (size_t i = 1; i < job.frames.size(); ++i) {
    step = std::min(step, job.frames[i] - job.frames[i - 1]);
  }
  make_output_directory(job.output);
  const auto [width, height] = picture_size(job);
  return std::make_unique<VideoWriter>(job.output / kVideoFile, width, height,
                                       frame_rate / static_cast<double>(step));
}

// Removes earlier pictures that this run has not replaced.
void remove_outdated(std::span<const fs::path> before, const RenderJob& job, size_t drawn) {
  std::set<fs::path> current = {job.output / kVideoFile};
  for (size_t i = 0; i < drawn; ++i) {
    current.insert(frame_file(job.output, job.frames[i]));
    if (job.film_samples) current.insert(film_file(job.output, job.frames[i]));
  }
  std::vector<fs::path> outdated;
  for (const fs::path& file : before) {
    if (!current.contains(file)) outdated.push_back(file);
  }
  remove_output(outdated);
}

// Frames and video. The old ones stay until the new ones take their places.
RenderSummary render_frames(const RenderJob& job, double frame_rate, Painter& painter,
                            RenderProgress& done, std::span<const fs::path> before,
                            ProgressMode mode) {
  const auto video = start_video(job, frame_rate);
  make_output_directory(job.output / "frames");
  if (job.film_samples) make_output_directory(job.output / "films");
  write_cameras_file(job.output / kCamerasFile, job.camera, job.frames, job.still, frame_rate,
                     job.settings.size);
  Progress progress(mode, "render", job.frames.size(), "frames");
  RenderSummary summary;
  summary.kept = done.done();
  done.write();
  summary.frames = draw_frames(job, painter, video.get(), done, progress);
  if (video && summary.frames > 0) video->finish();
  // Pictures of fewer samples stay if the work stops before they are drawn again.
  remove_outdated(before, job, job.resume ? job.frames.size() : summary.frames);
  summary.result = (job.output / (video ? kVideoFile : "frames")).string();
  if (summary.frames < job.frames.size()) {
    throw Error(ErrorKind::interrupted,
                Problem{.file = summary.result,
                        .found = "interrupted; holds the first " + std::to_string(summary.frames) +
                                 " of " + std::to_string(job.frames.size()) + " frames",
                        .remedy = "Go on with the same command and --resume"});
  }
  summary.last_picture = frame_file(job.output, job.frames.back());
  return summary;
}

RenderSummary render_sheet(const RenderJob& job, Painter& painter, ProgressMode mode) {
  RenderSummary summary;
  summary.frames = pictures_on_sheet(job);
  make_output_directory(job.output);
  Progress progress(mode, "render", summary.frames, "frames");
  draw_sheet(job, painter, progress);
  summary.result = (job.output / kSheetFile).string();
  return summary;
}

// Checks sizes before any work.
void check_sizes(const RenderJob& job) {
  const auto [width, height] = job.settings.size;
  const size_t beside = job.beside != nullptr ? 2 : 1;
  if (job.sheet) {
    const size_t count = pictures_on_sheet(job) * beside;
    const uint64_t pixels =
        uint64_t{count} * static_cast<uint64_t>(width) * static_cast<uint64_t>(height);
    if (pixels <= kMostSheetPixels) return;
    throw Error(ErrorKind::usage,
                Problem{.found = "--sheet: " + std::to_string(count) + " pictures of " +
                                 std::to_string(width) + "x" + std::to_string(height) + " are " +
                                 std::to_string(pixels) + " pixels",
                        .expected = "at most " + std::to_string(kMostSheetPixels),
                        .remedy = "Ask for fewer pictures or a smaller --size"});
  }
  const int video_width =
      job.beside != nullptr ? contact_sheet_size(job.settings.size, 2, 2)[0] : width;
  if (job.video && video_width > kWidestVideo) {
    throw Error(ErrorKind::usage,
                Problem{.found = "a video " + std::to_string(video_width) + " pixels wide",
                        .expected = "at most " + std::to_string(kWidestVideo),
                        .remedy = "Ask for a smaller --size, or for --no-video"});
  }
}

std::vector<fs::path> claim_pictures(const RenderJob& job) {
  std::vector<std::string_view> own = {kFrameFiles, kFilmFiles};
  if (job.video) own.push_back(kVideoFile);
  if (job.sheet) own = {kSheetFile};
  return claim_output(job.output, own, job.force || job.resume);
}

}  // namespace

fs::path frame_file(const fs::path& output, uint64_t frame) {
  return output / "frames" / (frame_name(frame) + ".png");
}

fs::path film_file(const fs::path& output, uint64_t frame) {
  return output / "films" / (frame_name(frame) + ".film");
}

void check_render(const RenderJob& job) {
  check_sizes(job);
  claim_pictures(job);
}

RenderSummary run_render(TrajectoryReader& trajectory, const RenderJob& job, ProgressMode mode) {
  const Stopwatch watch;
  check_sizes(job);
  const std::vector<fs::path> before = claim_pictures(job);
  std::optional<RenderProgress> done;
  if (!job.sheet) done.emplace(trajectory, job, !before.empty());

  Painter painter(trajectory, job);
  install_interrupt_handler();
  RenderSummary summary =
      job.sheet ? render_sheet(job, painter, mode)
                : render_frames(job, trajectory.header().frame_rate, painter, *done, before, mode);
  summary.wall_s = watch.seconds();
  return summary;
}

}  // namespace pilesim

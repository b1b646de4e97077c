#include "render_pictures.h"

#include <algorithm>
#include <filesystem>
#include <memory>
#include <numeric>
#include <vector>

#include "core/atomic_file.h"
#include "core/counted.h"
#include "core/error.h"
#include "core/text.h"
#include "job/run_model.h"
#include "print.h"
#include "render/cameras.h"
#include "render/dataset/dataset_job.h"
#include "render/rays/rays_renderer.h"
#include "render/render_job.h"
#include "report/html.h"
#include "scene/camera_path.h"
#include "trajectory/named_bodies.h"

namespace pilesim {
namespace {

std::string directory_name(const std::string& path) {
  if (path.empty()) return "";  // which std::filesystem::absolute() refuses
  const std::filesystem::path full = std::filesystem::absolute(path).lexically_normal();
  return (full.has_filename() ? full : full.parent_path()).filename().string();
}

std::unique_ptr<TrajectoryReader> open_beside(const RenderArguments& options,
                                              const TrajectoryReader& trajectory) {
  if (!options.compare_with) return nullptr;
  auto beside = std::make_unique<TrajectoryReader>(*options.compare_with);
  const double rate = trajectory.header().frame_rate, other = beside->header().frame_rate;
  if (rate != other) {
    throw Error(ErrorKind::input,
                Problem{.file = *options.compare_with,
                        .found = with_digits(other, 6) + " frames a second",
                        .expected = with_digits(rate, 6) + ", as " + options.input + " has",
                        .remedy = "Simulate both scenes with the same frame_rate"});
  }
  return beside;
}

// Adds the overrides that --renderer, --quality and --samples abbreviate.
void add_render_overrides(const TrajectoryHeader& header, RenderArguments& options) {
  Overrides& overrides = options.overrides;
  if (options.renderer) {
    const std::string word = *options.renderer == Renderer::rays ? "rays" : "raster";
    overrides.add("/render/renderer=\"" + word + "\"", "--renderer", word);
  }
  if (options.quality) {
    static const std::array<std::string, 3> kWords = {"preview", "good", "final"};
    const std::string& word = kWords[static_cast<size_t>(*options.quality)];
    if (options.renderer == Renderer::raster) {
      throw Error(ErrorKind::usage,
                  Problem{.found = "--quality " + word + " with --renderer raster",
                          .expected = "--renderer rays",
                          .remedy = "Leave one of them out"});
    }
    options.renderer = Renderer::rays;
    overrides.add("/render/renderer=\"rays\"", "--quality", word);
    overrides.add("/render/rays/quality=\"" + word + "\"", "--quality", word);
  }
  if (options.samples) {
    const Renderer renderer = options.renderer.value_or(
        stored_scene(header, options.input, overrides.texts).render.renderer);
    const std::string number = std::to_string(*options.samples);
    overrides.add(
        (renderer == Renderer::rays ? "/render/rays/samples=" : "/render/samples=") + number,
        "--samples", number);
  }
}

// Surfaces look as the scene of each trajectory says.
MakeRenderer by_rays(const RenderArguments& options, const std::filesystem::path& output) {
  std::optional<FilmPlace> films;
  if (options.keep_films) films = FilmPlace{.output = output, .go_on = options.resume};
  return [&options, films](const TrajectoryHeader& header, const RenderSettings& settings,
                           BodyColours colours) {
    return std::make_unique<RaysRenderer>(
        header, settings, stored_scene(header, options.input, {}).materials, colours, films);
  };
}

void check_films(const RenderArguments& options, const Scene& scene) {
  if (!options.keep_films || scene.render.renderer == Renderer::rays) return;
  throw Error(ErrorKind::usage, Problem{.found = "--keep-films with the renderer raster",
                                        .expected = "the renderer rays",
                                        .remedy = "Add --renderer rays, or leave it out"});
}

// Hides the bodies that --only does not name and that --hide names.
void hide_bodies(const RenderArguments& options, TrajectoryReader& trajectory) {
  if (options.only.empty() && options.hide.empty()) return;
  const std::vector<std::string>& names = trajectory.header().body_name;
  std::vector<uint8_t> hidden = bodies_named(options.hide, names, "--hide");
  if (!options.only.empty()) {
    const std::vector<uint8_t> shown = bodies_named(options.only, names, "--only");
    for (size_t body = 0; body < names.size(); ++body)
      if (shown[body] == 0) hidden[body] = 1;
  }
  if (std::ranges::find(hidden, 0) == hidden.end()) {
    throw Error(ErrorKind::usage, Problem{.file = "--hide",
                                          .found = "no body is left to be drawn",
                                          .expected = "at least one",
                                          .remedy = "Name fewer with --hide, or more with --only"});
  }
  trajectory.hide(std::move(hidden));
}

std::vector<uint64_t> frames_of(const RenderArguments& options, uint64_t count, double frame_rate) {
  if (!options.orbit_s || !options.all_frames) {
    return selected_frames(options.frames, count, frame_rate);
  }
  return selected_frames(parse_frame_ranges("last"), count, frame_rate);
}

// The turn of --orbit begins where the camera is in the frame that it shows.
struct Orbit {
  uint64_t still = 0;  // frame of the trajectory
  uint64_t pictures = 0;
  double frame_rate = 1;

  Camera around(const Camera& camera) const {
    return turned_about(camera_at(camera, static_cast<double>(still) / frame_rate), pictures,
                        frame_rate);
  }
};

// `frames`, what was selected, become the numbers of the pictures.
std::optional<Orbit> orbit_of(const RenderArguments& options, double frame_rate,
                              std::vector<uint64_t>& frames) {
  if (!options.orbit_s) return std::nullopt;
  if (frames.size() != 1) {
    throw Error(ErrorKind::usage,
                Problem{.file = "--orbit",
                        .found = std::to_string(frames.size()) + " frames are selected",
                        .expected = "one, in which the bodies stand still",
                        .remedy = "Say --frames last, or leave --frames out"});
  }
  const Orbit orbit{
      .still = frames.front(),
      .pictures = std::max<uint64_t>(1, static_cast<uint64_t>(*options.orbit_s * frame_rate + 0.5)),
      .frame_rate = frame_rate};
  frames.resize(orbit.pictures);
  std::iota(frames.begin(), frames.end(), uint64_t{0});
  return orbit;
}

// Pictures of one camera; without a camera yet.
struct CameraWork {
  RenderJob pictures;
  DatasetJob dataset;

  void set_camera(const Camera& camera) { pictures.camera = dataset.camera = camera; }
};

CameraWork work_of(const RenderArguments& options, const Scene& scene,
                   const std::vector<uint64_t>& frames, const std::filesystem::path& output) {
  CameraWork work{
      .pictures = {.output = output,
                   .frames = frames,
                   .sheet = options.sheet,
                   .settings = scene.render,
                   .make_renderer =
                       scene.render.renderer == Renderer::rays ? by_rays(options, output) : nullptr,
                   .labels = {directory_name(options.input),
                              directory_name(options.compare_with.value_or(""))},
                   .video = !options.no_video,
                   .force = options.run.force,
                   .resume = options.resume},
      .dataset = {.output = output,
                  .frames = frames,
                  .size = scene.render.size,
                  .passes = options.dataset.passes,
                  .coco = options.dataset.coco}};
  if (options.keep_films) work.pictures.film_samples = plan_of(scene.render.rays).samples;
  if (options.overlay) {
    work.pictures.overlay = options.overlay;
    work.pictures.overlay_source = options.input;
  }
  return work;
}

// So well that the report of the run opens with it.
bool shows_end(const TrajectoryReader& trajectory, const RenderJob& job) {
  constexpr int64_t kMostReportPixels = 1920 * 1080;
  const auto [width, height] = job.settings.size;
  return job.beside == nullptr && !job.still && trajectory.hidden().empty() &&
         job.frames.back() + 1 == trajectory.frame_count() &&
         int64_t{width} * height <= kMostReportPixels;
}

void draw(TrajectoryReader& trajectory, const RenderArguments& options, const CameraWork& work) {
  const ProgressMode mode = options.run.quiet ? ProgressMode::none : options.run.progress;
  const RenderSummary summary = run_render(trajectory, work.pictures, mode);
  if (shows_end(trajectory, work.pictures) && !summary.last_picture.empty()) {
    put_picture(work.pictures.output / "report.html", kEndPicture, read_file(summary.last_picture),
                kEndLabel);
  }
  if (options.dataset.any()) run_dataset(trajectory, work.dataset, mode);
  if (options.run.quiet) return;
  const std::string kept =
      summary.kept > 0 ? " (" + std::to_string(summary.kept) + " of them drawn before)" : "";
  print("%s: %s%s in %.1f s\n", summary.result.c_str(), counted(summary.frames, "frame").c_str(),
        kept.c_str(), summary.wall_s);
}

}  // namespace

void render(RenderArguments& options) {
  check_picture_overrides(options.overrides.texts);
  TrajectoryReader trajectory(options.input);
  std::unique_ptr<TrajectoryReader> beside = open_beside(options, trajectory);
  add_render_overrides(trajectory.header(), options);
  const Scene scene = stored_scene(trajectory.header(), options.input, options.overrides.texts);
  check_films(options, scene);
  hide_bodies(options, trajectory);
  if (beside) hide_bodies(options, *beside);
  const double frame_rate = trajectory.header().frame_rate;
  std::vector<uint64_t> frames = frames_of(
      options,
      beside ? std::min(trajectory.frame_count(), beside->frame_count()) : trajectory.frame_count(),
      frame_rate);
  const std::optional<Orbit> orbit = orbit_of(options, frame_rate, frames);
  const auto as_asked = [&](const Camera& camera) {
    return orbit ? orbit->around(camera) : camera;
  };
  const std::filesystem::path output = options.output.value_or(options.input);
  std::vector<CameraWork> work;
  if (options.camera) {
    for (const ChosenCamera& chosen : choose_cameras(trajectory, scene, *options.camera)) {
      work.push_back(work_of(options, scene, frames, output / "cameras" / chosen.name));
      work.back().set_camera(as_asked(chosen.camera));
    }
  } else {
    work.push_back(work_of(options, scene, frames, output));
  }
  for (size_t i = 0; i < work.size(); ++i) {
    work[i].pictures.beside = beside.get();
    if (orbit) work[i].pictures.still = orbit->still;
    if (options.dataset.bop) {
      work[i].dataset.bop = output / "bop";
      work[i].dataset.bop_scene = static_cast<int>(i);
    }
    check_render(work[i].pictures);
    claim_dataset(work[i].dataset, options.run.force || options.resume);
  }
  // Which reads the trajectory: only now, when nothing is refused.
  if (!options.camera) work.front().set_camera(as_asked(main_camera(trajectory, scene)));
  for (const CameraWork& each : work) draw(trajectory, options, each);
}

}  // namespace pilesim

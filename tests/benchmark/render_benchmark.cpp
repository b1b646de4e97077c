// Both renderers on a frame of a run:
//   render_benchmark RUN FRAME PX,PY,PZ,TX,TY,TZ REFERENCE_SAMPLES WIDTHxHEIGHT [DIRECTORY]
// The camera is at P and looks at T. Times, wall and processor, are medians over rounds in turns,
// for a renderer that has drawn the previous frame and finds all bodies moved. Errors are those of
// the picture, in steps of 255 of sRGB: root mean square, mean, and share of pixels that differ by
// more than 8. The reference is `final` with REFERENCE_SAMPLES samples and no filter; 0: no
// reference. Pictures go to DIRECTORY.
#include <sys/resource.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <string>
#include <vector>

#include "core/clock.h"
#include "render/image_output.h"
#include "render/rays/rays_renderer.h"
#include "render/scene_renderer.h"
#include "report_errors.h"
#include "trajectory/trajectory.h"

namespace pilesim {
namespace {

constexpr int kRounds = 1;

struct Contender {
  std::string name;
  std::unique_ptr<FrameRenderer> renderer;
  std::vector<double> times_s, processor_s;
  Image image;
};

// Without the first round, which prepares data for the later ones.
double median(std::vector<double> values) {
  if (values.size() > 1) values.erase(values.begin());
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2),
                   values.end());
  return values[values.size() / 2];
}

void print_error(const Image& image, const Image& reference) {
  double squares = 0, sum = 0;
  size_t off = 0;
  for (size_t i = 0; i < image.rgb.size(); i += 3) {
    int most = 0;
    for (size_t c = 0; c < 3; ++c) {
      const int difference = std::abs(int{image.rgb[i + c]} - int{reference.rgb[i + c]});
      most = std::max(most, difference);
      squares += difference * difference;
      sum += difference;
    }
    off += most > 8 ? 1 : 0;
  }
  const auto count = static_cast<double>(image.rgb.size());
  std::printf("  %6.2f %6.2f %6.2f %%", std::sqrt(squares / count), sum / count,
              300 * static_cast<double>(off) / count);
}

CameraKey camera_of(const char* text) {
  CameraKey camera;
  if (std::sscanf(text, "%lf,%lf,%lf,%lf,%lf,%lf", &camera.position.x(), &camera.position.y(),
                  &camera.position.z(), &camera.target.x(), &camera.target.y(),
                  &camera.target.z()) != 6) {
    std::fputs("the camera is six numbers with commas\n", stderr);
    std::exit(2);
  }
  return camera;
}

void run(char** argv) {
  TrajectoryReader trajectory(argv[1]);
  DrawnFrame drawn{.index = std::strtoull(argv[2], nullptr, 10), .camera = camera_of(argv[3])};
  TrajectoryFrame frame, moved;
  trajectory.read(drawn.index, frame);
  moved = frame;
  for (Vec3& position : moved.position) position.x() += 1e-4;
  RenderSettings base;
  if (std::sscanf(argv[5], "%dx%d", &base.size[0], &base.size[1]) != 2) {
    std::fputs("the size is WIDTHxHEIGHT\n", stderr);
    std::exit(2);
  }
  std::vector<Contender> contenders;
  for (const int samples : {1, 4}) {
    RenderSettings settings = base;
    settings.samples = samples;
    contenders.push_back({"raster, " + std::to_string(samples) + " samples",
                          std::make_unique<SceneRenderer>(trajectory.header(), settings),
                          {},
                          {}});
  }
  const auto add = [&](const std::string& name, const RaySettings& rays) {
    RenderSettings settings = base;
    settings.rays = rays;
    contenders.push_back({name,
                          std::make_unique<RaysRenderer>(trajectory.header(), settings,
                                                         std::map<std::string, Material>{}),
                          {},
                          {}});
  };
  add("rays, preview", {.quality = RayQuality::preview});
  add("rays, good", {.quality = RayQuality::good});
  add("rays, final", {.quality = RayQuality::final});
  add("rays, preview, no filter", {.quality = RayQuality::preview, .denoise = false});
  add("rays, good, no filter", {.quality = RayQuality::good, .denoise = false});
  add("rays, final, no filter", {.quality = RayQuality::final, .denoise = false});
  for (int round = 0; round <= kRounds; ++round) {
    for (Contender& contender : contenders) {
      const bool for_errors = contender.name.ends_with("no filter");
      if (for_errors && (round > 0 || std::atoi(argv[4]) == 0)) continue;
      drawn.frame = round % 2 == 0 ? &frame : &moved;
      const Stopwatch watch;
      const std::clock_t start = std::clock();
      const Image& image = contender.renderer->draw(drawn);
      contender.times_s.push_back(watch.seconds());
      contender.processor_s.push_back(static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC);
      if (round == 0) contender.image = image;
    }
  }
  Image reference;
  if (const int samples = std::atoi(argv[4]); samples > 0) {
    RenderSettings settings = base;
    settings.rays = {.samples = samples, .denoise = false};
    drawn.frame = &frame;
    reference = RaysRenderer(trajectory.header(), settings, {}).draw(drawn);
  }
  for (const Contender& contender : contenders) {
    if (contender.times_s.empty()) continue;
    std::printf("%-26s %7.3f s %7.3f s", contender.name.c_str(), median(contender.times_s),
                median(contender.processor_s));
    if (!reference.rgb.empty()) print_error(contender.image, reference);
    std::printf("\n");
    if (argv[6] != nullptr) {
      write_png(contender.image, std::filesystem::path(argv[6]) / (contender.name + ".png"));
    }
  }
  if (argv[6] != nullptr && !reference.rgb.empty()) {
    write_png(reference, std::filesystem::path(argv[6]) / "reference.png");
  }
  struct rusage usage {};
  getrusage(RUSAGE_SELF, &usage);
  std::printf("most memory, all of them together: %ld MB\n", usage.ru_maxrss / 1024);
}

}  // namespace
}  // namespace pilesim

int main(int argc, char** argv) {
  if (argc < 6) {
    std::fputs(
        "render_benchmark RUN FRAME PX,PY,PZ,TX,TY,TZ REFERENCE_SAMPLES WIDTHxHEIGHT [DIRECTORY]\n",
        stderr);
    return 2;
  }
  return pilesim::report_errors([&] { pilesim::run(argv); });
}

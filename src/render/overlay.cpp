#include "render/overlay.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <string>

#include "core/counted.h"
#include "core/error.h"
#include "render/forces_overlay.h"
#include "render/guide_overlay.h"
#include "render/label.h"
#include "render/pile_overlay.h"

namespace pilesim {
namespace {

// Number of bodies of each engine, as a legend of the colours in the upper left corner: sheets have
// the time in the lower one.
class SolverOverlay final : public Overlay {
 public:
  void draw(uint64_t index, const TrajectoryFrame& frame, const CameraKey& camera,
            Image& image) const override;

 private:
  struct Row {
    uint8_t flags;
    const char* text;
  };
  static constexpr std::array<Row, 3> kRows = {{{kImpulse, "solved"},
                                                {kStatistical | kImpulse, "solved, near those"},
                                                {kStatistical, "as spheres"}}};
};

void SolverOverlay::draw(uint64_t, const TrajectoryFrame& frame, const CameraKey&,
                         Image& image) const {
  // Height of a line, as a share of the picture's.
  constexpr double kLine = 0.03;
  const int line = std::max(8, static_cast<int>(std::lround(kLine * image.height)));
  const int row_height = line + line / 2;
  int top = 0;
  for (const Row& row : kRows) {
    const auto count = std::ranges::count_if(frame.state, [&](uint8_t state) {
      return (state & kPresent) != 0 && (state & (kImpulse | kStatistical)) == row.flags;
    });
    if (count == 0) continue;
    const Rectangle tile = {std::min(line, image.width), std::min(top, image.height), image.width,
                            std::min(top + row_height, image.height)};
    draw_label(image, counted(static_cast<size_t>(count), "body", "bodies") + " " + row.text, tile,
               line);
    const std::array<uint8_t, 3> colour = solver_colour(row.flags);
    for (int y = tile.top; y < tile.bottom; ++y) {
      for (int x = 0; x < tile.left; ++x) {
        blend(image, x, y, Eigen::Vector3f(colour[0], colour[1], colour[2]), 1);
      }
    }
    top = tile.bottom;
  }
}

// That the run has the file which such an overlay shows.
void require_directed(const std::filesystem::path& directory, const char* file,
                      const std::string& overlay, const char* key) {
  if (std::filesystem::exists(directory / file)) return;
  throw Error(ErrorKind::usage,
              Problem{.file = "--overlay " + overlay,
                      .found = "wants " + (directory / file).string() + ", which is not there",
                      .expected = std::string("a run of pilesim direct-pile whose scene has \"") +
                                  key + '"'});
}

}  // namespace

std::unique_ptr<Overlay> make_overlay(OverlayKind kind, const std::filesystem::path& directory) {
  if (kind == OverlayKind::piles) require_directed(directory, "piles.json", "piles", "piles");
  if (kind == OverlayKind::guide) require_directed(directory, "guide.json", "guide", "guide");
  if (kind == OverlayKind::forces) require_directed(directory, "guide.json", "forces", "guide");
  switch (kind) {
    case OverlayKind::piles:
      return std::make_unique<PileOverlay>(directory / "piles.json");
    case OverlayKind::guide:
      return std::make_unique<GuideOverlay>(directory / "guide.json");
    case OverlayKind::forces:
      return std::make_unique<ForcesOverlay>(directory / "guide.json");
    case OverlayKind::solver:
      break;
  }
  return std::make_unique<SolverOverlay>();
}

BodyColours colours_of(OverlayKind kind) {
  switch (kind) {
    case OverlayKind::piles:
      return BodyColours::sleepers;
    case OverlayKind::guide:
      return BodyColours::analysis;
    case OverlayKind::forces:
      return BodyColours::own;
    case OverlayKind::solver:
      break;
  }
  return BodyColours::solver;
}

void blend(Image& image, int x, int y, const Eigen::Vector3f& colour, float opacity) {
  uint8_t* pixel = &image.rgb[3 * (static_cast<size_t>(y) * image.width + x)];
  for (int c = 0; c < 3; ++c) {
    pixel[c] = static_cast<uint8_t>(std::lround(std::lerp(pixel[c], colour[c], opacity)));
  }
}

}  // namespace pilesim

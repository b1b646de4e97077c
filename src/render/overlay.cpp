#include "render/overlay.h"

#include <cmath>

#include "render/guide_overlay.h"
#include "render/pile_overlay.h"

namespace pilesim {

std::unique_ptr<Overlay> make_overlay(OverlayKind kind, const std::filesystem::path& directory) {
  if (kind == OverlayKind::piles) return std::make_unique<PileOverlay>(directory / "piles.json");
  return std::make_unique<GuideOverlay>(directory / "guide.json");
}

void blend(Image& image, int x, int y, const Eigen::Vector3f& colour, float opacity) {
  uint8_t* pixel = &image.rgb[3 * (static_cast<size_t>(y) * image.width + x)];
  for (int c = 0; c < 3; ++c) {
    pixel[c] = static_cast<uint8_t>(std::lround(std::lerp(pixel[c], colour[c], opacity)));
  }
}

}  // namespace pilesim

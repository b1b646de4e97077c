// Drawings over pictures, from a file that a command wrote beside its trajectory.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>

#include "core/types.h"
#include "render/body_colours.h"
#include "render/scene_renderer.h"
#include "scene/scene.h"

namespace pilesim {

class Overlay {
 public:
  virtual ~Overlay() = default;
  // As of a frame of the trajectory. It is drawn over what stands before it, too.
  virtual void draw(uint64_t index, const TrajectoryFrame& frame, const CameraKey& camera,
                    Image& image) const = 0;
};

enum class OverlayKind {
  piles,   // layers of stacking structures; what sleeps is darker
  guide,   // the guide and what holds bodies, which have the colours of the analysis
  solver,  // how many bodies are stepped by whom, in the colours that tell it
  forces,  // force chains of a pile that is held by glue
};

BodyColours colours_of(OverlayKind kind);

// The overlay of a directory that `pilesim direct-pile` wrote, but for `solver`: any run. Throws
// Error(io), or Error(input) where its file is not one of that command.
std::unique_ptr<Overlay> make_overlay(OverlayKind kind, const std::filesystem::path& directory);

// Blends a pixel within the image; sRGB from 0 to 255.
void blend(Image& image, int x, int y, const Eigen::Vector3f& colour, float opacity);

}  // namespace pilesim

// The work of `pilesim render`: what its command line asks for, and how that is done.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>

#include "dataset_options.h"
#include "frame_range.h"
#include "options.h"
#include "render/overlay.h"
#include "scene/scene.h"

namespace pilesim {

struct RenderArguments {
  std::string input;
  std::optional<std::string> output, compare_with, camera;
  std::optional<OverlayKind> overlay;
  std::optional<Renderer> renderer;
  std::optional<RayQuality> quality;
  std::optional<uint64_t> samples;
  Overrides overrides;
  DatasetOptions dataset;
  std::vector<FrameRange> frames = std::vector<FrameRange>(1);
  bool all_frames = true;               // no --frames
  std::optional<double> orbit_s;        // of one turn about a still frame
  std::vector<std::string> only, hide;  // names of bodies
  std::optional<std::array<int, 2>> sheet;
  bool no_video = false;
  bool resume = false;
  bool keep_films = false;
  RunOptions run;
};

// Refuses what cannot be done before any work of it.
void render(RenderArguments& options);

}  // namespace pilesim

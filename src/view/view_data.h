// The data of a page about a trajectory: quantised poses as bytes, for page_data.js.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "export/export_source.h"
#include "render/render_mesh.h"

namespace pilesim {

struct ViewLevel {
  std::vector<uint32_t> indices;  // three per triangle
  // Runs of the indices, in order: 1 + index into ViewData::pictures (0: none), and their number.
  std::vector<std::pair<uint32_t, uint32_t>> runs;
};

// A shape as the page draws it: the levels of its mesh for pictures and for shadows.
struct ViewMesh {
  std::string name;
  bool is_plane = false;
  bool is_painted = false;   // has its own colours, which a painted body shows
  bool is_textured = false;  // also has pictures
  float radius_m = 0;
  float mean_chord_m = 0;              // of RenderMesh
  std::vector<RenderVertex> vertices;  // body frame
  std::vector<ViewLevel> levels;       // 2, finer first
  size_t full_triangles = 0;           // of the original mesh
};

// Positions are steps from the body's lowest corner; a quaternion's 1 is kTurnUnits.
inline constexpr float kTurnUnits = 8191;
struct ViewKey {
  uint32_t frame = 0;
  std::array<uint16_t, 7> value = {};  // x y z; x y z w as int16
};

struct ViewTrack {
  Vec3f low = Vec3f::Zero(), high = Vec3f::Zero();   // m, bounds of its positions
  float step_m = 1;                                  // of x, y and z
  std::vector<ViewKey> keys;                         // linear in between; the first is at frame 0
  std::vector<std::pair<uint32_t, uint8_t>> states;  // state from a frame on; the first frame is 0
};

// Overlaps of bodies at measured frames.
struct ViewOverlaps {
  double diameter_m = 1;         // of the mean body
  std::vector<uint32_t> frames;  // frames of the page at which overlaps are measured, ascending
  std::vector<uint16_t> depth;   // (shown, frames): in mean diameters times kDepthUnits
};
inline constexpr float kDepthUnits = 20000;

// Measures overlaps in a frame of the trajectory: (bodies) in mean diameters.
struct OverlapMeter {
  std::function<std::vector<float>(uint64_t frame)> of;  // none: overlaps are not measured
  double diameter_m = 1;
};

struct ViewData {
  std::vector<uint32_t> shown;        // indices of ExportSource::bodies(), ascending
  std::vector<ViewTrack> tracks;      // of the shown bodies
  std::vector<ViewMesh> meshes;       // as ExportSource::shapes()
  std::vector<std::string> pictures;  // PNG, shown on bodies
  bool pictures_are_shrunk = false;
  size_t frames = 0;                                // number played
  size_t every = 1;                                 // step between them in the source
  size_t moving_bodies = 0, all_moving_bodies = 0;  // shown, and all chosen ones
  std::vector<uint32_t> moving;  // number of moving bodies at evenly spaced moments
  float fast_m_s = 1;            // upper end of the speed scale
  uint8_t states = 0;            // flags that occur
  ViewOverlaps overlaps;
  Vec3f centre = Vec3f::Zero();  // m; centre and radius of the pile for most of the time
  float radius_m = 1;
};

// Planes extend this many pile radii, and are transparent from below.
inline constexpr float kGroundReach = 9;

// Frames at which overlaps are measured: all, or as many evenly spaced ones as are affordable,
// including the last.
std::vector<uint32_t> overlap_frames(size_t frames, size_t bodies);

// Reads the source's frames twice. Takes only a sample of the bodies if there are more than
// `most_bodies`, or too many keys.
ViewData make_view_data(ExportSource& source, uint64_t most_bodies, const OverlapMeter& meter);

// Input of page_data.js, before compression. `signs`: JSON text of signs over the pile.
std::string view_bytes(const ExportSource& source, const ViewData& data, const std::string& signs);

}  // namespace pilesim

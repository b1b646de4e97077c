// The data of a page about a trajectory: its poses, quantised, as bytes that page_data.js reads.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "export/export_source.h"
#include "render/render_mesh.h"

namespace pilesim {

struct ViewLevel {
  std::vector<uint32_t> indices;  // three a triangle
  // All indices, one after another: 1 + index into ViewData::pictures, 0: none; how many.
  std::vector<std::pair<uint32_t, uint32_t>> runs;
};

// A shape as the page draws it: the levels of its mesh for pictures and for shadows.
struct ViewMesh {
  std::string name;
  bool is_plane = false;
  bool is_painted = false;   // has colours of its own, which a body shows
  bool is_textured = false;  // has pictures, too
  float radius_m = 0;
  std::vector<RenderVertex> vertices;  // body frame
  std::vector<ViewLevel> levels;       // 2, finer first
  size_t full_triangles = 0;           // of the mesh itself
};

// Poses are steps from the body's lowest place; quaternions have kTurnUnits for 1.
inline constexpr float kTurnUnits = 8191;
struct ViewKey {
  uint32_t frame = 0;
  std::array<uint16_t, 7> value = {};  // x y z; x y z w as int16
};

struct ViewTrack {
  Vec3f low = Vec3f::Zero(), high = Vec3f::Zero();   // m, of its places
  float step_m = 1;                                  // of x, y and z
  std::vector<ViewKey> keys;                         // straight in between; the first at frame 0
  std::vector<std::pair<uint32_t, uint8_t>> states;  // from a frame on; the first is 0
};

// How deep bodies are in each other, where that is measured.
struct ViewOverlaps {
  double diameter_m = 1;         // of the mean body
  std::vector<uint32_t> frames;  // of the page, at which they are measured, ascending
  std::vector<uint16_t> depth;   // (shown, frames): in mean diameters times kDepthUnits
};
inline constexpr float kDepthUnits = 20000;

// Measures them for a frame of the trajectory: (bodies of it) in mean diameters.
struct OverlapMeter {
  std::function<std::vector<float>(uint64_t frame)> of;  // none: they are not measured
  double diameter_m = 1;
};

struct ViewData {
  std::vector<uint32_t> shown;        // indices of ExportSource::bodies(), ascending
  std::vector<ViewTrack> tracks;      // of these
  std::vector<ViewMesh> meshes;       // as ExportSource::shapes()
  std::vector<std::string> pictures;  // PNG, that bodies show
  bool pictures_are_shrunk = false;
  size_t frames = 0;                                // that are played
  size_t every = 1;                                 // of the source's frames, these
  size_t moving_bodies = 0, all_moving_bodies = 0;  // shown, and chosen
  std::vector<uint32_t> moving;  // bodies that move, at moments spread evenly over the time
  float fast_m_s = 1;            // few are faster
  uint8_t states = 0;            // flags that occur
  ViewOverlaps overlaps;
  Vec3f centre = Vec3f::Zero();  // m, and radius_m: where the pile is most of the time
  float radius_m = 1;
};

// Planes reach so many radii of the pile and are not seen from there on.
inline constexpr float kGroundReach = 9;

// The frames, of so many, at which the overlaps of so many bodies are measured: all of them, or as
// many as are not too much work, evenly spread, the last one among them.
std::vector<uint32_t> overlap_frames(size_t frames, size_t bodies);

// Reads the source's frames twice. Where bodies are more than `most_bodies`, or keys would be too
// many, it takes some.
ViewData make_view_data(ExportSource& source, uint64_t most_bodies, const OverlapMeter& meter);

// For page_data.js, before compression. `signs`: JSON text of what is drawn over the pile.
std::string view_bytes(const ExportSource& source, const ViewData& data, const std::string& signs);

}  // namespace pilesim

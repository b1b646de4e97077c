// A trajectory on disk: `trajectory.zarr/`, a Zarr v2 directory store that numpy, xarray and JS
// readers open as it is. It is self-contained: shapes and colours are in it, so that it can be
// drawn on another machine. Layout:
//   .zattrs                    format, frame rate, seed, resolved scene and its hash, body names
//   position     (frame, body, 3) f4  m, centre of mass        orientation (frame, body, 4) f4  w x
//   y z state        (frame, body)    u1  flags (simulate/body_state.h) body_shape   (body) u4
//   body_colour (body, 3) u1  sRGB shapes/<i>/vertices (V, 3) f4  m, body frame
//   shapes/<i>/triangles (T, 3) u4
// Arrays over frames are cut into chunks of frames compressed with zstd. A chunk is complete or
// absent and the frame count in `.zarray` moves after the chunk is there, so a killed run leaves a
// valid shorter trajectory.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/types.h"

namespace pilesim {

struct TrajectoryShape {
  std::string name;
  bool is_plane = false;        // the half-space y <= 0 of the body; no mesh
  std::vector<Vec3f> vertices;  // (V) m, body frame
  std::vector<std::array<uint32_t, 3>> triangles;
};

struct TrajectoryHeader {
  double frame_rate = 60;  // frames a second
  uint64_t seed = 1;
  std::string resolved_scene;  // JSON text
  std::vector<TrajectoryShape> shapes;
  std::vector<std::string> body_name;               // (B)
  std::vector<uint32_t> body_shape;                 // (B) index into shapes
  std::vector<std::array<uint8_t, 3>> body_colour;  // (B) sRGB
  std::vector<uint8_t> body_moves;                  // (B) 1: dynamic or kinematic, 0: fixed

  size_t body_count() const { return body_shape.size(); }
};

struct TrajectoryFrame {
  std::vector<Vec3f> position;     // (B) m
  std::vector<Quatf> orientation;  // (B) unit
  std::vector<uint8_t> state;      // (B) flags
};

class TrajectoryWriter {
 public:
  // `directory` is `…/trajectory.zarr` and does not exist. Throws Error(io).
  TrajectoryWriter(const std::filesystem::path& directory, const TrajectoryHeader& header);
  ~TrajectoryWriter();  // closes, swallowing errors: call close() to hear of them
  TrajectoryWriter(const TrajectoryWriter&) = delete;
  TrajectoryWriter& operator=(const TrajectoryWriter&) = delete;

  // Throws Error(io), after which the frames written before are still valid on disk.
  void append(const TrajectoryFrame& frame);
  // Writes what is left of the last chunk. At most one second of wall time or one chunk of frames
  // is ever only in memory.
  void close();
  uint64_t frames_on_disk() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

class TrajectoryReader {
 public:
  // Accepts `trajectory.zarr` or the directory that holds it. Throws Error(io) or Error(input).
  explicit TrajectoryReader(const std::filesystem::path& directory);
  ~TrajectoryReader();
  TrajectoryReader(const TrajectoryReader&) = delete;
  TrajectoryReader& operator=(const TrajectoryReader&) = delete;

  const TrajectoryHeader& header() const;
  uint64_t frame_count() const;
  // `index` < frame_count(). Keeps the last chunk decoded: reading in order is cheap.
  void read(uint64_t index, TrajectoryFrame& frame);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace pilesim

// A trajectory on disk: `trajectory.zarr/`, a Zarr v2 directory store that numpy, xarray and JS
// readers open directly (docs/files.md describes it for users). It is self-contained: shapes
// and colours are in it, so that it can be drawn on another machine. Layout:
//   .zattrs                           format, axes, frame rate, seed, resolved scene and its hash,
//                                     names of bodies and materials, shapes
//   position     (frame, body, 3) f8  m, centre of mass, world frame
//   orientation  (frame, body, 4) f4  unit quaternion w x y z, body to world
//   state        (frame, body)    u1  BodyFlag bits (core/body_flags.h)
//   body_shape   (body)           u4  index into shapes
//   body_material (body)          u4  index into materials
//   body_colour  (body, 3)        u1  sRGB
//   body_painted (body)           u1  1: drawn in the colours of its shape; if any is
//   body_gloss   (body, 2)        f4  roughness and clear coat; if any differs from the default
//   body_substance (body, 3)      f4  metallic, transmission, emission; if any is not 0
//   body_pattern (body, 2)        f4  number of its pattern, and its length, m; if any has one
//   body_moves   (body)           u1  1: dynamic or kinematic, 0: fixed
//   shapes/<i>/vertices  (V, 3)   f4  m, body frame
//   shapes/<i>/triangles (T, 3)   u4
//   shapes/<i>/colours   (T, 3)   u1  sRGB; if its file has them
//   shapes/<i>/texture   (T)      u4  1 + index into textures, 0: none; if it has one
//   shapes/<i>/uv     (T, 3, 2)   f4  texture coordinates: to the right and downward, in [0, 1]
//   textures/<k>      (rows, columns, 3) u1  sRGB, rows from top to bottom; .zattrs has their sizes
// Arrays over frames are divided into chunks of frames compressed with zstd. A chunk is complete or
// absent and the frame count in `.zarray` moves after the chunk is there, so a killed run leaves a
// valid shorter trajectory. The same frames always give the same files.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/body_flags.h"
#include "core/colour.h"
#include "core/round_surface.h"
#include "core/texture.h"
#include "core/types.h"

namespace pilesim {

struct TrajectoryShape {
  std::string name;
  bool is_plane = false;        // the half-space y <= 0 of the body; no mesh
  std::vector<Vec3f> vertices;  // (V) m, body frame
  std::vector<std::array<uint32_t, 3>> triangles;
  std::vector<Colour> colours;      // (T) from its file, for painted bodies; or empty
  TextureMap texture_map;           // texture used instead of colours
  std::vector<RoundSurface> round;  // what triangles stand for; disjoint, ascending ranges of them
  // From the shape's own frame, that of its mesh file or primitive, to the body frame: a point f of
  // the file becomes scale * f - centre_of_mass; if the file's z is up, f is (x, z, -y) of it.
  std::string type;                    // "mesh", "box", ... as in the scene
  std::string file;                    // as named in the scene; empty: no mesh file
  double scale = 1;                    // m per unit of the file
  bool is_z_up = false;                // up axis of the file
  Vec3 centre_of_mass = Vec3::Zero();  // m, the shape's own frame
  // Rotates the principal axes of inertia to the body's axes.
  Quat principal_axes{Quat::Identity()};
};

struct TrajectoryHeader {
  double frame_rate = 60;  // frames per second
  uint64_t seed = 1;
  std::string resolved_scene;  // JSON text
  std::string scene_hash;      // of the scene and its files
  std::vector<TrajectoryShape> shapes;
  std::vector<std::string> body_name;   // (B)
  std::vector<std::string> materials;   // names
  std::vector<uint32_t> body_shape;     // (B) index into shapes
  std::vector<uint32_t> body_material;  // (B) index into materials
  std::vector<Colour> body_colour;      // (B)
  std::vector<uint8_t> body_painted;    // (B) 1: drawn in its shape's own colours
  // (B) roughness and clear coat, [0, 1]. Empty: all defaults, or an older file.
  std::vector<std::array<float, 2>> body_gloss;
  // (B) metallic and transmission, [0, 1], and emission, >= 0; empty: all are 0.
  std::vector<std::array<float, 3>> body_substance;
  // (B) Pattern of scene.h, and its length, m, > 0; empty: none has one.
  std::vector<std::array<float, 2>> body_pattern;
  std::vector<uint8_t> body_moves;  // (B) 1: dynamic or kinematic, 0: fixed

  size_t body_count() const { return body_shape.size(); }
};

struct TrajectoryFrame {
  std::vector<Vec3> position;      // (B) m, world
  std::vector<Quatf> orientation;  // (B) unit
  std::vector<uint8_t> state;      // (B) BodyFlag bits
};

class TrajectoryWriter {
 public:
  // `directory` is `…/trajectory.zarr` and must not exist; missing parents are created. It then
  // holds a trajectory without frames. `header` must be consistent: resolved_scene is a JSON
  // object, the body arrays have equal lengths, indices are in range. Throws Error(io).
  TrajectoryWriter(const std::filesystem::path& directory, const TrajectoryHeader& header,
                   double longest_in_memory_s = 1);
  // Continues a trajectory with this header after its first `frames` frames, and discards later
  // ones. Throws Error(input) if it has fewer frames or another number of bodies.
  TrajectoryWriter(const std::filesystem::path& directory, uint64_t frames,
                   const TrajectoryHeader& header, double longest_in_memory_s = 1);
  ~TrajectoryWriter();  // closes and swallows errors: call close() to receive them
  TrajectoryWriter(const TrajectoryWriter&) = delete;
  TrajectoryWriter& operator=(const TrajectoryWriter&) = delete;

  // Adds the next frame, with positions rounded to less than a ten-millionth of the body's size.
  // Writes to disk when the chunk is full or the last write was `longest_in_memory_s` ago, so a
  // kill loses only the frames of that time. Throws Error(io); earlier frames remain valid on disk.
  void append(const TrajectoryFrame& frame);
  // Writes all frames that are not yet on disk. Throws Error(io).
  void flush();
  void close() { flush(); }
  // Number of frames that a reader would find if the process were killed now.
  uint64_t frames_on_disk() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

class TrajectoryReader {
 public:
  // Accepts `trajectory.zarr` or the directory that contains it. The trajectory may still grow:
  // frame_count() is the number at the time of the call. Throws Error(io), or Error(input) naming
  // the file that is missing, corrupt or of another format.
  explicit TrajectoryReader(const std::filesystem::path& directory);
  ~TrajectoryReader();
  TrajectoryReader(const TrajectoryReader&) = delete;
  TrajectoryReader& operator=(const TrajectoryReader&) = delete;

  // resolved_scene is the JSON value as written, possibly with other indentation.
  const TrajectoryHeader& header() const;
  uint64_t frame_count() const;
  // `index` < frame_count(). Keeps the last chunk decoded, so reading in order is cheap. Throws as
  // the constructor does. Not thread-safe.
  void read(uint64_t index, TrajectoryFrame& frame);
  // Reports bodies with 1 as absent from now on. One value per body; empty: hide none.
  void hide(std::vector<uint8_t> bodies);
  const std::vector<uint8_t>& hidden() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace pilesim

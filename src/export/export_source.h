// The source of all formats: the chosen bodies and frames of a trajectory, one frame after another.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/colour.h"
#include "export/export_mesh.h"
#include "scene/scene.h"
#include "trajectory/trajectory.h"

namespace pilesim {

// How a body looks: bodies that share shape and look can share a mesh with its material.
struct ExportLook {
  std::string name;  // "wood d66b4e": of the material and the colour; "wood d66b4e painted"
  Colour colour;
  bool is_painted = false;              // in the colours of its mesh; `colour` is a mean of them
  float roughness = 0, clear_coat = 0;  // [0, 1], as Material has them; planes are matt
};

struct ExportBody {
  std::string name;
  uint32_t id = 0;     // index in the trajectory
  uint32_t shape = 0;  // index into shapes()
  uint32_t look = 0;   // index into looks()
  // Among the exported frames, counted from 0: up to the first and from the last one on it keeps
  // its pose and stays, or stays away. The same: it never changes.
  uint32_t first_change = 0, last_change = 0;
  bool starts_present = true, ever_absent = false;
};

struct ExportChoice {
  std::vector<uint64_t> frames;   // of the trajectory, ascending, at least one
  std::vector<std::string> only;  // shell patterns of names; empty: all bodies
  Camera camera;                  // without keys: none
};

class ExportSource {
 public:
  // Reads the chosen frames once. Throws Error(usage) where a pattern of `only` fits no body, and
  // as the reader does. `trajectory` outlives it.
  ExportSource(TrajectoryReader& trajectory, ExportChoice choice);

  const TrajectoryHeader& header() const { return trajectory_.header(); }
  // Those that are there in one of the frames, ordered by shape, then look, then id.
  const std::vector<ExportBody>& bodies() const { return bodies_; }
  const std::vector<ExportMesh>& shapes() const { return shapes_; }  // as header().shapes
  const std::vector<ExportLook>& looks() const { return looks_; }
  size_t frame_count() const { return choice_.frames.size(); }
  uint64_t frame(size_t k) const { return choice_.frames[k]; }  // of the trajectory
  double time_s(size_t k) const { return static_cast<double>(frame(k)) / header().frame_rate; }
  bool has_camera() const { return !choice_.camera.keys.empty(); }
  bool camera_moves() const { return choice_.camera.keys.size() > 1; }
  CameraKey camera(size_t k) const;
  // Where positions in single precision count from, m, world: 0 but for a pile that is far from
  // there.
  const Vec3& origin() const { return origin_; }
  Vec3f from_origin(const Vec3& world) const { return (world - origin_).cast<float>(); }
  // The place of bodies()[body], from the origin; for a plane far from there, its nearest point.
  Vec3f place(const TrajectoryFrame& poses, size_t body) const;
  // Holds all bodies in all frames, m, from the origin.
  const Eigen::AlignedBox3f& bounds() const { return bounds_; }

  // bodies() in the k-th frame, world. When frames are read in order each quaternion has the sign
  // that is nearer to the one before.
  void read(size_t k, TrajectoryFrame& poses);

 private:
  void choose_bodies();
  void find_changes();

  TrajectoryReader& trajectory_;
  ExportChoice choice_;
  std::vector<ExportBody> bodies_;
  std::vector<ExportMesh> shapes_;
  std::vector<ExportLook> looks_;
  Vec3 origin_ = Vec3::Zero();
  Eigen::AlignedBox3f bounds_;
  TrajectoryFrame whole_;    // scratch: the frame with all bodies
  std::vector<Quatf> last_;  // (bodies) orientations that were read last
};

// The motion of one body as keys with straight lines in between: none where it follows from its
// neighbours.
struct ExportTrack {
  std::vector<uint32_t> key;    // frames, counted from 0; the first is 0
  std::vector<Vec3f> position;  // m, from the source's origin
  std::vector<Quatf> orientation;
  std::vector<uint32_t> toggles;  // frames in which it appears or vanishes
};

// Tracks of all bodies; holds the motion in memory.
std::vector<ExportTrack> read_tracks(ExportSource& source);

// World from camera, which looks along its -z with y up.
Quat camera_orientation(const CameraKey& camera);

}  // namespace pilesim

// The source of all formats: the chosen bodies and frames of a trajectory, frame by frame.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/colour.h"
#include "export/export_mesh.h"
#include "scene/scene.h"
#include "trajectory/trajectory.h"

namespace pilesim {

// The appearance of a body: bodies with the same shape and look can share a mesh and its material.
struct ExportLook {
  std::string name;  // material and colour, "wood d66b4e", or "wood d66b4e painted"
  Colour colour;
  bool is_painted = false;              // in the colours of its mesh; `colour` is their mean
  float roughness = 0, clear_coat = 0;  // [0, 1], as in Look; planes are matt
  float metallic = 0, transmission = 0, emission = 0;
};

struct ExportBody {
  std::string name;
  uint32_t id = 0;     // index in the trajectory
  uint32_t shape = 0;  // index into shapes()
  uint32_t look = 0;   // index into looks()
  // Exported frames, counted from 0: up to the first and from the second on, its pose and presence
  // are constant. Equal: it never changes.
  uint32_t first_change = 0, last_change = 0;
  bool starts_present = true, ever_absent = false;
};

struct ExportChoice {
  std::vector<uint64_t> frames;   // of the trajectory, ascending, at least one
  std::vector<std::string> only;  // shell patterns for names; empty: all bodies
  Camera camera;                  // none if it has no keys
};

class ExportSource {
 public:
  // Reads the chosen frames once. Throws Error(usage) if a pattern of `only` fits no body, and as
  // the reader does. `trajectory` must outlive it.
  ExportSource(TrajectoryReader& trajectory, ExportChoice choice);

  const TrajectoryHeader& header() const { return trajectory_.header(); }
  // Bodies present in any of the frames, ordered by shape, then look, then id.
  const std::vector<ExportBody>& bodies() const { return bodies_; }
  const std::vector<ExportMesh>& shapes() const { return shapes_; }  // as header().shapes
  const std::vector<ExportLook>& looks() const { return looks_; }
  size_t frame_count() const { return choice_.frames.size(); }
  uint64_t frame(size_t k) const { return choice_.frames[k]; }  // of the trajectory
  double time_s(size_t k) const { return static_cast<double>(frame(k)) / header().frame_rate; }
  bool has_camera() const { return !choice_.camera.keys.empty(); }
  bool camera_moves() const { return choice_.camera.keys.size() > 1; }
  CameraKey camera(size_t k) const;
  // Origin of single-precision positions, m, world: 0 unless the pile is far away.
  const Vec3& origin() const { return origin_; }
  Vec3f from_origin(const Vec3& world) const { return (world - origin_).cast<float>(); }
  // Position of bodies()[body] from the origin; for a distant plane, its point nearest to the
  // origin.
  Vec3f place(const TrajectoryFrame& poses, size_t body) const;
  // Bounds of all bodies in all frames, m, from the origin.
  const Eigen::AlignedBox3f& bounds() const { return bounds_; }

  // The poses of bodies() in the k-th frame, world. When frames are read in order, each quaternion
  // has the sign nearer to its predecessor.
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
  std::vector<Quatf> last_;  // (bodies) orientations of the last read
};

// The motion of one body as keys with linear interpolation; keys that follow from their neighbours
// are left out.
struct ExportTrack {
  std::vector<uint32_t> key;    // frames, counted from 0; the first is 0
  std::vector<Vec3f> position;  // m, from the source's origin
  std::vector<Quatf> orientation;
  std::vector<uint32_t> toggles;  // frames in which it appears or vanishes
};

// Tracks of all bodies; holds the whole motion in memory.
std::vector<ExportTrack> read_tracks(ExportSource& source);

// Camera to world; the camera looks along its -z with y up.
Quat camera_orientation(const CameraKey& camera);

}  // namespace pilesim

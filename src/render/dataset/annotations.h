// The annotations of a picture in a dataset.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "render/pass_images.h"
#include "render/pinhole.h"
#include "render/rays/ray_hits.h"
#include "trajectory/trajectory.h"

namespace pilesim {

// Depth as whole numbers: 0 where nothing is, or where it is farther than they reach.
struct DepthImage {
  double unit_mm = 1;
  std::vector<uint16_t> values;  // (height, width)
};

// In the unit of depth_unit_mm().
DepthImage depth_image(const PassImages& images, double unit_mm);

// A body that is told of: one that moves and would cover at least a pixel of the picture alone.
struct AnnotatedBody {
  size_t body = 0;  // of the trajectory
  BodyVisibility visibility;
  Silhouette alone;
};

struct AnnotatedFrame {
  uint64_t frame = 0;             // of the trajectory
  std::filesystem::path picture;  // its PNG
  const Pinhole& camera;
  const TrajectoryFrame& poses;
  const PassImages& images;
  const DepthImage& depth;
  std::vector<AnnotatedBody> bodies;
};

class AnnotationWriter {
 public:
  virtual ~AnnotationWriter() = default;
  // Frames come in ascending order. Throws Error(io).
  virtual void add(const AnnotatedFrame& frame) = 0;
  // Writes what is told of all frames at once. Throws Error(io).
  virtual void finish() = 0;
};

// Shapes that bodies have which move: what can be told apart in the dataset. Indices of the
// trajectory's shapes, ascending.
std::vector<size_t> annotated_shapes(const TrajectoryHeader& header);

}  // namespace pilesim

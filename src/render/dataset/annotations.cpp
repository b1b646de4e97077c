#include "render/dataset/annotations.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

namespace pilesim {
DepthImage depth_image(const PassImages& images, double unit_mm) {
  DepthImage image{.unit_mm = unit_mm};
  image.values.reserve(images.depth.size());
  for (const float depth_m : images.depth) {
    const double units = 1000 * static_cast<double>(depth_m) / image.unit_mm;
    const bool fits = units < std::numeric_limits<uint16_t>::max();
    image.values.push_back(fits ? static_cast<uint16_t>(std::lround(units)) : uint16_t{0});
  }
  return image;
}

std::vector<size_t> annotated_shapes(const TrajectoryHeader& header) {
  std::set<size_t> shapes;
  for (size_t body = 0; body < header.body_count(); ++body) {
    const uint32_t shape = header.body_shape[body];
    if (header.body_moves[body] != 0 && !header.shapes[shape].is_plane) shapes.insert(shape);
  }
  return {shapes.begin(), shapes.end()};
}

}  // namespace pilesim

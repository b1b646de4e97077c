// Lines between bodies, drawn over pictures: glue and forces, as thick as they are strong.
#pragma once

#include <cstdint>
#include <span>

#include "render/scene_renderer.h"
#include "scene/scene.h"
#include "trajectory/guide_file.h"

namespace pilesim {

// sRGB from 0 to 255.
inline const Eigen::Vector3f kPullColour(214, 40, 24), kPushColour(24, 44, 120);

// Those of `lines` that are there at the end of a frame, by the times in `guide`, in that order, of
// bodies that are present; from the centre of one body over the place of the line to the centre of
// the other, or but to that place where the other stands. Their section is as large as they are
// strong, by one measure for all. In kPullColour; `push_apart`: those of weights > 0 in
// kPushColour.
void draw_pair_lines(const GuideFile& guide, std::span<const PairLine> lines, bool push_apart,
                     uint64_t index, const TrajectoryFrame& frame, const CameraKey& camera,
                     Image& image);

}  // namespace pilesim

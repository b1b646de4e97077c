// A body in several poses on a plane, a picture each, side by side.
#pragma once

#include <span>
#include <string>

#include "geometry/mesh.h"
#include "render/scene_renderer.h"

namespace pilesim {

struct LabelledPose {
  Vec3 up = Vec3::UnitY();  // unit, the mesh's axes: the plane's normal
  double height_m = 0;      // of the centre of mass over the plane
  std::string label;        // ASCII
};

// `poses`: at least one. Throws like SceneRenderer.
Image draw_pose_sheet(const TriangleMesh& mesh, const Vec3& centre_of_mass,
                      std::span<const LabelledPose> poses);

}  // namespace pilesim

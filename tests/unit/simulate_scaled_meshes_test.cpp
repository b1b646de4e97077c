// Meshes that are mirrored and stretched collide where they are drawn.

#include <gtest/gtest.h>

#include "geometry/obj_writer.h"
#include "support/geometry_concave_shapes.h"
#include "support/scene_run.h"
#include "support/scratch_directory.h"

namespace pilesim {
namespace {

// An L: 2 wide and 1 high, its left half 2 high; 1 deep.
class ScaledMesh : public test::SceneRun {
 protected:
  static constexpr double kRadius = 0.05;

  ScaledMesh() {
    setenv("XDG_CACHE_HOME", directory_.path().c_str(), 1);
    write_obj(test::l_shape_mesh(), directory_ / "l.obj");
    scene_.materials["stuff"] = {0, 0.5, 1000};
    scene_.shapes["ball"] = SphereShape{kRadius};
  }

  void add(const std::string& shape, const Vec3& position, Role role = Role::dynamic) {
    Body body{
        .name = shape + std::to_string(scene_.bodies.size()), .shape = shape, .material = "stuff"};
    body.pose.position = position;
    body.role = role;
    scene_.bodies.push_back(body);
  }

  test::ScratchDirectory directory_;
};

TEST_F(ScaledMesh, BallsComeToRestOnBothSteps) {
  for (const CollisionKind collision : {CollisionKind::mesh, CollisionKind::decomposition}) {
    for (const Vec3& scale : {Vec3(1, 1, 1), Vec3(-1, 2, 1), Vec3(2, 0.5, -1), Vec3(-1, -1, 1)}) {
      SCOPED_TRACE(testing::Message() << static_cast<int>(collision) << ": " << scale.transpose());
      scene_.bodies.clear();
      MeshShape mesh{.file = directory_ / "l.obj"};
      mesh.scale = scale;
      mesh.collision = collision;
      scene_.shapes["l"] = mesh;
      add("l", Vec3::Zero(), Role::fixed);
      // Upside down its base is the top, and level.
      const bool is_upright = scale.y() > 0;
      const double low = is_upright ? scale.y() : 0, high = is_upright ? 2 * scale.y() : 0;
      add("ball", {1.5 * scale.x(), low + 2 * kRadius, 0.5 * scale.z()});
      add("ball", {0.5 * scale.x(), high + 2 * kRadius, 0.5 * scale.z()});
      start();
      run(60);
      EXPECT_NEAR(states().position[1].y(), low + kRadius, 1e-3 * kRadius);
      EXPECT_NEAR(states().position[2].y(), high + kRadius, 1e-3 * kRadius);
    }
  }
}

}  // namespace
}  // namespace pilesim

// Shapes scaled by three numbers, and mirrored: volume, inertia and surfaces by closed form.
#include <gmock/gmock.h>

#include <cstdlib>

#include "core/error.h"
#include "geometry/mass_properties.h"
#include "geometry/mesh_check.h"
#include "geometry/obj_writer.h"
#include "geometry/primitives.h"
#include "model/model.h"
#include "scene/scene_loader.h"
#include "support/scratch_directory.h"

namespace pilesim {
namespace {

using ::testing::HasSubstr;

class ScaledShape : public ::testing::Test {
 protected:
  ScaledShape() {
    setenv("XDG_CACHE_HOME", directory_.path().c_str(), 1);
    // A box of 1 x 2 x 3 with its centre at (10, 0, 0), and an asymmetric tetrahedron.
    TriangleMesh box = box_mesh({1, 2, 3});
    for (Vec3& vertex : box.vertices) vertex += Vec3(10, 0, 0);
    write_obj(box, directory_ / "box.obj");
    TriangleMesh corner;
    corner.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 2, 0}, {0, 0, 3}};
    corner.triangles = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
    write_obj(corner, directory_ / "corner.obj");
  }

  ModelShape build(const std::string& shape) {
    const std::string text = R"({"version": 1, "materials": {"m": {}}, "shapes": {"s": )" + shape +
                             R"(}, "bodies": [{"shape": "s", "material": "m"}]})";
    return build_model(parse_scene(text, directory_ / "scene.json").scene).shapes[0];
  }

  std::string failure(const std::string& shape) {
    try {
      build(shape);
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  }

  test::ScratchDirectory directory_;
};

// A solid of unit density about its centre of mass.
void expect_mass(const ModelShape& shape, const MassProperties& wanted) {
  EXPECT_NEAR(shape.mass.volume_m3, wanted.volume_m3, 1e-6 * wanted.volume_m3);
  EXPECT_LT((shape.mass.inertia_m5 - wanted.inertia_m5).norm(), 1e-5 * wanted.inertia_m5.norm());
  // From its drawn surface: a triangle facing inward would reduce it.
  EXPECT_NEAR(mass_properties(shape.mesh).volume_m3, wanted.volume_m3, 1e-5 * wanted.volume_m3);
  EXPECT_TRUE(find_mesh_defects(shape.mesh).empty());
}

TEST_F(ScaledShape, ABoxHasTheMassOfItsEdges) {
  for (const char* scale : {"[2, 1, 0.5]", "[-2, 1, -0.5]", "[2, -1, 0.5]"}) {
    SCOPED_TRACE(scale);
    const std::string tail = R"(, "scale": )" + std::string(scale) + "}";
    const MassProperties wanted = box_mass_properties({2, 2, 1.5});
    const ModelShape box = build(R"({"type": "box", "size": [1, 2, 3])" + tail);
    expect_mass(box, wanted);
    EXPECT_EQ(box.pieces.at(0).kind, CollisionPiece::Kind::box);
    const ModelShape mesh = build(R"({"type": "mesh", "file": "box.obj")" + tail);
    expect_mass(mesh, wanted);
    EXPECT_EQ(mesh.pieces.at(0).kind, CollisionPiece::Kind::box);
    EXPECT_NEAR(std::abs(mesh.origin_offset.x()), 20, 1e-5);
  }
}

TEST_F(ScaledShape, BallsAndCylindersStayRound) {
  EXPECT_NEAR(build(R"({"type": "sphere", "radius": 1, "scale": [2, -2, 2]})").mass.volume_m3,
              sphere_mass_properties(2).volume_m3, 1e-9);
  EXPECT_NEAR(build(R"({"type": "sphere", "radius": 1, "scale": 0.5})").mass.volume_m3,
              sphere_mass_properties(0.5).volume_m3, 1e-9);
  expect_mass(build(R"({"type": "box", "size": [1, 1, 1], "scale": 2})"),
              box_mass_properties({2, 2, 2}));
  EXPECT_NEAR(build(R"({"type": "cylinder", "radius": 1, "height": 2, "scale": [2, 3, -2]})")
                  .mass.volume_m3,
              cylinder_mass_properties(2, 6).volume_m3, 1e-9);
  EXPECT_THAT(failure(R"({"type": "sphere", "radius": 1, "scale": [1, 2, 1]})"),
              HasSubstr("a stretched sphere is none"));
  EXPECT_THAT(failure(R"({"type": "cylinder", "radius": 1, "height": 1, "scale": [1, 1, 2]})"),
              HasSubstr("round about y"));
  EXPECT_THAT(failure(R"({"type": "mesh", "file": "box.obj", "scale": [1, 0, 2]})"),
              HasSubstr("/shapes/s/scale: has a 0"));
  EXPECT_THAT(failure(R"({"type": "mesh", "file": "box.obj", "scale": 0})"),
              HasSubstr("/shapes/s/scale: is 0; expected a number other than 0, or three of them"));
}

// The mirror image has the same volume, and products of inertia with one mirrored axis change sign.
TEST_F(ScaledShape, AMirroredMeshIsASolid) {
  const ModelShape plain = build(R"({"type": "mesh", "file": "corner.obj", "scale": [1, 2, 0.5]})");
  EXPECT_NEAR(plain.mass.volume_m3, 1, 1e-6);
  for (const Vec3& sides : {Vec3(-1, 1, 1), Vec3(1, -1, 1), Vec3(-1, 1, -1), Vec3(-1, -1, -1)}) {
    const Vec3 scale = sides.cwiseProduct(Vec3(1, 2, 0.5));
    SCOPED_TRACE(testing::Message() << scale.transpose());
    const auto number = [&](int k) { return std::to_string(scale[k]); };
    const ModelShape shape = build(R"({"type": "mesh", "file": "corner.obj", "scale": [)" +
                                   number(0) + ", " + number(1) + ", " + number(2) + "]}");
    MassProperties wanted = plain.mass;
    wanted.inertia_m5 = sides.asDiagonal() * plain.mass.inertia_m5 * sides.asDiagonal();
    expect_mass(shape, wanted);
    EXPECT_LT((shape.origin_offset - sides.cwiseProduct(plain.origin_offset)).norm(), 1e-6);
    const TriangleMesh& hull = shape.pieces.at(0).hull;
    EXPECT_NEAR(mass_properties(hull).volume_m3, 1, 1e-5);
  }
}

TEST_F(ScaledShape, OneNegativeNumberMirrorsAlongAllAxes) {
  const ModelShape one = build(R"({"type": "mesh", "file": "corner.obj", "scale": -2})");
  const ModelShape three =
      build(R"({"type": "mesh", "file": "corner.obj", "scale": [-2, -2, -2]})");
  EXPECT_GT(one.mass.volume_m3, 0);
  EXPECT_EQ(one.mass.inertia_m5, three.mass.inertia_m5);
  EXPECT_EQ(one.mesh.vertices, three.mesh.vertices);
  expect_mass(build(R"({"type": "box", "size": [1, 1, 1], "scale": -2})"),
              box_mass_properties({2, 2, 2}));
}

// Along the file's own axes, whichever points up.
TEST_F(ScaledShape, ScalesBeforeTheFileIsTurnedUp) {
  const ModelShape shape =
      build(R"({"type": "mesh", "file": "box.obj", "scale": [1, 1, 2], "up": "z"})");
  EXPECT_LT((shape.mesh.bounds().sizes() - Vec3(1, 6, 2)).norm(), 1e-5);
}

TEST_F(ScaledShape, TheResolvedSceneKeepsIt) {
  const std::string text =
      R"({"version": 1, "materials": {"m": {}}, "shapes": {
          "a": {"type": "mesh", "file": "box.obj", "scale": [1, -2, 0.5]},
          "b": {"type": "mesh", "file": "box.obj", "scale": [2, 2, 2]},
          "c": {"type": "box", "size": [1, 2, 3], "scale": [2, -1, 1]}}, "bodies": []})";
  const std::string resolved = parse_scene(text, directory_ / "scene.json").resolved;
  const Scene again = parse_scene(resolved, directory_ / "scene.json").scene;
  EXPECT_EQ(std::get<MeshShape>(again.shapes.at("a")).scale, Vec3(1, -2, 0.5));
  EXPECT_EQ(std::get<MeshShape>(again.shapes.at("b")).scale, Vec3(2, 2, 2));
  EXPECT_EQ(std::get<BoxShape>(again.shapes.at("c")).size, Vec3(2, 2, 3));
}

}  // namespace
}  // namespace pilesim

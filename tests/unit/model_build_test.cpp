#include "model/model.h"

#include <gmock/gmock.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>

#include "geometry/convex_hull.h"
#include "geometry/mass_properties.h"
#include "geometry/mesh_check.h"
#include "geometry/obj_writer.h"
#include "geometry/primitives.h"
#include "scene_test_support.h"

namespace pilesim {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

constexpr double kRounding = 1e-6;  // OBJ files hold floats

// Scenes beside meshes in their own directory; decompositions are cached there too.
class SceneModel : public ::testing::Test {
 protected:
  void SetUp() override {
    directory_ = std::filesystem::path(::testing::TempDir()) /
                 ("pilesim_model_" +
                  std::string(::testing::UnitTest::GetInstance()->current_test_info()->name()));
    std::filesystem::remove_all(directory_);
    std::filesystem::create_directories(directory_);
    setenv("XDG_CACHE_HOME", (directory_ / "cache").c_str(), 1);
    // A box of 1 x 2 x 3 whose centre is at (10, 0, 0).
    TriangleMesh box = box_mesh({1, 2, 3});
    for (Vec3& vertex : box.vertices) vertex += Vec3(10, 0, 0);
    write_obj(box, directory_ / "box.obj");
    box.triangles.pop_back();
    write_obj(box, directory_ / "open.obj");
  }
  void TearDown() override { std::filesystem::remove_all(directory_); }

  // The model of a scene with the given shapes, and other keys in `entries`.
  Model build(const std::string& shapes, const std::string& entries = "\"bodies\": []") {
    const std::string text = R"({"version": 1, "materials": {"m": {"density_kg_m3": 500}},
      "shapes": {)" + shapes +
                             "}, " + entries + "}";
    return build_model(parse_scene(text, directory_ / "scene.json").scene);
  }

  std::string failure(const std::string& shapes) {
    try {
      build(shapes);
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  }

  std::filesystem::path directory_;
};

TEST_F(SceneModel, BodyFramesAreAtTheCentreOfMass) {
  const Model model = build(R"("box": {"type": "mesh", "file": "box.obj"})", R"("bodies": [
    {"shape": "box", "material": "m", "position": [0, 5, 0], "rotation_deg": [0, 90, 0]}])");
  const ModelShape& shape = model.shapes[0];
  EXPECT_NEAR((shape.origin_offset - Vec3(10, 0, 0)).norm(), 0, kRounding);
  EXPECT_NEAR(shape.mesh.bounds().center().norm(), 0, kRounding);
  EXPECT_EQ(shape.pieces.at(0).kind, CollisionPiece::Kind::box);
  EXPECT_NEAR(shape.pieces.at(0).pose.position.norm(), 0, kRounding);
  EXPECT_NEAR(shape.mass.volume_m3, 6, kRounding);
  EXPECT_NEAR(shape.mass.inertia_m5(0, 0), 6.0 / 12 * (4 + 9), 1e-5);
  EXPECT_NEAR(shape.bounding_radius, std::sqrt(1 + 4 + 9) / 2, kRounding);
  EXPECT_NEAR(shape.smallest_extent, 1, kRounding);
  // The file's frame is at (0, 5, 0): its point (10, 0, 0) is at -10 z after a quarter turn.
  EXPECT_NEAR((model.bodies[0].pose.position - Vec3(0, 5, -10)).norm(), 0, 1e-5);
  EXPECT_NEAR(model.bodies[0].mass_kg, 3000, 1e-2);
}

TEST_F(SceneModel, PrimitivesAreExact) {
  const Model model = build(R"("box": {"type": "box", "size": [1, 2, 3]},
    "can": {"type": "cylinder", "radius": 0.5, "height": 2},
    "orb": {"type": "sphere", "radius": 2},
    "plane": {"type": "plane"})",
                            R"("bodies": [{"shape": "box", "material": "m"},
    {"shape": "plane", "material": "m", "role": "static"}])");
  ASSERT_EQ(model.shapes.size(), 4u);
  EXPECT_DOUBLE_EQ(model.bodies[0].mass_kg, 3000);
  EXPECT_EQ(model.bodies[1].mass_kg, 0);
  EXPECT_EQ(model.shapes[0].pieces[0].kind, CollisionPiece::Kind::box);
  EXPECT_EQ(model.shapes[0].pieces[0].size, Vec3(1, 2, 3));
  EXPECT_EQ(model.shapes[1].pieces[0].round.bottom, 0.5);
  EXPECT_EQ(model.shapes[1].pieces[0].round.top, 0.5);
  EXPECT_EQ(model.shapes[1].pieces[0].round.height, 2);
  EXPECT_DOUBLE_EQ(model.shapes[1].mass.volume_m3, kPi / 2);
  EXPECT_EQ(model.shapes[2].pieces[0].size, Vec3(2, 2, 2));
  EXPECT_NEAR(model.shapes[2].bounding_radius, 2, 1e-12);
  EXPECT_TRUE(model.shapes[3].is_plane);
  EXPECT_TRUE(model.shapes[3].pieces.empty());
}

TEST_F(SceneModel, ScaleActsOnLengths) {
  const Model model = build(R"("box": {"type": "mesh", "file": "box.obj", "scale": 0.1})");
  EXPECT_NEAR(model.shapes[0].mass.volume_m3, 0.006, 1e-8);
  EXPECT_NEAR(model.shapes[0].origin_offset.x(), 1, kRounding);
}

TEST_F(SceneModel, EachCollisionKindHasItsPieces) {
  const std::string mesh = R"("type": "mesh", "file": "box.obj", "collision": )";
  const Model model = build("\"a_hull\": {" + mesh + "\"hull\"}, \"b_sphere\": {" + mesh +
                            "\"sphere\"}, \"c_spheres\": {" + mesh +
                            "\"spheres\", \"sphere_count\": 3}, \"d_mesh\": {" + mesh +
                            "\"mesh\"}, \"e_pieces\": {" + mesh + "\"decomposition\"}");
  const ModelShape& hull = model.shapes[0];
  ASSERT_EQ(hull.pieces.size(), 1u);
  EXPECT_EQ(hull.pieces[0].hull.vertices.size(), 8u);
  EXPECT_THAT(hull.collision_report, HasSubstr("hull: 1 piece of 8 vertices, volume error 0.0 %"));
  const ModelShape& sphere = model.shapes[1];
  ASSERT_EQ(sphere.pieces.size(), 1u);
  EXPECT_NEAR(4 * kPi / 3 * std::pow(sphere.pieces[0].size.x(), 3), 6, 1e-5);
  EXPECT_NEAR(sphere.pieces[0].pose.position.norm(), 0, kRounding);
  const ModelShape& spheres = model.shapes[2];
  EXPECT_EQ(spheres.pieces.size(), 3u);
  for (const CollisionPiece& piece : spheres.pieces) {
    EXPECT_LT(piece.pose.position.cwiseAbs().maxCoeff(), 1.6);  // in the body frame
  }
  const ModelShape& surface = model.shapes[3];
  EXPECT_TRUE(surface.collides_as_mesh);
  EXPECT_TRUE(surface.pieces.empty());
  const ModelShape& pieces = model.shapes[4];
  ASSERT_EQ(pieces.pieces.size(), 1u);  // it is convex
  EXPECT_THAT(pieces.collision_report, HasSubstr("decomposition: 1 piece"));
}

// A recognised primitive is its own collision shape; its mass stays the mesh's.
TEST_F(SceneModel, MeshesThatArePrimitivesCollideAsThese) {
  const Pose pose{{3, -1, 2}, Quat(Eigen::AngleAxisd(0.7, Vec3(1, 2, 3).normalized()))};
  const auto write = [&](TriangleMesh mesh, const char* name) {
    for (Vec3& vertex : mesh.vertices) vertex = pose.apply(vertex);
    write_obj(mesh, directory_ / name);
    return mass_properties(mesh);
  };
  // A capsule along y: the hull of two separate balls.
  TriangleMesh capsule = sphere_mesh(0.2, 4);
  for (Vec3& vertex : capsule.vertices) vertex.y() += vertex.y() > 0 ? 0.3 : -0.3;
  std::vector<Vec3> points = capsule.vertices;
  for (int i = 0; i < 64; ++i) {
    const double angle = 2 * kPi * i / 64;
    for (const double y : {-0.3, 0.3}) {
      points.emplace_back(0.2 * std::cos(angle), y, 0.2 * std::sin(angle));
    }
  }
  const MassProperties ball = write(sphere_mesh(0.1, 3), "ball.obj");
  const MassProperties can = write(cylinder_mesh(0.5, 2), "can.obj");
  write(convex_hull(points), "pill.obj");
  write(sphere_mesh(0.1, 1), "coarse.obj");
  const auto shape = [](const std::string& name, const std::string& more = "") {
    return '"' + name + R"(": {"type": "mesh", "file": ")" + name + ".obj\"" + more + '}';
  };
  const Model model = build(shape("ball") + ", " + shape("can") + ", " + shape("coarse") + ", " +
                            shape("pill") + R"(, "plain": {"type": "mesh", "file": "ball.obj",
                            "collision": "hull"})");
  const ModelShape &round = model.shapes[0], &long_one = model.shapes[1];
  ASSERT_EQ(round.pieces.size(), 1u);
  EXPECT_EQ(round.pieces[0].kind, CollisionPiece::Kind::sphere);
  EXPECT_NEAR(round.pieces[0].size.x(), 0.1, 1e-6);
  EXPECT_LT(round.pieces[0].pose.position.norm(), 1e-6);
  EXPECT_NEAR(round.mass.volume_m3, ball.volume_m3, 1e-6 * ball.volume_m3);
  EXPECT_LT((round.mass.inertia_m5 - ball.inertia_m5).norm(), 1e-5 * ball.inertia_m5.norm());
  EXPECT_LT((round.origin_offset - pose.position).norm(), 1e-6);
  EXPECT_THAT(round.collision_report, HasSubstr("recognised as a ball: 1 piece, exact"));
  ASSERT_EQ(long_one.pieces.size(), 1u);
  EXPECT_EQ(long_one.pieces[0].kind, CollisionPiece::Kind::round);
  const RoundSector& can_piece = long_one.pieces[0].round;
  EXPECT_NEAR(can_piece.bottom, 0.5, 1e-5);
  EXPECT_EQ(can_piece.top, can_piece.bottom);
  EXPECT_NEAR(can_piece.height, 2, 1e-5);
  EXPECT_GT(std::abs((long_one.pieces[0].pose.orientation * Vec3::UnitY())
                         .dot(pose.orientation * Vec3::UnitY())),
            1 - 1e-9);
  EXPECT_NEAR(long_one.mass.volume_m3, can.volume_m3, 1e-5 * can.volume_m3);
  EXPECT_GE(long_one.bounding_radius, std::hypot(0.5, 1) - 1e-6);
  EXPECT_EQ(model.shapes[2].pieces[0].kind, CollisionPiece::Kind::hull);
  EXPECT_THAT(model.shapes[3].collision_report, HasSubstr("recognised as a capsule: 3 pieces"));
  EXPECT_EQ(model.shapes[4].pieces[0].kind, CollisionPiece::Kind::hull);
}

// A closed box with map coordinates is recognised as the box.
TEST_F(SceneModel, MeshesFarFromTheirOriginKeepTheirShape) {
  for (const char* collision : {"auto", "hull", "decomposition"}) {
    std::ofstream(directory_ / "map.obj")
        << "v 500000.0000 0.0000 5200000.0000\nv 500000.0000 0.0000 5200000.2000\n"
           "v 500000.0000 0.1500 5200000.0000\nv 500000.0000 0.1500 5200000.2000\n"
           "v 500000.1000 0.0000 5200000.0000\nv 500000.1000 0.0000 5200000.2000\n"
           "v 500000.1000 0.1500 5200000.0000\nv 500000.1000 0.1500 5200000.2000\n"
           "f 1 2 4\nf 1 4 3\nf 5 7 8\nf 5 8 6\nf 1 5 6\nf 1 6 2\n"
           "f 3 4 8\nf 3 8 7\nf 1 3 7\nf 1 7 5\nf 2 6 8\nf 2 8 4\n";
    const Model model =
        build(R"("c": {"type": "mesh", "file": "map.obj", "collision": ")" +
                  std::string(collision) + "\"}",
              R"("bodies": [{"shape": "c", "material": "m", "position": [-500000, 0, -5200000]}])");
    const ModelShape& shape = model.shapes[0];
    EXPECT_NEAR(shape.mass.volume_m3, 0.1 * 0.15 * 0.2, 1e-10);
    EXPECT_LT((shape.mass.inertia_m5.diagonal() -
               box_mass_properties({0.1, 0.15, 0.2}).inertia_m5.diagonal())
                  .norm(),
              1e-12);
    EXPECT_LT((model.bodies[0].pose.position - Vec3(0.05, 0.075, 0.1)).norm(), 1e-8);
    EXPECT_LT((shape.mesh.bounds().sizes() - Vec3(0.1, 0.15, 0.2)).norm(), 1e-8);
    ASSERT_EQ(shape.pieces.size(), 1u);
  }
}

TEST_F(SceneModel, AHullThatFollowsBadlyNamesTheOtherWay) {
  const std::string l_shape = std::string(PILESIM_SOURCE_DIR) + "/assets/l_shape.obj";
  const auto report = [&](const std::string& file, const std::string& more) {
    return build(R"("a": {"type": "mesh", "file": ")" + file + "\"" + more + "}")
        .shapes[0]
        .collision_report;
  };
  const std::string offer = R"("collision": "decomposition" would follow its hollows)";
  EXPECT_THAT(report(l_shape, ""), HasSubstr(offer));
  EXPECT_THAT(report(l_shape, R"(, "collision": "hull")"), HasSubstr(offer));
  EXPECT_THAT(report(l_shape, R"(, "collision": "decomposition")"), Not(HasSubstr(offer)));
  EXPECT_THAT(report(l_shape, R"(, "solid": "hull")"), Not(HasSubstr(offer)));
  EXPECT_THAT(report("box.obj", ""), Not(HasSubstr(offer)));
}

TEST_F(SceneModel, CompoundsJoinMassAndPieces) {
  const Model model = build(R"("box": {"type": "mesh", "file": "box.obj", "collision": "hull"},
    "cube": {"type": "box", "size": [2, 2, 2]},
    "zed": {"type": "compound", "parts": [{"shape": "cube", "position": [0, 3, 0]},
      {"shape": "box", "position": [0, -10, 0], "rotation_deg": [0, 0, 90]}]})");
  const ModelShape& zed = model.shapes[2];
  // The box's centre (10, 0, 0) turns to (0, 10, 0) and comes to the origin; volumes 8 and 6.
  EXPECT_NEAR(zed.mass.volume_m3, 14, 1e-5);
  EXPECT_NEAR((zed.origin_offset - Vec3(0, 24.0 / 14, 0)).norm(), 0, 1e-5);
  ASSERT_EQ(zed.pieces.size(), 2u);
  EXPECT_NEAR((zed.pieces[0].pose.position - Vec3(0, 3 - 24.0 / 14, 0)).norm(), 0, 1e-5);
  EXPECT_NEAR((zed.pieces[1].hull.bounds().center() - Vec3(0, -24.0 / 14, 0)).norm(), 0, 1e-5);
  EXPECT_NEAR((zed.pieces[1].hull.bounds().sizes() - Vec3(2, 1, 3)).norm(), 0, 1e-5);
  // About z: cube m(4 + 4)/12, turned box m(4 + 1)/12, and both about the common centre.
  const double expected =
      8 * 8.0 / 12 + 8 * std::pow(3 - 24.0 / 14, 2) + 6 * 5.0 / 12 + 6 * std::pow(24.0 / 14, 2);
  EXPECT_NEAR(zed.mass.inertia_m5(2, 2), expected, 1e-4);
}

TEST_F(SceneModel, AnOpenMeshIsAnErrorThatNamesFileShapeAndRemedy) {
  const std::string text = failure(R"("o/x": {"type": "mesh", "file": "open.obj"})");
  EXPECT_THAT(text, HasSubstr((directory_ / "open.obj").string() + ": /shapes/o~1x: "));
  EXPECT_THAT(text, HasSubstr("expected a closed mesh with outward triangles"));
  EXPECT_THAT(text, HasSubstr("thickness_m"));
}

TEST_F(SceneModel, AnOpenMeshMayUseItsHull) {
  const Model model = build(R"("o": {"type": "mesh", "file": "open.obj", "solid": "hull"})");
  EXPECT_NEAR(model.shapes[0].mass.volume_m3, 6, 1e-5);
  EXPECT_THAT(model.shapes[0].collision_report, HasSubstr("its hull, of"));
}

TEST_F(SceneModel, AMeshMayBeSizedByItsLongestSide) {
  const Model model =
      build(R"("o": {"type": "mesh", "file": "open.obj", "solid": "hull", "size_m": 0.25})");
  EXPECT_NEAR(model.shapes[0].mesh.bounds().sizes().maxCoeff(), 0.25, 1e-6);
  const Model unit = build(R"("o": {"type": "mesh", "file": "open.obj", "solid": "hull"})");
  EXPECT_NEAR(model.shapes[0].file_scale, 0.25 / unit.shapes[0].mesh.bounds().sizes().maxCoeff(),
              1e-6);
  EXPECT_THAT(failure(R"("o": {"type": "mesh", "file": "open.obj", "size_m": 1, "scale": 2})"),
              HasSubstr("stands beside"));
}

TEST_F(SceneModel, AMeshWhoseZIsUpIsTurned) {
  // Its centre is at (10, 0, 0); it is moved to make the sign of z visible.
  TriangleMesh box = box_mesh({1, 2, 3});
  for (Vec3& vertex : box.vertices) vertex += Vec3(10, 20, 30);
  write_obj(box, directory_ / "z_up.obj");
  const std::string shape = R"("type": "mesh", "file": "z_up.obj", "scale": 0.5)";
  for (const char* const collision : {"hull", "decomposition", "spheres", "mesh"}) {
    const Model model =
        build("\"o\": {" + shape + R"(, "up": "z", "collision": ")" + collision + "\"}");
    const ModelShape& turned = model.shapes[0];
    EXPECT_LT((turned.mesh.bounds().sizes() - Vec3(0.5, 1.5, 1)).norm(), kRounding) << collision;
    EXPECT_LT((turned.origin_offset - Vec3(5, 15, -10)).norm(), kRounding) << collision;
    EXPECT_EQ(turned.file_up, UpAxis::z);
    if (turned.collides_as_mesh) continue;
    EXPECT_NEAR(turned.mass.volume_m3, 6 * 0.125, kRounding) << collision;
    if (turned.pieces[0].kind != CollisionPiece::Kind::hull) continue;
    EXPECT_LT((turned.pieces[0].hull.bounds().sizes() - Vec3(0.5, 1.5, 1)).norm(), kRounding);
  }
  // Rotated, not mirrored: its triangles still face outward.
  EXPECT_EQ(failure("\"o\": {" + shape + R"(, "up": "z", "solid": "exact"})"), "");
  EXPECT_LT(
      (build("\"o\": {" + shape + R"(, "up": "y"})").shapes[0].origin_offset - Vec3(5, 10, 15))
          .norm(),
      kRounding);
}

TEST_F(SceneModel, ColoursOfTheFileHoldUnlessTheSceneHasSome) {
  std::ifstream in(directory_ / "box.obj");
  const std::string text(std::istreambuf_iterator<char>(in), {});
  std::ofstream(directory_ / "red.mtl") << "newmtl red\nKd 1 0 0\n";
  std::ofstream(directory_ / "red.obj") << "mtllib red.mtl\nusemtl red\n" << text;
  const Model model = build(R"("red": {"type": "mesh", "file": "red.obj", "size_m": 0.1},
      "box": {"type": "mesh", "file": "box.obj", "size_m": 0.1})",
                            R"("bodies": [
      {"name": "own", "shape": "red", "material": "m"},
      {"name": "given", "shape": "red", "material": "m", "colour": "#102030"},
      {"name": "plain", "shape": "box", "material": "m"}],
    "emitters": [
      {"name": "e", "type": "grid", "shape": "red", "material": "m", "centre": [0, 2, 0],
       "count": [1, 1, 1], "spacing": [1, 1, 1]},
      {"name": "p", "type": "grid", "shape": "red", "material": "m", "centre": [0, 3, 0],
       "count": [1, 1, 1], "spacing": [1, 1, 1], "palette": ["#010203"]},
      {"name": "s", "type": "grid", "shape": "red", "material": "m", "centre": [0, 4, 0],
       "count": [1, 1, 1], "spacing": [1, 1, 1], "sizes": {"from": 2, "to": 3, "steps": 2}}])");
  std::map<std::string, const ModelBody*> body;
  for (const ModelBody& each : model.bodies) body[each.name] = &each;
  for (const char* const name : {"own", "e/0", "s/0"}) {
    EXPECT_TRUE(body[name]->is_painted) << name;
    EXPECT_EQ(body[name]->colour, (Colour{255, 0, 0})) << name;
    const TriangleMesh& mesh = model.shapes[body[name]->shape].mesh;
    EXPECT_EQ(mesh.colours.size(), mesh.triangles.size()) << name;
  }
  for (const char* const name : {"given", "plain", "p/0"}) EXPECT_FALSE(body[name]->is_painted);
  EXPECT_EQ(body["given"]->colour, (Colour{0x10, 0x20, 0x30}));
  EXPECT_EQ(body["p/0"]->colour, (Colour{1, 2, 3}));
}

TEST_F(SceneModel, AnOpenMeshMayBeAStaticMesh) {
  EXPECT_EQ(failure(R"("o": {"type": "mesh", "file": "open.obj", "collision": "mesh"})"), "");
}

TEST_F(SceneModel, AllFaultyMeshesAreReportedAtOnce) {
  const std::string text = failure(R"("a": {"type": "mesh", "file": "none.obj"},
    "b": {"type": "mesh", "file": "open.obj"})");
  EXPECT_THAT(text, HasSubstr("none.obj: /shapes/a: "));
  EXPECT_THAT(text, HasSubstr("open.obj: /shapes/b: "));
}

TEST_F(SceneModel, EmittedBodiesFollowTheOthers) {
  const Model model = build(R"("ball": {"type": "sphere", "radius": 0.1})", R"(
    "bodies": [{"shape": "ball", "material": "m"}],
    "emitters": [{"name": "rain", "type": "stream", "shape": "ball", "material": "m",
      "position": [0, 3, 0], "count": 3, "rate_hz": 2, "colour": "#102030"}],
    "events": [{"type": "remove", "time_s": 3, "bodies": ["rain"]},
      {"type": "impulse", "time_s": 1, "bodies": ["body/0", "rain/2"], "impulse": [1, 0, 0]}])");
  ASSERT_EQ(model.bodies.size(), 4u);
  EXPECT_EQ(model.bodies[3].name, "rain/2");
  EXPECT_EQ(model.bodies[3].colour, (Colour{0x10, 0x20, 0x30}));
  EXPECT_EQ(model.bodies[0].start_s, kFromTheStart);
  EXPECT_EQ(model.bodies[1].start_s, kFromTheStart);
  EXPECT_DOUBLE_EQ(model.bodies[3].start_s, 1);
  EXPECT_NEAR(model.bodies[3].mass_kg, 500 * 4 * kPi / 3 * 1e-3, 1e-12);
  ASSERT_EQ(model.events.size(), 2u);
  EXPECT_EQ(model.events[0].kind, ModelEvent::Kind::impulse);
  EXPECT_EQ(model.events[0].bodies, (std::vector<uint32_t>{0, 3}));
  EXPECT_EQ(model.events[1].bodies, (std::vector<uint32_t>{1, 2, 3}));
}

TEST_F(SceneModel, MotionStaysInTheShapesFrameAndStartsTheBody) {
  const Model model = build(R"("box": {"type": "mesh", "file": "box.obj", "collision": "mesh"})",
                            R"("bodies": [{"shape": "box", "material": "m", "role": "kinematic",
    "motion": [{"time_s": 0, "position": [1, 0, 0]},
               {"time_s": 2, "position": [0, 7, 0], "rotation_deg": [0, 180, 0]}]}])");
  const ModelBody& body = model.bodies[0];
  EXPECT_NEAR((body.pose.position - Vec3(11, 0, 0)).norm(), 0, kRounding);
  EXPECT_NEAR((body.motion[1].pose.position - Vec3(0, 7, 0)).norm(), 0, kRounding);
}

TEST_F(SceneModel, AVolumeWithoutRoomIsAnError) {
  const std::string shapes = R"("ball": {"type": "sphere", "radius": 0.1})";
  const std::string volume = R"("emitters": [{"type": "volume", "shape": "ball", "material": "m",
      "file": "box.obj", "spacing": 0.5}], "events": [{"type": "remove", "time_s": 0,
      "bodies": ["emitter/0/INDEX"]}])";
  EXPECT_NO_THROW(build(shapes, replaced(volume, "INDEX", "7")));
  EXPECT_THROW(build(shapes, replaced(volume, "INDEX", "1000")), Error);
}

TEST_F(SceneModel, AVolumeNeedsAClosedMesh) {
  const std::string emitter = R"("bodies": [], "emitters": [{"type": "volume", "file": "FILE",
    "spacing": 0.7, "shape": "ball", "material": "m"}])";
  const std::string ball = R"("ball": {"type": "sphere", "radius": 0.1})";
  EXPECT_EQ(build(ball, replaced(emitter, "FILE", "box.obj")).bodies.size(), 2u * 3u * 5u);
  try {
    build(ball, replaced(emitter, "FILE", "open.obj"));
    FAIL() << "took a mesh with a hole";
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::input);
    EXPECT_THAT(error.what(), HasSubstr("open.obj: /emitters/0: "));
    EXPECT_THAT(error.what(), HasSubstr("expected a closed mesh"));
  }
}

TEST_F(SceneModel, FaultyMeshesOfShapesAndEmittersAreNamedTogether) {
  try {
    build(R"("a": {"type": "mesh", "file": "open.obj"})", R"("bodies": [], "emitters": [
      {"type": "volume", "file": "open.obj", "spacing": 0.5, "shape": "a", "material": "m"}])");
    FAIL() << "took meshes with holes";
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), HasSubstr("/shapes/a"));
    EXPECT_THAT(error.what(), HasSubstr("/emitters/0"));
  }
}

TEST_F(SceneModel, AGuideIsAClosedMeshThatHoldsBodies) {
  std::ofstream(directory_ / "empty.obj") << "# nothing\n";
  const auto fault = [&](const std::string& guide) -> std::string {
    try {
      const Model model =
          build(R"("brick": {"type": "box", "size": [1, 1, 1]})",
                R"("bodies": [{"shape": "brick", "material": "m"}], "guide": )" + guide);
      EXPECT_NEAR(model.guide.bounds().center().x(), 3, kRounding);
      EXPECT_NEAR(model.guide.bounds().center().z(), -20, kRounding);
      return "";
    } catch (const Error& error) {
      return error.what();
    }
  };
  EXPECT_EQ(
      fault(
          R"({"file": "box.obj", "scale": 2, "position": [3, 0, 0], "rotation_deg": [0, 90, 0]})"),
      "");
  const std::string of_open = fault(R"({"file": "open.obj"})");
  EXPECT_THAT(of_open, HasSubstr("/guide"));
  EXPECT_THAT(of_open, HasSubstr("open.obj"));
  EXPECT_THAT(of_open, HasSubstr("Close its surface"));
  EXPECT_THAT(of_open, Not(HasSubstr("thickness_m"))) << "of shapes only";
  EXPECT_THAT(fault(R"({"file": "empty.obj"})"), HasSubstr("empty.obj"));
  EXPECT_THAT(fault(R"({"file": "box.obj", "scale": 0.5})"), HasSubstr("smaller than a body"));
}

// Appends a box, outward or inward.
void add_box(TriangleMesh& mesh, const Vec3& low, const Vec3& high, bool inward = false,
             const std::string& group = "") {
  TriangleMesh box = box_mesh(high - low);
  const auto first = static_cast<uint32_t>(mesh.vertices.size());
  const auto first_triangle = static_cast<uint32_t>(mesh.triangles.size());
  for (const Vec3& vertex : box.vertices) mesh.vertices.push_back(vertex + (low + high) / 2);
  for (const Triangle& t : box.triangles) {
    mesh.triangles.push_back({t[0] + first, t[inward ? 2 : 1] + first, t[inward ? 1 : 2] + first});
  }
  if (!group.empty()) {
    mesh.groups.push_back({group, first_triangle, static_cast<uint32_t>(box.triangles.size())});
  }
}

struct GuideMesh {
  std::string name;
  TriangleMesh mesh;
  double volume_m3;  // enclosed
  std::string done;  // as reported
};

std::vector<GuideMesh> guides_to_mend() {
  const auto letter = [](const std::string& group, const Quat& turn) {  // an H
    TriangleMesh mesh;
    add_box(mesh, {-1, 0, -0.2}, {-0.6, 2, 0.2}, false, group.empty() ? "" : group + "1");
    add_box(mesh, {0, 0, -0.2}, {0.4, 2, 0.2}, false, group.empty() ? "" : group + "2");
    add_box(mesh, {-0.9, 0.8, -0.2}, {0.3, 1.2, 0.2}, false, group.empty() ? "" : group + "3");
    for (Vec3& vertex : mesh.vertices) vertex = turn * vertex;
    return mesh;
  };
  constexpr double kLetter = 2 * 0.4 * 2 * 0.4 + 0.6 * 0.4 * 0.4;
  std::vector<GuideMesh> guides = {
      {"overlapping", letter("", Quat::Identity()), kLetter, "wrapped"},
      {"turned", letter("part", Quat(Eigen::AngleAxisd(0.5, Vec3(1, 2, 3).normalized()))), kLetter,
       "wrapped"}};
  TriangleMesh mesh;
  add_box(mesh, {0, 0, 0}, {1, 2, 1}, true);
  guides.push_back({"inward", mesh, 2, "turned"});
  mesh = {};
  add_box(mesh, {0, 0, 0}, {1, 2, 1});
  mesh.triangles.insert(mesh.triangles.end(), mesh.triangles.begin(), mesh.triangles.end());
  guides.push_back({"doubled", mesh, 2, "solid: "});
  mesh = {};  // both outward: no cavity
  add_box(mesh, {0, 0, 0}, {2, 2, 2});
  add_box(mesh, {0.5, 0.5, 0.5}, {1.5, 1.5, 1.5});
  guides.push_back({"nested", mesh, 8, "solid: "});
  mesh = {};  // side by side, with a wall in between
  add_box(mesh, {0, 0, 0}, {1, 1, 1});
  add_box(mesh, {1, 0, 0}, {2, 1, 1});
  guides.push_back({"wall", mesh, 2, "solid: "});
  mesh = {};  // they share an edge
  add_box(mesh, {0, 0, 0}, {1, 1, 1});
  add_box(mesh, {1, 1, 0}, {2, 2, 1});
  guides.push_back({"edge", mesh, 2, "wrapped"});
  mesh = {};
  add_box(mesh, {0, 0, 0}, {1, 1, 1});
  add_box(mesh, {2, 0, 0}, {3, 1, 1});
  guides.push_back({"apart", mesh, 2, ""});
  mesh = {};
  add_box(mesh, {0, 0, 0}, {2, 2, 2});
  add_box(mesh, {0.5, 0.5, 0.5}, {1.5, 1.5, 1.5}, true);
  guides.push_back({"hollow", mesh, 7, ""});
  return guides;
}

// Anything inside it would be a wall for the bodies that fill it.
TEST_F(SceneModel, AGuideIsMadeASolidAsABodyIs) {
  for (const GuideMesh& guide : guides_to_mend()) {
    write_obj(guide.mesh, directory_ / (guide.name + ".obj"));
    const Model model = build(R"("brick": {"type": "box", "size": [0.1, 0.1, 0.1]})",
                              R"("bodies": [{"shape": "brick", "material": "m"}],
                                 "guide": {"file": ")" +
                                  guide.name + R"(.obj"})");
    EXPECT_TRUE(find_mesh_defects(model.guide).empty()) << guide.name;
    EXPECT_NEAR(mass_properties(model.guide).volume_m3, guide.volume_m3, 0.02 * guide.volume_m3)
        << guide.name;
    EXPECT_THAT(model.guide_report, HasSubstr("guide: ")) << guide.name;
    EXPECT_THAT(model.guide_report, HasSubstr(guide.done)) << guide.name;
    if (guide.done.empty()) {
      EXPECT_THAT(model.guide_report, Not(HasSubstr("solid"))) << guide.name;
    } else {
      EXPECT_THAT(model.guide_report, HasSubstr("volume error")) << guide.name;
    }
  }
}

TEST_F(SceneModel, AGuideWithGlueIsFilledAsAMould) {
  const auto fill = [&](const std::string& type, const std::string& hold) {
    const Model model =
        build(R"("brick": {"type": "box", "size": [0.3, 0.3, 0.3]})",
              R"("bodies": [], "emitters": [{"type": ")" + type +
                  R"(", "shape": "brick", "material": "m", "start_s": 1, )" +
                  (type == "mould" ? "" : R"("rate_hz": 2, )") +
                  R"("count": 3}], "guide": {"file": "box.obj", "hold": ")" + hold + "\"}");
    return std::pair(model.guide_fill->is_mould, model.bodies[2].start_s);
  };
  EXPECT_EQ(fill("mould", "glue"), std::pair(true, 1.0));
  EXPECT_EQ(fill("upside_down", "glue"), std::pair(true, 1.0)) << "all are released at once";
  EXPECT_EQ(fill("upside_down", "freeze"), std::pair(false, 2.0));
  EXPECT_EQ(fill("mould", "nail"), std::pair(true, 1.0));
}

}  // namespace
}  // namespace pilesim

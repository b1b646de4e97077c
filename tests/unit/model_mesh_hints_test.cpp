#include "model/mesh_hints.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "geometry/obj_writer.h"
#include "geometry/primitives.h"
#include "scene/scene_loader.h"
#include "support/scratch_directory.h"

namespace pilesim {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

// A brick of 1 x 0.5 x 0.4 about its origin, as thing.obj; tests derive others from it.
class MeshHints : public testing::Test {
 protected:
  MeshHints() { write_obj(box_mesh({1, 0.5, 0.4}), scratch_ / "thing.obj"); }

  // Hints for a scene with the shape "thing"; `shape` are its further keys, `rest` those of the
  // scene.
  std::vector<std::string> hints(const std::string& shape, const std::string& rest,
                                 const std::string& file = "thing.obj") {
    const std::string text = R"({"version": 1, "materials": {"m": {}}, "shapes": {
      "table": {"type": "table", "size": [1.2, 0.7, 0.8]}, "bead": {"type": "sphere", "radius": 0.01},
      "thing": {"type": "mesh", "file": ")" +
                             file + "\"" + shape + "}}, " + rest + "}";
    const Scene scene = parse_scene(text, scratch_ / "scene.json").scene;
    return describe_unlikely_meshes(scene, build_model(scene));
  }

  // A scene in which the thing is poured, with the keys `rest`.
  std::vector<std::string> poured(double scale, const std::string& rest = "\"duration_s\": 5") {
    return hints(", \"scale\": " + std::to_string(scale),
                 R"("emitters": [{"name": "p", "type": "stream", "shape": "thing", "material": "m",
                    "position": [0, 3, 0], "count": 2, "rate_hz": 1}], )" +
                     rest);
  }

  test::ScratchDirectory scratch_;
};

constexpr char kTable[] =
    R"("bodies": [{"name": "t", "shape": "table", "material": "m", "role": "static"}])";

// The volume that a hull loses by its vertex limit is reported above 1 %.
TEST_F(MeshHints, AHullThatLosesMuchByItsLimitIsSaid) {
  TriangleMesh egg = sphere_mesh(0.5, 4);
  for (Vec3& vertex : egg.vertices) vertex.x() *= 1.3;
  write_obj(egg, scratch_ / "egg.obj");
  const auto said = [&](const std::string& more) { return hints(more, kTable, "egg.obj"); };
  EXPECT_THAT(said(""), ElementsAre(AllOf(HasSubstr("hull of 96 vertices loses"),
                                          HasSubstr("\"hull_max_vertices\": 255 loses"))));
  EXPECT_THAT(said(R"(, "collision": "decomposition")"), IsEmpty());
  // A hull within its limit loses nothing.
  EXPECT_THAT(hints("", kTable), IsEmpty());
  write_obj(cylinder_mesh(0.5, 1, 100), scratch_ / "wheel.obj");
  const auto wheel =
      hints(R"(, "collision": "hull", "hull_max_vertices": 24)", kTable, "wheel.obj");
  ASSERT_EQ(wheel.size(), 1u);
  const size_t at = wheel[0].find("\"hull_max_vertices\": ");
  ASSERT_NE(at, wheel[0].npos);
  const int enough = std::stoi(wheel[0].substr(at + 21));
  EXPECT_THAT(wheel[0], HasSubstr("loses no more than 1 %"));
  EXPECT_THAT(hints(R"(, "collision": "hull", "hull_max_vertices": )" + std::to_string(enough),
                    kTable, "wheel.obj"),
              IsEmpty());
}

// Once per file, however many shapes use it.
TEST_F(MeshHints, TexturesThatCannotBeReadAreNamed) {
  std::ofstream(scratch_ / "box.mtl") << "newmtl wood\nKd 0.5 0.3 0.1\nmap_Kd planks.png\n";
  std::ofstream mesh(scratch_ / "textured.obj");
  mesh << "mtllib box.mtl\nvt 0 0\nvt 1 0\nvt 0 1\n"
          "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nusemtl wood\n"
          "f 1/1 3/2 2/3\nf 1/1 2/2 4/3\nf 2/1 3/2 4/3\nf 1/1 4/2 3/3\n";
  mesh.close();
  const std::string file = (scratch_ / "textured.obj").string();
  EXPECT_THAT(hints(R"(}, "other": {"type": "mesh", "file": "textured.obj", "scale": 0.5)",
                    R"("duration_s": 5, "bodies": [
                       {"name": "a", "shape": "thing", "material": "m", "position": [0, 2, 0]},
                       {"name": "b", "shape": "other", "material": "m", "position": [3, 2, 0]}])",
                    "textured.obj"),
              ElementsAre(AllOf(
                  HasSubstr(file + ": texture \"planks.png\" of material \"wood\" is not there"),
                  HasSubstr("expected a PNG"))));
}

TEST_F(MeshHints, ThingsOfAnyUsualSizeAreTakenAsTheyAre) {
  for (const double length : {0.003, 0.01, 0.1, 1.0, 4.0}) {
    EXPECT_THAT(poured(length, "\"duration_s\": 5"), IsEmpty()) << length;
    EXPECT_THAT(poured(length, kTable), IsEmpty()) << length;
    EXPECT_THAT(poured(length, R"("camera": {"position": [2, 2, 2], "target": [0, 0, 0]})"),
                IsEmpty())
        << length;
  }
}

// A shape is compared with the median of its neighbours, whatever its unit.
TEST_F(MeshHints, ShapesAThousandTimesSmallerOrLargerThanTheirNeighboursAreNamed) {
  const auto among = [&](const std::string& scale, const std::string& role) {
    return hints(", \"scale\": " + scale + R"(}, "ball": {"type": "sphere", "radius": 0.4},
                 "brick": {"type": "box", "size": [1, 0.5, 0.5])",
                 R"("bodies": [
                   {"name": "it", "shape": "thing", "material": "m", "role": ")" +
                     role + R"("},
                   {"name": "b", "shape": "ball", "material": "m", "position": [3, 0, 0]},
                   {"name": "c", "shape": "brick", "material": "m", "position": [6, 0, 0]}])");
  };
  for (const std::string role : {"dynamic", "static"}) {
    EXPECT_THAT(among("0.001", role),
                ElementsAre(AllOf(HasSubstr("thing is 0.001 m long, and others that move are "),
                                  HasSubstr("1 makes it 1 m (one for millimetres)"))))
        << role;
    for (const std::string scale : {"0.1", "0.4", "1"}) {
      EXPECT_THAT(among(scale, role), IsEmpty()) << role << scale;
    }
  }
  // Static bodies may be larger: see below.
  EXPECT_THAT(among("1000", "dynamic"),
              ElementsAre(HasSubstr("thing is 1e+03 m long, and others that move are 1 m long")));
}

// Boxes, balls and similar shapes as well, dynamic or static.
TEST_F(MeshHints, WrittenShapesAThousandTimesSmallerThanTheirNeighboursAreNamed) {
  const auto among = [&](const std::string& shape, const std::string& role,
                         const std::string& rest = "\"duration_s\": 5") {
    return hints(R"(, "size_m": 1)"
                 "}, \"ball\": {\"type\": \"sphere\", \"radius\": 0.4}, \"it\": {" +
                     shape,
                 R"("bodies": [
                   {"name": "it", "shape": "it", "material": "m", "role": ")" +
                     role + R"("},
                   {"name": "b", "shape": "ball", "material": "m", "position": [3, 0, 0]},
                   {"name": "c", "shape": "thing", "material": "m", "position": [6, 0, 0]}], )" +
                     rest);
  };
  const std::pair<std::string, std::string> small[] = {
      {R"("type": "box", "size": [0.0005, 0.001, 0.0005])", "0.001"},
      {R"("type": "sphere", "radius": 0.001)", "0.002"},
      {R"("type": "cylinder", "radius": 0.001, "height": 0.003)", "0.003"}};
  for (const std::string role : {"dynamic", "static"}) {
    for (const auto& [shape, length] : small) {
      EXPECT_THAT(among(shape, role),
                  ElementsAre("it is " + length +
                              " m long, and others that move are 1 m long: lengths of a scene are "
                              "in metres"))
          << role;
    }
    EXPECT_THAT(among(R"("type": "box", "size": [0.01, 0.02, 0.01])", role), IsEmpty()) << role;
    EXPECT_THAT(among(R"("type": "box", "size": [60, 60, 60])", role), IsEmpty()) << role;
  }
  // The camera shows the intended size.
  for (const auto& [away, count] : {std::pair("0.09", 0), {"0.2", 1}}) {
    EXPECT_THAT(among(R"("type": "sphere", "radius": 0.0005)", "dynamic",
                      R"("camera": {"position": [0, 0, )" + std::string(away) +
                          R"(], "target": [0, 0, 0]})"),
                testing::Contains(HasSubstr("lengths of a scene")).Times(count))
        << away;
  }
}

TEST_F(MeshHints, CentimetresTakenForMetresAreSeenAndMended) {
  // A mug of 10 cm in Blender's FBX and in files in centimetres.
  write_obj(box_mesh({8, 10, 12}), scratch_ / "mug.obj");
  const std::string emitter = R"("emitters": [{"name": "p", "type": "disk", "shape": "thing",
    "material": "m", "radius": 0.4, "height": 1, "count": 2}])";
  EXPECT_THAT(hints("", emitter, "mug.obj"),
              ElementsAre(AllOf(HasSubstr("thing is 12 m long, and it is large"),
                                HasSubstr("\"scale\": 0.01 makes it 0.12 m"),
                                HasSubstr("0.001 makes it 0.012 m"), HasSubstr("\"size_m\": 12"))));
  EXPECT_THAT(hints(R"(, "scale": 0.01)", emitter, "mug.obj"), IsEmpty());
  EXPECT_THAT(hints(R"(, "size_m": 12)", emitter, "mug.obj"), IsEmpty());
}

TEST_F(MeshHints, LongerThanAllThatStands) {
  EXPECT_THAT(poured(0.999, kTable), IsEmpty());
  EXPECT_THAT(poured(12, kTable), ElementsAre(HasSubstr("all that stands there is 1.")));
}

TEST_F(MeshHints, StaticShapesAreComparedWithDynamicOnes) {
  const std::string room = R"("bodies": [{"name": "room", "shape": "thing", "material": "m",
    "role": "static"}, {"name": "b", "shape": "bead", "material": "m", "position": [0, 300, 0]}])";
  EXPECT_THAT(hints(R"(, "scale": 15)", room), IsEmpty());
  EXPECT_THAT(hints(R"(, "scale": 500)", room),
              ElementsAre(HasSubstr("thing is 500 m long, and what moves is 0.02 m long")));
  // A file in centimetres without a scale, and a correct desk.
  write_obj(box_mesh({120, 70, 80}), scratch_ / "desk.obj");
  EXPECT_THAT(hints("", room, "desk.obj"), ElementsAre(HasSubstr("120 m long, and it is large")));
  EXPECT_THAT(hints(R"(, "scale": 0.01)", room, "desk.obj"), IsEmpty());
}

TEST_F(MeshHints, LongerThanTheOthersThatMove) {
  const std::string beads = R"("bodies": [{"name": "b", "shape": "bead", "material": "m"}])";
  EXPECT_THAT(poured(0.4, beads), IsEmpty());
  EXPECT_THAT(poured(2, beads), ElementsAre(HasSubstr("others that move are 0.02 m long")));
}

TEST_F(MeshHints, TooLongOrTooShortForTheCamera) {
  const std::string camera = R"("camera": {"position": [0, 0.3, 0.4], "target": [0, 0, 0]})";
  EXPECT_THAT(poured(0.9, camera), IsEmpty());
  EXPECT_THAT(poured(1.1, camera), ElementsAre(HasSubstr("the camera is 0.5 m from its target")));
  const std::string far = R"("camera": {"position": [0, 0, 20], "target": [0, 0, 0]})";
  EXPECT_THAT(poured(0.01, far), IsEmpty());
  EXPECT_THAT(poured(0.004, far),
              ElementsAre(AllOf(HasSubstr("the camera is 20 m"), HasSubstr("4 makes it 4 m"))));
}

TEST_F(MeshHints, NoTimeToFallByTheirOwnLength) {
  EXPECT_THAT(poured(3, "\"duration_s\": 1"), IsEmpty());
  EXPECT_THAT(poured(3, "\"duration_s\": 0.5"),
              ElementsAre(HasSubstr("to fall by its own length")));
  EXPECT_THAT(poured(3, R"("duration_s": 0.5, "gravity": [0, 0, 0])"), IsEmpty());
}

TEST_F(MeshHints, TinyThings) {
  write_obj(box_mesh({0.001, 0.001, 0.0005}), scratch_ / "grain.obj");
  EXPECT_THAT(hints("", kTable, "grain.obj"), ElementsAre(HasSubstr("it is tiny")));
  EXPECT_THAT(poured(0.0003, kTable), ElementsAre(HasSubstr("all that stands there is 1.")));
}

// A stool with legs and a seat, standing on y = 0 or z = 0 of its file.
TriangleMesh stool(bool is_z_up) {
  TriangleMesh stool;
  const auto add = [&](const Vec3& size, const Vec3& centre) {
    TriangleMesh box = box_mesh(size);
    const auto first = static_cast<uint32_t>(stool.vertices.size());
    for (const Vec3& vertex : box.vertices) stool.vertices.push_back(vertex + centre);
    for (const auto& [a, b, c] : box.triangles) {
      stool.triangles.push_back({a + first, b + first, c + first});
    }
  };
  for (const double x : {-0.15, 0.15}) {
    for (const double z : {-0.15, 0.15}) add({0.04, 0.4, 0.04}, {x, 0.2, z});
  }
  add({0.36, 0.03, 0.36}, {0, 0.42, 0});
  if (is_z_up) {
    for (Vec3& v : stool.vertices) v = Vec3(v.x(), -v.z(), v.y());
  }
  return stool;
}

void write_stl(const TriangleMesh& mesh, const std::filesystem::path& file) {
  std::ofstream out(file);
  out << "solid s\n";
  for (const Triangle& triangle : mesh.triangles) {
    out << "facet normal 0 0 0\nouter loop\n";
    for (const uint32_t vertex : triangle)
      out << "vertex " << mesh.vertices[vertex].transpose() << '\n';
    out << "endloop\nendfacet\n";
  }
  out << "endsolid s\n";
}

TEST_F(MeshHints, FilesThatStandOnTheirZ) {
  for (const bool is_z_up : {false, true}) {
    write_obj(stool(is_z_up), scratch_ / "stool.obj");
    write_stl(stool(is_z_up), scratch_ / "stool.stl");
    for (const char* const file : {"stool.obj", "stool.stl"}) {
      const auto placed = [&](const std::string& shape, const std::string& pose) {
        return hints(R"(, "collision": "hull", "solid": "hull")" + shape,
                     R"("bodies": [{"name": "s", "shape": "thing", "material": "m")" + pose + "}]",
                     file);
      };
      const std::string text = std::string(file) + (is_z_up ? " z up" : " y up");
      if (is_z_up) {
        EXPECT_THAT(placed("", ""), ElementsAre(HasSubstr("\"up\": \"z\""))) << text;
        EXPECT_THAT(placed("", R"(, "rotation_deg": [0, 30, 0])"), testing::SizeIs(1)) << text;
      } else {
        EXPECT_THAT(placed("", ""), IsEmpty()) << text;
      }
      EXPECT_THAT(placed(R"(, "up": "z")", ""), IsEmpty()) << text;
      EXPECT_THAT(placed(R"(, "up": "y")", ""), IsEmpty()) << text;
      // Rotated by its author.
      EXPECT_THAT(placed("", R"(, "rotation_deg": [-90, 0, 0])"), IsEmpty()) << text;
    }
  }
  // With random initial orientations it does not matter.
  EXPECT_THAT(hints("", R"("emitters": [{"name": "p", "type": "disk", "shape": "thing",
                       "material": "m", "radius": 0.4, "height": 1, "count": 2}])",
                    "stool.stl"),
              IsEmpty());
}

}  // namespace
}  // namespace pilesim

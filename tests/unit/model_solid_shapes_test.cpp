// Cones, capsules, tori, tubes, wedges and text as scenes have them: mass, pieces, bad values, and
// guides in their shape.
#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "core/error.h"
#include "geometry/mass_properties.h"
#include "geometry/mesh_check.h"
#include "geometry/primitives.h"
#include "geometry/round_crossings.h"
#include "model/model.h"
#include "scene/scene_loader.h"
#include "support/scratch_directory.h"

namespace pilesim {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class SolidShapes : public ::testing::Test {
 protected:
  SolidShapes() { setenv("XDG_CACHE_HOME", directory_.path().c_str(), 1); }

  Model build(const std::string& shapes, const std::string& more = "") {
    const std::string text = R"({"version": 1, "materials": {"m": {}}, "shapes": {)" + shapes +
                             R"(}, "bodies": [{"shape": "s", "material": "m"}])" + more + "}";
    return build_model(parse_scene(text, directory_ / "scene.json").scene);
  }
  ModelShape shape(const std::string& keys) { return build(R"("s": {)" + keys + "}").shapes.at(0); }

  std::string failure(const std::string& keys, const std::string& more = "") {
    try {
      build(R"("s": {)" + keys + "}", more);
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  }

  test::ScratchDirectory directory_;
};

// Volume and largest moment as wanted; a closed surface drawn near it; convex pieces that reach no
// farther than the bounding radius. All of it about the centre of mass.
void expect_solid(const ModelShape& shape, double volume, double most_inertia,
                  double tolerance = 2e-6) {
  EXPECT_NEAR(shape.mass.volume_m3, volume, tolerance * volume);
  EXPECT_NEAR(shape.mass.inertia_m5.diagonal().maxCoeff(), most_inertia, tolerance * most_inertia);
  EXPECT_TRUE(shape.mass.centre_of_mass.isZero(0));
  EXPECT_THAT(find_mesh_defects(shape.mesh), IsEmpty());
  const MassProperties drawn = mass_properties(shape.mesh);
  EXPECT_NEAR(drawn.volume_m3, volume, 0.02 * volume);
  EXPECT_LT(drawn.centre_of_mass.norm(), 2e-3 * shape.bounding_radius);
  EXPECT_FALSE(shape.pieces.empty());
  for (const CollisionPiece& piece : shape.pieces) {
    if (piece.kind == CollisionPiece::Kind::round) {
      for (const Vec3& corner : box_mesh(Vec3::Ones()).vertices) {
        const Vec3 along = corner.normalized();
        const Vec3 farthest = piece.round.farthest(along) + piece.round.margin * along;
        EXPECT_LE(piece.pose.apply(farthest).norm(), shape.bounding_radius * (1 + 1e-12));
      }
    }
    if (piece.kind != CollisionPiece::Kind::hull) continue;
    EXPECT_THAT(find_mesh_defects(piece.hull), IsEmpty());
    for (const Vec3& vertex : piece.hull.vertices) {
      EXPECT_LE(vertex.norm(), shape.bounding_radius * (1 + 1e-12));
    }
  }
}

TEST_F(SolidShapes, RoundOnesHaveTheMassOfClosedForms) {
  const double cone = kPi * 0.25 * 2 / 3;
  expect_solid(shape(R"("type": "cone", "radius": 0.5, "height": 2)"), cone,
               cone * (0.15 * 0.25 + 3.0 / 80 * 4));
  const double ball = 4 * kPi / 3, straight = 3 * kPi;
  expect_solid(shape(R"("type": "capsule", "radius": 1, "height": 5)"), ball + straight,
               straight * (0.25 + 9.0 / 12) + ball * (0.4 + 9.0 / 4 + 9.0 / 8));
  const double torus = 2 * kPi * kPi * 2 * 0.25;
  expect_solid(shape(R"("type": "torus", "radius": 2, "tube_radius": 0.5)"), torus,
               torus * (4 + 0.75 * 0.25));
  const double tube = kPi * (1 - 0.64) * 0.5;
  expect_solid(shape(R"("type": "tube", "radius": 1, "height": 0.5, "thickness": 0.2)"), tube,
               tube * (1 + 0.64) / 2);
}

// Vertices of what is drawn lie on the round surface that it stands for; at any size, and as a part
// of another.
TEST_F(SolidShapes, DrawnVerticesLieOnRoundSurfaces) {
  for (const char* keys :
       {R"("type": "sphere", "radius": 0.5)", R"("type": "cylinder", "radius": 0.5, "height": 2)",
        R"("type": "cone", "radius": 0.5, "height": 2)",
        R"("type": "cone", "radius": 0.5, "top_radius": 0.7, "height": 1)",
        R"("type": "capsule", "radius": 0.2, "height": 1)",
        R"("type": "torus", "radius": 0.4, "tube_radius": 0.1)",
        R"("type": "tube", "radius": 0.4, "height": 1, "thickness": 0.05)"}) {
    const std::string part =
        std::string(R"("p": {)") + keys + R"(}, "b": {"type": "box", "size": [1, 1, 1]},)";
    const std::string whole =
        R"("s": {"type": "compound", "parts": [{"shape": "b", "position": [3, 0, 0]},
        {"shape": "p", "position": [0, 1, 0], "rotation_deg": [20, 30, 40]}, {"shape": "p", "position": [0, -1, 0]}]})";
    const ModelShape alone = shape(keys), compound = build(part + whole).shapes.back();
    EXPECT_EQ(alone.round.size(), 1u);
    EXPECT_EQ(compound.round.size(), 2u);
    for (const ModelShape& shape : {alone, compound}) {
      for (const RoundSurface& round : shape.round) {
        for (uint32_t t = 0; t < round.triangle_count; ++t) {
          const Triangle& corners = shape.mesh.triangles[round.first_triangle + t];
          const Vec3 middle = (shape.mesh.vertices[corners[0]] + shape.mesh.vertices[corners[1]] +
                               shape.mesh.vertices[corners[2]]) /
                              3;
          for (const uint32_t corner : corners) {
            // A little off the rims, where two surfaces meet.
            const Vec3 vertex = shape.mesh.vertices[corner];
            const Vec3 place = vertex + 1e-6 * (middle - vertex);
            const Vec3 normal = outward_normal(round, place);
            double nearest = 1;
            for (const double distance : crossings(round, place + 0.01 * normal, -normal)) {
              nearest = std::min(nearest, std::abs(distance - 0.01));
            }
            EXPECT_LT(nearest, 2e-6) << keys;
          }
        }
      }
    }
  }
}

TEST_F(SolidShapes, AFrustumIsACylinderOrAConeAtItsEnds) {
  const ModelShape cylinder =
      shape(R"("type": "cone", "radius": 0.5, "height": 2, "top_radius": 0.5)");
  expect_solid(cylinder, kPi / 2, cylinder_mass_properties(0.5, 2).inertia_m5(0, 0));
  EXPECT_NEAR(shape(R"("type": "cone", "radius": 0.5, "height": 2)").origin_offset.y(), -0.5,
              1e-12);
}

TEST_F(SolidShapes, AWedgeIsHalfOfItsBox) {
  const ModelShape wedge = shape(R"("type": "wedge", "size": [1, 2, 3])");
  // A prism of a right-angled triangle: m (a^2 + b^2) / 18 about its axis.
  expect_solid(wedge, 3, 3 * (4.0 + 9.0) / 18);
  EXPECT_LT((wedge.origin_offset - Vec3(0, -2.0 / 6, -3.0 / 6)).norm(), 1e-12);
  const auto high = std::ranges::count_if(
      wedge.mesh.vertices, [&](const Vec3& v) { return v.y() + wedge.origin_offset.y() > 0; });
  EXPECT_EQ(high, 2);
  EXPECT_EQ(wedge.pieces.size(), 1u);
}

TEST_F(SolidShapes, ACapsuleIsTwoBallsAndACylinder) {
  const ModelShape capsule = shape(R"("type": "capsule", "radius": 0.1, "height": 0.5)");
  ASSERT_EQ(capsule.pieces.size(), 3u);
  EXPECT_EQ(capsule.pieces[0].kind, CollisionPiece::Kind::sphere);
  EXPECT_NEAR(std::abs(capsule.pieces[1].pose.position.y()), 0.15, 1e-12);
  EXPECT_EQ(capsule.pieces[2].round.bottom, 0.1);
  EXPECT_NEAR(capsule.pieces[2].round.height, 0.3, 1e-12);
  EXPECT_NEAR(capsule.bounding_radius, 0.25, 1e-12);
}

// No piece is in the hole: a ball of nine tenths of it passes through.
TEST_F(SolidShapes, RingsAreOpen) {
  for (const char* keys : {R"("type": "torus", "radius": 0.3, "tube_radius": 0.1)",
                           R"("type": "tube", "radius": 0.3, "height": 0.2, "thickness": 0.1)"}) {
    for (const CollisionPiece& piece : shape(keys).pieces) {
      EXPECT_GT(piece.round.farthest(-Vec3::UnitX()).x() - piece.round.margin, 0.18);
    }
  }
}

TEST_F(SolidShapes, TextIsAsHighAsACapitalAndCentred) {
  const ModelShape text = shape(R"("type": "text", "text": "I", "height": 0.2, "depth": 0.05)");
  const Vec3 size = text.mesh.bounds().sizes();
  EXPECT_NEAR(size.y(), 0.2, 1e-12);
  EXPECT_NEAR(size.z(), 0.05, 1e-12);
  EXPECT_LT(text.mesh.bounds().center().norm(), 1e-12);
  expect_solid(text, size.prod(), box_mass_properties(size).inertia_m5.diagonal().maxCoeff());
  EXPECT_EQ(text.pieces.size(), 1u);
}

// Pieces fill the letters but for 1 % of the height along curves.
TEST_F(SolidShapes, LettersAreOneSolidOfPieces) {
  for (const char* letters : {"O", "B", "i", "8", "PILE", "A b c", "100 %"}) {
    SCOPED_TRACE(letters);
    const ModelShape text = shape(R"("type": "text", "height": 1, "depth": 0.1, "text": ")" +
                                  std::string(letters) + '"');
    const MassProperties drawn = mass_properties(text.mesh);
    expect_solid(text, drawn.volume_m3, drawn.inertia_m5.diagonal().maxCoeff());
    double pieces = 0;
    for (const CollisionPiece& piece : text.pieces) {
      pieces += mass_properties(piece.hull).volume_m3;
    }
    EXPECT_NEAR(pieces, drawn.volume_m3, 0.03 * drawn.volume_m3);
  }
}

TEST_F(SolidShapes, ScaleMultipliesTheirMeasures) {
  const auto volume = [&](const std::string& keys) { return shape(keys).mass.volume_m3; };
  EXPECT_NEAR(volume(R"("type": "cone", "radius": 1, "height": 1, "scale": [-2, 3, 2])"), 4 * kPi,
              1e-9);
  EXPECT_NEAR(volume(R"("type": "capsule", "radius": 1, "height": 3, "scale": 2)"),
              8 * volume(R"("type": "capsule", "radius": 1, "height": 3)"), 1e-6);
  EXPECT_NEAR(volume(R"("type": "torus", "radius": 2, "tube_radius": 1, "scale": [2, -2, 2])"),
              8 * volume(R"("type": "torus", "radius": 2, "tube_radius": 1)"), 1e-6);
  EXPECT_NEAR(
      volume(R"("type": "tube", "radius": 1, "height": 1, "thickness": 0.5, "scale": [2, 3, 2])"),
      9 * kPi, 1e-9);
  EXPECT_NEAR(volume(R"("type": "wedge", "size": [1, 2, 3], "scale": [-1, 2, 2])"), 12, 1e-9);
  EXPECT_NEAR(volume(R"("type": "text", "text": "a", "height": 1, "depth": 1, "scale": [2, 2, 3])"),
              12 * volume(R"("type": "text", "text": "a", "height": 1, "depth": 1)"), 1e-9);
}

TEST_F(SolidShapes, BadScalesAreRefused) {
  const auto expect = [&](const std::string& keys, const std::string& why) {
    EXPECT_THAT(failure(keys), AllOf(HasSubstr("/shapes/s/scale: is "), HasSubstr(why)));
  };
  expect(R"("type": "cone", "radius": 1, "height": 1, "scale": [1, -1, 1])", "points up");
  expect(R"("type": "cone", "radius": 1, "height": 1, "scale": [1, 1, 2])", "round about y");
  expect(R"("type": "capsule", "radius": 1, "height": 3, "scale": [1, 2, 1])",
         "a stretched capsule is none");
  expect(R"("type": "torus", "radius": 2, "tube_radius": 1, "scale": [1, 2, 1])",
         "a stretched torus is none");
  expect(R"("type": "tube", "radius": 1, "height": 1, "thickness": 0.5, "scale": [2, 1, 1])",
         "a tube is round");
  expect(R"("type": "wedge", "size": [1, 1, 1], "scale": [1, 1, -1])", "a wedge rises to -z");
  expect(R"("type": "text", "text": "a", "height": 1, "depth": 1, "scale": [2, 1, 1])",
         "letters keep their shape");
}

TEST_F(SolidShapes, BadMeasuresAreRefusedWithTheirPointers) {
  const auto expect = [&](const std::string& keys, const std::string& what) {
    EXPECT_THAT(failure(keys), HasSubstr("/shapes/s" + what)) << keys;
  };
  expect(R"("type": "cone", "radius": 0, "height": 1)", "/radius: is 0");
  expect(R"("type": "cone", "radius": 1, "height": 1, "top_radius": -1)", "/top_radius: is -1");
  expect(R"("type": "capsule", "radius": 1, "height": 2)",
         "/height: is 2; expected more than 2, two radii");
  expect(R"("type": "torus", "radius": 1, "tube_radius": 1)", "/tube_radius: is 1");
  expect(R"("type": "tube", "radius": 1, "height": 1, "thickness": 1)", "/thickness: is 1");
  expect(R"("type": "wedge", "size": [1, 0, 1])", "/size");
  const std::string text = R"("type": "text", "height": 1, "depth": 1, "text": )";
  expect(text + R"("  ")", "/text: is blank");
  expect(text + R"("a\nb")", "/text: has a line break");
  expect(text + '"' + std::string(101, 'a') + '"', "/text: has 101 characters");
  EXPECT_THAT(failure(text + R"("a", "font": "none.ttf")"), HasSubstr("none.ttf: /shapes/s: "));
  EXPECT_THAT(failure(text + "\"\u4e2d\""), HasSubstr("no letter for U+4E2D"));
  EXPECT_THAT(failure(text + "\"\u00a0\""), HasSubstr("/shapes/s: draws nothing"));
}

TEST_F(SolidShapes, AGuideHasTheShapeOfLetters) {
  const Model model = build(
      R"("s": {"type": "sphere", "radius": 0.05},
         "word": {"type": "text", "text": "O", "height": 2, "depth": 1})",
      R"(, "guide": {"shape": "word", "position": [0, 1, 0]})");
  EXPECT_THAT(find_mesh_defects(model.guide), IsEmpty());
  EXPECT_NEAR(model.guide.bounds().center().y(), 1, 1e-9);
  EXPECT_GT(model.guide.bounds().sizes().y(), 2);
  EXPECT_LT(mass_properties(model.guide).volume_m3, 0.6 * model.guide.bounds().volume());
  EXPECT_THAT(model.guide_report, HasSubstr("guide: "));
}

TEST_F(SolidShapes, AGuideOfAShapeIsChecked) {
  const std::string ball = R"("type": "sphere", "radius": 0.05)";
  EXPECT_THAT(failure(ball, R"(, "guide": {"shape": "word"})"),
              HasSubstr("/guide/shape: is \"word\", which is no shape"));
  EXPECT_THAT(failure(ball, R"(, "guide": {"shape": "s", "scale": 2})"),
              HasSubstr("/guide/scale: stands beside \"shape\""));
  EXPECT_THAT(failure(ball, R"(, "guide": {"shape": "s", "file": "x.obj"})"), HasSubstr("/guide"));
  EXPECT_THAT(failure(R"("type": "plane")", R"(, "guide": {"shape": "s"})"),
              HasSubstr("/guide/shape: is \"s\", which has no end"));
}

TEST_F(SolidShapes, TheResolvedSceneKeepsThem) {
  const std::string text =
      R"({"version": 1, "materials": {"m": {}}, "shapes": {
          "cone": {"type": "cone", "radius": 1, "height": 2, "top_radius": 0.5, "scale": 2},
          "word": {"type": "text", "text": "a \"b\"", "height": 1, "depth": 0.5}}, "bodies": []})";
  const std::string resolved = parse_scene(text, directory_ / "scene.json").resolved;
  const Scene again = parse_scene(resolved, directory_ / "scene.json").scene;
  EXPECT_EQ(std::get<ConeShape>(again.shapes.at("cone")).top_radius, 1);
  EXPECT_EQ(std::get<TextShape>(again.shapes.at("word")).text, "a \"b\"");
  EXPECT_FALSE(std::get<TextShape>(again.shapes.at("word")).font);
}

}  // namespace
}  // namespace pilesim

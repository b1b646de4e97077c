// Emitters of several shapes, sizes, materials and colours; and shapes made of boxes.

#include <gmock/gmock.h>

#include <array>
#include <cmath>
#include <fstream>
#include <map>
#include <set>

#include "geometry/mass_properties.h"
#include "geometry/mesh_check.h"
#include "model/furniture.h"
#include "model/model.h"
#include "scene/looks.h"
#include "scene_test_support.h"
#include "support/scratch_directory.h"

namespace pilesim {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

Model build(const std::string& emitter, uint64_t seed = 1) {
  return build_model(parse(R"({"version": 1, "seed": )" + std::to_string(seed) +
                           R"(, "materials": {"m": {}, "heavy": {"density_kg_m3": 5000}},
    "shapes": {"ball": {"type": "sphere", "radius": 0.1},
    "hammer": {"type": "compound", "parts": [{"shape": "ball"},
      {"shape": "box", "position": [0.3, 0.1, 0]}]},
    "box": {"type": "box", "size": [0.2, 0.1, 0.3]}},
    "emitters": [{"type": "grid", "count": [30, 20, 5], "spacing": [2, 2, 2], )" +
                           emitter + "}]}")
                         .scene);
}

std::map<std::string, int> counts_of_shapes(const Model& model) {
  std::map<std::string, int> counts;
  for (const ModelBody& body : model.bodies) ++counts[model.shapes[body.shape].source];
  return counts;
}

TEST(Mix, ShapesAreDrawnByTheirWeights) {
  const Model model = build(R"("shapes": ["ball", "box"], "weights": [3, 1], "material": "m")");
  // 3000 draws: five standard deviations are 119.
  EXPECT_NEAR(counts_of_shapes(model)["ball"], 2250, 119);
  const Model none = build(R"("shapes": ["ball", "box"], "weights": [0, 1], "material": "m")");
  EXPECT_EQ(counts_of_shapes(none)["ball"], 0);
}

TEST(Mix, EachShapeHasItsMaterial) {
  const Model model = build(R"("shapes": ["ball", "box"], "materials": ["m", "heavy"])");
  for (const ModelBody& body : model.bodies) {
    const bool is_box = model.shapes[body.shape].source == "box";
    const double volume = model.shapes[body.shape].mass.volume_m3;
    EXPECT_NEAR(body.mass_kg, volume * (is_box ? 5000 : 1000), 1e-9);
  }
}

TEST(Mix, SizesAreSharedAndScaleAllMeasures) {
  const Model model = build(R"("shape": "hammer", "material": "m",
    "sizes": {"from": 0.5, "to": 2, "steps": 4})");
  EXPECT_EQ(model.shapes.size(), 3u + 3u);  // one of the sizes is the shape's own
  const ModelShape* plain = nullptr;
  for (const ModelShape& shape : model.shapes) {
    if (shape.name == "hammer") plain = &shape;
  }
  ASSERT_NE(plain, nullptr);
  std::map<double, int> sizes;
  for (const ModelBody& body : model.bodies) {
    const ModelShape& shape = model.shapes[body.shape];
    const double s = shape.size;
    ++sizes[s];
    EXPECT_EQ(shape.source, "hammer");
    EXPECT_NEAR(shape.mass.volume_m3, plain->mass.volume_m3 * s * s * s, 1e-12);
    EXPECT_NEAR(shape.mass.inertia_m5(1, 1), plain->mass.inertia_m5(1, 1) * std::pow(s, 5), 1e-12);
    EXPECT_NEAR(shape.bounding_radius, plain->bounding_radius * s, 1e-12);
    EXPECT_NEAR(shape.mesh.bounds().sizes().x(), plain->mesh.bounds().sizes().x() * s, 1e-9);
    EXPECT_NEAR((shape.pieces[1].pose.position - s * plain->pieces[1].pose.position).norm(), 0,
                1e-12);
  }
  ASSERT_EQ(sizes.size(), 4u);
  for (const auto& [size, count] : sizes) EXPECT_NEAR(count, 750, 119) << size;
  EXPECT_NEAR(sizes.begin()->first, 0.5, 1e-12);
  EXPECT_NEAR(sizes.rbegin()->first, 2, 1e-12);
}

TEST(Mix, SizesFollowTheirDistribution) {
  const auto sizes = [](const std::string& distribution) {
    std::map<double, int> counts;
    const Model model = build(R"("shape": "box", "material": "m", "sizes": {"from": 0.5, "to": 2,
      "steps": 3, "distribution": ")" +
                              distribution + "\"}");
    for (const ModelBody& body : model.bodies) ++counts[model.shapes[body.shape].size];
    return counts;
  };
  const auto even = sizes("log_uniform");
  EXPECT_NEAR(std::next(even.begin())->first, 1, 1e-12);  // the geometric mean
  EXPECT_NEAR(std::next(even.begin())->second, 1000, 130);
  const auto bell = sizes("normal");
  EXPECT_NEAR(std::next(bell.begin())->first, 1.25, 1e-12);
  // The ends have exp(-2) of the middle's probability: 0.787 of 3000.
  EXPECT_NEAR(std::next(bell.begin())->second, 2361, 112);
}

TEST(Mix, ColoursAreOfThePalette) {
  const Model model =
      build(R"("shape": "ball", "material": "m", "palette": ["#010203", "#0a0b0c"])");
  std::map<std::array<int, 3>, int> counts;
  for (const ModelBody& body : model.bodies)
    ++counts[{body.colour[0], body.colour[1], body.colour[2]}];
  ASSERT_EQ(counts.size(), 2u);
  EXPECT_NEAR((counts[{1, 2, 3}]), 1500, 137);
}

TEST(Mix, GlossIsDrawnForEachBodyWithinItsRange) {
  const std::string plain = R"("shape": "ball", "material": "m")";
  const std::string drawn = plain + R"(, "roughness": [0.2, 0.6], "clear_coat": [0.5, 1])";
  const Model model = build(drawn), again = build(drawn), other = build(drawn, 2);
  std::set<double> roughness, clear_coat;
  double sum = 0;
  int same_of_other_seed = 0;
  for (size_t i = 0; i < model.bodies.size(); ++i) {
    const ModelBody& body = model.bodies[i];
    EXPECT_GE(body.look.roughness, 0.2);
    EXPECT_LE(body.look.roughness, 0.6);
    EXPECT_GE(body.look.clear_coat, 0.5);
    EXPECT_LE(body.look.clear_coat, 1);
    EXPECT_EQ(body.look.roughness, again.bodies[i].look.roughness);
    EXPECT_EQ(body.look.clear_coat, again.bodies[i].look.clear_coat);
    same_of_other_seed += body.look.roughness == other.bodies[i].look.roughness ? 1 : 0;
    roughness.insert(body.look.roughness);
    clear_coat.insert(body.look.clear_coat);
    sum += body.look.roughness;
  }
  EXPECT_EQ(roughness.size(), model.bodies.size());
  EXPECT_EQ(clear_coat.size(), model.bodies.size());
  EXPECT_EQ(same_of_other_seed, 0);
  // Uniform: five standard deviations of the mean of 3000 are 0.0106.
  EXPECT_NEAR(sum / static_cast<double>(model.bodies.size()), 0.4, 0.0106);
  // All other random values are the same without it.
  const Model without = build(plain);
  for (size_t i = 0; i < model.bodies.size(); ++i) {
    EXPECT_EQ(model.bodies[i].pose.orientation.coeffs(),
              without.bodies[i].pose.orientation.coeffs());
    EXPECT_EQ(without.bodies[i].look.roughness, Look{}.roughness);
    EXPECT_EQ(without.bodies[i].look.clear_coat, 0);
  }
}

TEST(Looks, ABodysOwnComesBeforeItsMaterialsAndAColourBeforeBoth) {
  const Model model = build_model(parse(R"({"version": 1,
    "materials": {"gold": {"look": "gold"}, "plain": {"colour": "#0a0b0c"}},
    "shapes": {"ball": {"type": "sphere", "radius": 0.1}},
    "bodies": [{"shape": "ball", "material": "gold"},
      {"shape": "ball", "material": "gold", "look": "steel", "position": [1, 0, 0]},
      {"shape": "ball", "material": "gold", "look": "steel", "colour": "#010203", "position": [2, 0, 0]},
      {"shape": "ball", "material": "plain", "position": [3, 0, 0]},
      {"shape": "ball", "material": "plain", "look": "clear_plastic", "position": [4, 0, 0]}],
    "emitters": [{"type": "grid", "count": [1, 1, 1], "spacing": [1, 1, 1], "centre": [0, 5, 0],
      "shape": "ball", "material": "gold", "look": "glass", "roughness": [0.3, 0.3]}]})")
                                      .scene);
  const std::map<std::string, Look> looks(named_looks().begin(), named_looks().end());
  const auto& bodies = model.bodies;
  EXPECT_EQ(bodies[0].look, looks.at("gold"));
  EXPECT_EQ(bodies[0].colour, looks.at("gold").colour);
  EXPECT_EQ(bodies[1].look, looks.at("steel"));
  EXPECT_EQ(bodies[1].colour, looks.at("steel").colour);
  EXPECT_EQ(bodies[2].look, looks.at("steel"));
  EXPECT_EQ(bodies[2].colour, (Colour{1, 2, 3}));
  EXPECT_EQ(bodies[3].colour, (Colour{10, 11, 12}));
  EXPECT_EQ(bodies[4].look.transmission, 1);
  EXPECT_NE(bodies[4].colour, (Colour{10, 11, 12}));  // from the palette
  EXPECT_EQ(bodies[5].look.transmission, 1);
  EXPECT_EQ(bodies[5].look.roughness, 0.3);
  EXPECT_EQ(bodies[5].colour, looks.at("glass").colour);
}

TEST(Mix, ValuesThatDoNotFitAreRefused) {
  const auto fault = [](const std::string& emitter) {
    const auto lines = problems_of(R"({"version": 1, "materials": {"m": {}}, "shapes": {
      "a": {"type": "sphere", "radius": 0.1}}, "emitters": [{"type": "grid", "count": [1, 1, 1],
      "spacing": [1, 1, 1], )" + emitter +
                                   "}]}");
    return lines.empty() ? std::string() : lines.front();
  };
  EXPECT_EQ(fault(R"("shape": "a", "material": "m")"), "");
  EXPECT_THAT(fault(R"("shapes": ["a", "a"], "weights": [1], "material": "m")"),
              HasSubstr("expected 2, as many as there are shapes"));
  EXPECT_THAT(fault(R"("shapes": ["a", "a"], "weights": [0, 0], "material": "m")"),
              HasSubstr("all 0"));
  EXPECT_THAT(fault(R"("shapes": ["a"], "materials": ["oak"])"), HasSubstr("no material"));
  EXPECT_THAT(fault(R"("shapes": ["a"], "materials": ["m"], "material": "m")"),
              HasSubstr("material"));
  EXPECT_THAT(fault(R"("shape": "a", "material": "m", "sizes": {"from": 2, "to": 1})"),
              HasSubstr("more than 2"));
  EXPECT_THAT(
      fault(R"("shape": "a", "material": "m", "palette": ["#000000"], "colour": "#000000")"),
      HasSubstr("colour"));
  const std::string one = R"("shape": "a", "material": "m", )";
  EXPECT_THAT(fault(one + R"("roughness": [0.5, 0.4])"),
              AllOf(HasSubstr("/emitters/0/roughness/1: is 0.4"), HasSubstr("at least 0.5")));
  EXPECT_THAT(fault(one + R"("clear_coat": [0, 1.5])"),
              AllOf(HasSubstr("/emitters/0/clear_coat/1: is 1.5"), HasSubstr("from 0 to 1")));
  EXPECT_THAT(fault(one + R"("roughness": 0.3)"),
              AllOf(HasSubstr("/emitters/0/roughness: is 0.3"), HasSubstr("[least, most]")));
  // An empty palette is no colour, and empty weights are not equal weights.
  for (const std::string key : {"palette", "weights"}) {
    EXPECT_THAT(fault(R"("shape": "a", "material": "m", ")" + key + "\": []"),
                HasSubstr("/emitters/0/" + key +
                          ": is an empty array; expected an array with at least one entry"));
  }
}

ModelShape furniture(const std::string& shape) {
  return build_model(parse(R"({"version": 1, "shapes": {"it": {)" + shape + "}}}").scene)
      .shapes.at(0);
}

double pieces_overlap_m3(const std::vector<BoxPart>& parts) {
  double overlap = 0;
  for (size_t i = 0; i < parts.size(); ++i) {
    for (size_t j = 0; j < i; ++j) {
      const Vec3 room =
          (parts[i].size + parts[j].size) / 2 - (parts[i].centre - parts[j].centre).cwiseAbs();
      overlap += room.cwiseMax(0).prod();
    }
  }
  return overlap;
}

TEST(Furniture, HasTheVolumeOfItsWallsAndStandsOnItsOrigin) {
  // Outer box minus the inside.
  const ModelShape bin = furniture(R"("type": "bin", "size": [1, 0.5, 2], "thickness": 0.1)");
  EXPECT_NEAR(bin.mass.volume_m3, 1.2 * 0.6 * 2.2 - 1 * 0.5 * 2, 1e-12);
  EXPECT_EQ(bin.pieces.size(), 5u);
  const ModelShape table =
      furniture(R"("type": "table", "size": [2, 1, 1], "thickness": 0.1, "leg": 0.2)");
  EXPECT_NEAR(table.mass.volume_m3, 2 * 0.1 * 1 + 4 * 0.2 * 0.2 * 0.9, 1e-12);
  const ModelShape shelf =
      furniture(R"("type": "shelf", "size": [1, 2, 0.5], "thickness": 0.1, "boards": 3)");
  EXPECT_NEAR(shelf.mass.volume_m3, 2 * 0.1 * 2 * 0.5 + 0.8 * 2 * 0.1 + 3 * 0.8 * 0.1 * 0.4, 1e-12);
  const ModelShape stairs = furniture(R"("type": "stairs", "size": [1, 1, 2], "steps": 4)");
  EXPECT_NEAR(stairs.mass.volume_m3, 1 * 0.5 * 0.25 * (1 + 2 + 3 + 4), 1e-12);
  for (const ModelShape* shape : {&bin, &table, &shelf, &stairs}) {
    const Bounds bounds = shape->mesh.bounds();
    EXPECT_NEAR(bounds.min().y() + shape->origin_offset.y(), 0, 1e-12);
    EXPECT_NEAR(bounds.center().x() + shape->origin_offset.x(), 0, 1e-12);
    EXPECT_NEAR(bounds.center().z() + shape->origin_offset.z(), 0, 1e-12);
  }
  // The lowest step is at +z: the mass is behind the middle.
  EXPECT_LT(stairs.origin_offset.z(), 0);
}

TEST(Furniture, PartsDoNotOverlap) {
  EXPECT_NEAR(pieces_overlap_m3(parts_of(BinShape{{1, 0.5, 2}, 0.1})), 0, 1e-15);
  EXPECT_NEAR(pieces_overlap_m3(parts_of(TableShape{{2, 1, 1}, 0.1, 0.2})), 0, 1e-15);
  EXPECT_NEAR(pieces_overlap_m3(parts_of(ShelfShape{{1, 2, 0.5}, 5, 0.1, true})), 0, 1e-15);
  EXPECT_NEAR(pieces_overlap_m3(parts_of(StairsShape{{1, 1, 2}, 7})), 0, 1e-15);
}

TEST(Furniture, WithoutRoomIsRefused) {
  const auto faults = [](const std::string& shape) {
    return problems_of(R"({"version": 1, "shapes": {"it": {)" + shape + "}}}");
  };
  EXPECT_THAT(faults(R"("type": "table", "size": [1, 1, 1])"), IsEmpty());
  EXPECT_FALSE(faults(R"("type": "table", "size": [1, 1, 0.1], "leg": 0.06)").empty());
  EXPECT_FALSE(faults(R"("type": "table", "size": [1, 0.02, 1])").empty());
  EXPECT_FALSE(faults(R"("type": "shelf", "size": [1, 1, 1], "boards": 60)").empty());
  EXPECT_FALSE(faults(R"("type": "bin", "size": [1, 1, 1], "thickness": 0)").empty());
}

// A grey picture of 8 bits, 3 x 2: 0 128 255 over 255 0 0.
const std::string kPicture = [] {
  const std::array<unsigned char, 73> bytes = {
      137, 80, 78, 71,  13,  10, 26, 10,  0,   0,   0,   13,  73,  72,  68, 82, 0, 0,  0,
      3,   0,  0,  0,   2,   8,  0,  0,   0,   0,   184, 31,  57,  198, 0,  0,  0, 16, 73,
      68,  65, 84, 120, 218, 99, 96, 104, 248, 207, 240, 159, 129, 1,   0,  11, 0, 2,  127,
      203, 22, 8,  254, 0,   0,  0,  0,   73,  69,  78,  68,  174, 66,  96, 130};
  return std::string(bytes.begin(), bytes.end());
}();

TEST(Terrain, IsTheSurfaceOverItsPicture) {
  const test::ScratchDirectory scratch;
  std::ofstream(scratch / "hills.png") << kPicture;
  const std::string text =
      R"({"version": 1, "materials": {"m": {}}, "shapes": {"hills": {"type": "terrain",
    "file": "hills.png", "size": [4, 2], "height": [-1, 4]}}, "bodies": [
    {"shape": "hills", "material": "m", "role": "static"}]})";
  const Model model = build_model(parse_scene(text, scratch / "scene.json").scene);
  const ModelShape& shape = model.shapes.at(0);
  EXPECT_TRUE(shape.collides_as_mesh);
  ASSERT_EQ(shape.mesh.vertices.size(), 6u);
  EXPECT_EQ(shape.mesh.triangles.size(), 4u);
  const auto corner = [&](size_t i) -> Vec3 {
    return model.bodies[0].pose.apply(shape.mesh.vertices[i]);
  };
  EXPECT_NEAR((corner(0) - Vec3(-2, -1, -1)).norm(), 0, 1e-12);
  EXPECT_NEAR((corner(1) - Vec3(0, -1 + 5 * 128 / 255.0, -1)).norm(), 0, 1e-12);
  EXPECT_NEAR((corner(2) - Vec3(2, 4, -1)).norm(), 0, 1e-12);
  EXPECT_NEAR((corner(3) - Vec3(-2, 4, 1)).norm(), 0, 1e-12);
  for (const Triangle& t : shape.mesh.triangles) {
    const Vec3 normal = (corner(t[1]) - corner(t[0])).cross(corner(t[2]) - corner(t[0]));
    EXPECT_GT(normal.y(), 0);
  }
}

TEST(Terrain, OtherFilesThanPicturesAreRefused) {
  const test::ScratchDirectory scratch;
  const std::string text = R"({"version": 1, "shapes": {"hills": {"type": "terrain",
    "file": "hills.png", "size": [4, 2], "height": [0, 1]}}})";
  for (const std::string& content :
       {std::string("P5 3 2"), kPicture.substr(0, 40), std::string()}) {
    std::ofstream(scratch / "hills.png") << content;
    try {
      build_model(parse_scene(text, scratch / "scene.json").scene);
      ADD_FAILURE() << content.size();
    } catch (const Error& error) {
      EXPECT_THAT(error.what(), HasSubstr("hills.png")) << content.size();
    }
  }
}

}  // namespace
}  // namespace pilesim

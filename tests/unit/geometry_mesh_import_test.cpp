#include "geometry/mesh_import.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstring>
#include <fstream>
#include <sstream>

#include "../geometry_shapes.h"
#include "core/error.h"
#include "geometry/mass_properties.h"
#include "geometry/obj_writer.h"
#include "geometry/primitives.h"

#define STB_IMAGE_WRITE_STATIC
#define STBI_WRITE_NO_STDIO
#define STB_IMAGE_WRITE_IMPLEMENTATION
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wunused-function"
#pragma GCC diagnostic ignored "-Wconversion"
#include <stb/stb_image_write.h>
#pragma GCC diagnostic pop

namespace pilesim {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

class MeshImport : public testing::Test {
 protected:
  MeshImport() {
    const auto* test = testing::UnitTest::GetInstance()->current_test_info();
    directory_ = std::filesystem::temp_directory_path() /
                 ("pilesim_mesh_import_" + std::string(test->name()) + std::to_string(getpid()));
    std::filesystem::create_directories(directory_);
  }
  ~MeshImport() override { std::filesystem::remove_all(directory_); }

  std::filesystem::path file(const std::string& name, const std::string& content) const {
    std::ofstream(directory_ / name, std::ios::binary) << content;
    return directory_ / name;
  }

  void expect_error(const std::filesystem::path& path, ErrorKind kind, const std::string& text) {
    try {
      import_mesh(path);
      ADD_FAILURE() << "expected an error: " << text;
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), kind);
      EXPECT_THAT(error.what(), AllOf(HasSubstr(path.string()), HasSubstr(text)));
    }
  }

  std::filesystem::path directory_;
};

const std::string kCorners = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n";

TEST_F(MeshImport, ReadsAnObjAndScalesIt) {
  const TriangleMesh mesh =
      import_mesh(file("a.obj", kCorners + "f 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n"), 2.0);
  EXPECT_EQ(mesh.vertices.size(), 4u);
  EXPECT_EQ(mesh.triangles.size(), 4u);
  EXPECT_TRUE(mesh.groups.empty());
  EXPECT_NEAR(mass_properties(mesh).volume_m3, 8.0 / 6, 1e-12);
}

TEST_F(MeshImport, TriangulatesPolygonsAndDropsPointsAndLines) {
  const TriangleMesh mesh = import_mesh(
      file("a.obj", "v 0 0 0\nv 4 0 0\nv 4 4 0\nv 3 1 0\nv 9 9 9\nf 1 2 3 4\nl 1 5\np 5\n"));
  EXPECT_EQ(mesh.vertices.size(), 4u) << "the line's far vertex is not part of the mesh";
  double area = 0;  // of a concave quadrilateral: 4, all of it facing z
  for (const auto& [a, b, c] : mesh.triangles) {
    const Vec3& origin = mesh.vertices[a];
    area += (mesh.vertices[b] - origin).cross(mesh.vertices[c] - origin).z() / 2;
  }
  EXPECT_NEAR(area, 4, 1e-12);
}

TEST_F(MeshImport, GroupsAndObjectsBecomeMeshGroups) {
  const TriangleMesh mesh = import_mesh(
      file("a.obj", kCorners + "f 1 3 2\no body\nf 1 2 4\nf 2 3 4\ng ear left\nf 1 4 3\n"));
  ASSERT_EQ(mesh.groups.size(), 3u);
  EXPECT_EQ(mesh.groups[1].name, "body");
  EXPECT_EQ(mesh.groups[1].first_triangle, 1u);
  EXPECT_EQ(mesh.groups[1].triangle_count, 2u);
  EXPECT_EQ(mesh.groups[2].name, "ear left");
  EXPECT_EQ(mesh.groups[2].first_triangle, 3u);
  EXPECT_EQ(mesh.groups[2].triangle_count, 1u);
}

TEST_F(MeshImport, MaterialsDoNotCutGroups) {
  const TriangleMesh mesh = import_mesh(file(
      "a.obj", kCorners + "g all\nusemtl red\nf 1 3 2\nusemtl blue\nf 1 2 4\nf 2 3 4\nf 1 4 3\n"));
  ASSERT_EQ(mesh.groups.size(), 1u);
  EXPECT_EQ(mesh.groups[0].name, "all");
  EXPECT_EQ(mesh.groups[0].triangle_count, 4u);
  EXPECT_EQ(mesh.vertices.size(), 4u);
}

TEST_F(MeshImport, WeldsCloseVerticesAndDropsWhatCollapses) {
  // The box's diagonal is 1.7 m, so the tolerance is 1.7e-6 m. Vertices 5 to 7 repeat 1 to 3,
  // slightly displaced; the last triangle collapses; vertex 8 is too far away to be welded.
  const TriangleMesh mesh =
      import_mesh(file("a.obj", kCorners + "v 0 0 1e-6\nv 1 1e-6 0\nv -1e-6 1 0\nv 1 1e-5 0\n" +
                                    "f 1 3 2\nf 5 6 4\nf 6 7 4\nf 5 4 7\nf 1 5 3\nf 8 3 4\n"));
  EXPECT_EQ(mesh.vertices.size(), 5u);
  ASSERT_EQ(mesh.triangles.size(), 5u);
  EXPECT_THAT(mesh.triangles[1], testing::ElementsAre(0, 2, 3));
}

TEST_F(MeshImport, WeldsAcrossCellBorders) {
  // A fine sheet whose triangles share no vertex in the file, jittered below the tolerance.
  const int cells = 60;
  Philox random(21, Stream::test, 0);
  std::ostringstream text, faces;
  text.precision(9);
  const auto vertex = [&](int i, int j) {
    const Vec3 point = Vec3(i, j, 0) / cells + 2e-7 * random.direction();
    text << "v " << point.x() << ' ' << point.y() << ' ' << point.z() << '\n';
  };
  int count = 0;
  for (int i = 0; i < cells; ++i) {
    for (int j = 0; j < cells; ++j) {
      vertex(i, j), vertex(i + 1, j), vertex(i + 1, j + 1);
      vertex(i, j), vertex(i + 1, j + 1), vertex(i, j + 1);
      for (int k = 0; k < 2; ++k, count += 3) {
        faces << "f " << count + 1 << ' ' << count + 2 << ' ' << count + 3 << '\n';
      }
    }
  }
  const TriangleMesh mesh = import_mesh(file("a.obj", text.str() + faces.str()));
  EXPECT_EQ(mesh.vertices.size(), size_t{(cells + 1) * (cells + 1)});
  EXPECT_EQ(mesh.triangles.size(), size_t{2 * cells * cells});
}

TEST_F(MeshImport, ReadsStlAndPly) {
  const std::string facet = "facet normal 0 0 0\nouter loop\n";
  const std::string end = "endloop\nendfacet\n";
  const TriangleMesh stl = import_mesh(
      file("a.stl", "solid tetra\n" + facet + "vertex 0 0 0\nvertex 0 1 0\nvertex 1 0 0\n" + end +
                        facet + "vertex 0 0 0\nvertex 1 0 0\nvertex 0 0 1\n" + end + facet +
                        "vertex 1 0 0\nvertex 0 1 0\nvertex 0 0 1\n" + end + facet +
                        "vertex 0 0 0\nvertex 0 0 1\nvertex 0 1 0\n" + end + "endsolid tetra\n"));
  EXPECT_EQ(stl.vertices.size(), 4u);
  EXPECT_NEAR(mass_properties(stl).volume_m3, 1.0 / 6, 1e-12);
  ASSERT_EQ(stl.groups.size(), 1u);
  EXPECT_EQ(stl.groups[0].name, "tetra");

  const TriangleMesh ply = import_mesh(file(
      "a.ply",
      "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float "
      "z\nelement face 4\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 "
      "0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 0 3 2\n"));
  EXPECT_EQ(ply.vertices.size(), 4u);
  EXPECT_NEAR(mass_properties(ply).volume_m3, 1.0 / 6, 1e-12);
}

std::string glb_of(std::string json, const std::string& binary) {
  while (json.size() % 4 != 0) json += ' ';
  std::string glb;
  const auto append = [&](uint32_t word) { glb.append(reinterpret_cast<const char*>(&word), 4); };
  append(0x46546C67), append(2),
      append(static_cast<uint32_t>(12 + 8 + json.size() + 8 + binary.size()));
  append(static_cast<uint32_t>(json.size())), append(0x4E4F534A);
  glb += json;
  append(static_cast<uint32_t>(binary.size())), append(0x004E4942);
  return glb + binary;
}

// A binary glTF of one tetrahedron, used by two nodes, one moved and one mirrored. `material` is
// that of both.
std::string two_tetrahedra_glb(const std::string& material = "") {
  const float positions[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
  const uint16_t indices[] = {0, 2, 1, 0, 1, 3, 1, 2, 3, 0, 3, 2};
  std::string binary(sizeof positions + sizeof indices, '\0');
  std::memcpy(binary.data(), positions, sizeof positions);
  std::memcpy(binary.data() + sizeof positions, indices, sizeof indices);
  std::string json =
      R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0,1]}],
"nodes":[{"name":"moved","mesh":0,"translation":[5,0,0]},{"name":"mirrored","mesh":0,"scale":[-2,2,2]}],
"meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1}]}],
"buffers":[{"byteLength":72}],
"bufferViews":[{"buffer":0,"byteOffset":0,"byteLength":48},{"buffer":0,"byteOffset":48,"byteLength":24}],
"accessors":[{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3","min":[0,0,0],"max":[1,1,1]},
{"bufferView":1,"componentType":5123,"count":12,"type":"SCALAR"}]})";
  if (!material.empty()) {
    json.insert(json.find("\"indices\":1}") + 11, ",\"material\":0");
    json.insert(json.rfind('}'), ",\"materials\":[" + material + "]");
  }
  return glb_of(json, binary);
}

// A triangle in z = 0 with the picture in the file, its colour, and vertex colours if given;
// `mirrored` flips its x.
std::string textured_triangle_glb(const std::string& picture, bool mirrored = false,
                                  const std::vector<float>& colour = {}) {
  std::string binary, views, accessors;
  const auto add_view = [&](const void* data, size_t size) {
    views += (views.empty() ? "" : ",") + std::string(R"({"buffer":0,"byteOffset":)") +
             std::to_string(binary.size()) + R"(,"byteLength":)" + std::to_string(size) + "}";
    binary.append(static_cast<const char*>(data), size);
    binary.append((4 - size % 4) % 4, '\0');
  };
  add_view(picture.data(), picture.size());
  int view = 0;
  const auto add_accessor = [&](const std::vector<float>& values, const std::string& more) {
    add_view(values.data(), values.size() * sizeof(float));
    accessors += (accessors.empty() ? "" : ",") + std::string(R"({"bufferView":)") +
                 std::to_string(++view) + R"(,"componentType":5126,"count":3,)" + more + "}";
  };
  add_accessor({0, 0, 0, 1, 0, 0, 0, 1, 0}, R"("type":"VEC3","min":[0,0,0],"max":[1,1,0])");
  add_accessor({0, 0, 0.5f, 0.25f, 0, 3}, R"("type":"VEC2")");
  std::string attributes = R"("POSITION":0,"TEXCOORD_0":1)";
  if (!colour.empty()) {
    std::vector<float> three;
    for (int k = 0; k < 3; ++k) three.insert(three.end(), colour.begin(), colour.end());
    add_accessor(three, R"("type":"VEC3")");
    attributes += R"(,"COLOR_0":2)";
  }
  return glb_of(R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],
"nodes":[{"mesh":0)" +
                    std::string(mirrored ? R"(,"scale":[-1,1,1])" : "") +
                    R"(}],"meshes":[{"primitives":[{"attributes":{)" + attributes +
                    R"(},"material":0}]}],
"materials":[{"pbrMetallicRoughness":{"baseColorTexture":{"index":0},"baseColorFactor":[0.5,1,0.25,1]}}],
"textures":[{"source":0}],"images":[{"bufferView":0,"mimeType":"image/png"}],
"buffers":[{"byteLength":)" +
                    std::to_string(binary.size()) + R"(}],"bufferViews":[)" + views +
                    R"(],"accessors":[)" + accessors + "]}",
                binary);
}

TEST_F(MeshImport, AppliesNodeTransformsAndKeepsMirroredNodesOutward) {
  const TriangleMesh mesh = import_mesh(file("a.glb", two_tetrahedra_glb()));
  ASSERT_EQ(mesh.groups.size(), 2u);
  EXPECT_EQ(mesh.groups[0].name, "moved");
  EXPECT_EQ(mesh.groups[1].name, "mirrored");
  EXPECT_EQ(mesh.vertices.size(), 8u);
  EXPECT_NEAR(mass_properties(mesh).volume_m3, 1.0 / 6 + 8.0 / 6, 1e-6);
  EXPECT_TRUE(mesh.bounds().min().isApprox(Vec3(-2, 0, 0), 1e-6));
  EXPECT_TRUE(mesh.bounds().max().isApprox(Vec3(6, 2, 2), 1e-6));
}

using testing::Each;
using testing::ElementsAre;
using testing::IsEmpty;

std::string png(int width, int height, const std::vector<uint8_t>& rgba) {
  std::string png;
  stbi_write_png_to_func(
      [](void* to, void* data, int size) {
        static_cast<std::string*>(to)->append(static_cast<const char*>(data),
                                              static_cast<size_t>(size));
      },
      &png, width, height, 4, rgba.data(), 4 * width);
  return png;
}

// Two by two pixels: red and green above, blue and transparent black below.
std::string four_pixels_png() {
  return png(2, 2, {255, 0, 0, 255, 0, 255, 0, 255, 0, 0, 255, 255, 0, 0, 0, 0});
}

TEST_F(MeshImport, KeepsTheColoursOfMaterials) {
  file("two.mtl", "newmtl red\nKd 1 0 0\nnewmtl dark\nKd 0.2 0.4 0.6\n");
  const TriangleMesh mesh = import_mesh(
      file("a.obj", "mtllib two.mtl\n" + kCorners +
                        "usemtl dark\nf 1 3 2\nusemtl red\nf 1 2 4\nf 2 3 4\nf 1 4 3\n"));
  ASSERT_EQ(mesh.colours.size(), 4u);
  for (size_t i = 0; i < 4; ++i) {
    // By the triangle's position, since materials are grouped.
    const bool is_low = mesh.vertices[mesh.triangles[i][0]].z() +
                            mesh.vertices[mesh.triangles[i][1]].z() +
                            mesh.vertices[mesh.triangles[i][2]].z() ==
                        0;
    EXPECT_EQ(mesh.colours[i], is_low ? (Colour{51, 102, 153}) : (Colour{255, 0, 0}));
  }
  // Colours of glTF are linear.
  const TriangleMesh glb = import_mesh(
      file("a.glb",
           two_tetrahedra_glb(R"({"pbrMetallicRoughness":{"baseColorFactor":[1,0.215861,0,1]}})")));
  ASSERT_EQ(glb.colours.size(), 8u);
  EXPECT_THAT(glb.colours, Each(Colour{255, 128, 0}));
}

TEST_F(MeshImport, OneGreyOfAllIsNoColour) {
  const std::string faces = "f 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n";
  EXPECT_THAT(import_mesh(file("a.obj", kCorners + faces)).colours, IsEmpty());
  EXPECT_THAT(
      import_mesh(file("missing.obj", "mtllib none.mtl\n" + kCorners + "usemtl x\n" + faces))
          .colours,
      IsEmpty());
  file("grey.mtl", "newmtl grey\nKd 0.8 0.8 0.8\n");
  EXPECT_THAT(
      import_mesh(file("grey.obj", "mtllib grey.mtl\n" + kCorners + "usemtl grey\n" + faces))
          .colours,
      IsEmpty());
  EXPECT_THAT(import_mesh(file("a.glb", two_tetrahedra_glb())).colours, IsEmpty());
}

TEST_F(MeshImport, ATextureGivesEachTriangleItsMean) {
  file("four.png", four_pixels_png());
  const std::string text =
      "mtllib a.mtl\n" + kCorners +
      "vt 0.1 0.9\nvt 0.4 0.9\nvt 0.1 0.6\nvt 0.6 0.1\nvt 0.9 0.1\nvt 0.1 0.1\n"
      "usemtl t\n"
      "f 1/1 3/2 2/3\n"   // in the red pixel, above on the left
      "f 1/4 2/5 4/6\n";  // below: blue, and transparent
  file("a.mtl", "newmtl t\nKd 0.5 0.5 0.5\nmap_Kd four.png\n");
  EXPECT_THAT(import_mesh(file("a.obj", text)).colours,
              ElementsAre(Colour{255, 0, 0}, Colour{0, 0, 255}));
  EXPECT_THAT(import_mesh(file("a.obj", text)).lost_textures, IsEmpty());
}

// Corners of a triangle, identified by the x and y of its vertices.
std::array<float, 2> uv_at(const TriangleMesh& mesh, double x, double y) {
  for (size_t i = 0; i < mesh.triangles.size(); ++i) {
    for (size_t k = 0; k < 3; ++k) {
      const Vec3& v = mesh.vertices[mesh.triangles[i][k]];
      if (v.head<2>().isApprox(Eigen::Vector2d(x, y))) return mesh.texture_map.corners[i][k];
    }
  }
  return {-1e9f, -1e9f};
}

TEST_F(MeshImport, KeepsTexturesAndWhereTheyLie) {
  file("four.png", four_pixels_png());
  file("a.mtl", "newmtl t\nmap_Kd four.png\nnewmtl again\nmap_Kd four.png\nnewmtl red\nKd 1 0 0\n");
  const TriangleMesh mesh = import_mesh(
      file("a.obj",
           "mtllib a.mtl\nv 1 1 0\nv 2 1 0\nv 2 2 0\nv 1 2 0\nv 5 5 5\n"
           "vt -0.25 0\nvt 2.5 0.25\nvt 1 1\nusemtl t\nf 1/1 2/2 3/3\nusemtl red\nf 1 3 4\n"
           "usemtl again\nf 1/1 3/3 5/1\n"));
  ASSERT_EQ(mesh.triangles.size(), 3u);
  // Materials with the same texture share it.
  const TextureMap& map = mesh.texture_map;
  ASSERT_EQ(map.textures.size(), 1u);
  EXPECT_THAT(map.texture, testing::UnorderedElementsAre(0u, 1u, 1u));
  EXPECT_TRUE(is_sound(map, 3));
  // From the upper edge, also for coordinates beyond it.
  EXPECT_EQ(uv_at(mesh, 1, 1), (std::array<float, 2>{-0.25f, 1}));
  EXPECT_EQ(uv_at(mesh, 2, 1), (std::array<float, 2>{2.5f, 0.75f}));
  EXPECT_EQ(uv_at(mesh, 2, 2), (std::array<float, 2>{1, 0}));
  // A transparent pixel gets the mean of the others.
  const Texture& texture = *map.textures[0];
  EXPECT_EQ(texture.width, 2);
  EXPECT_EQ(texture.height, 2);
  const uint8_t third = srgb_from_linear(1.0 / 3);
  EXPECT_THAT(texture.pixels, ElementsAre(Colour{255, 0, 0}, Colour{0, 255, 0}, Colour{0, 0, 255},
                                          Colour{third, third, third}));
}

TEST_F(MeshImport, ATextureInAGlbIsMultipliedByItsMaterialsColour) {
  const TriangleMesh mesh = import_mesh(file("a.glb", textured_triangle_glb(four_pixels_png())));
  ASSERT_EQ(mesh.texture_map.textures.size(), 1u);
  // Linear 0.5, 1 and 0.25. The material makes the whole picture opaque.
  EXPECT_THAT(
      mesh.texture_map.textures[0]->pixels,
      ElementsAre(Colour{188, 0, 0}, Colour{0, 255, 0}, Colour{0, 0, 137}, Colour{0, 0, 0}));
  EXPECT_NEAR(uv_at(mesh, 1, 0)[0], 0.5f, 1e-6);
  EXPECT_NEAR(uv_at(mesh, 1, 0)[1], 0.25f, 1e-6);
  EXPECT_NEAR(uv_at(mesh, 0, 1)[1], 3, 1e-6);
  // A mirrored node reverses its triangles: corners keep their coordinates.
  const TriangleMesh mirrored =
      import_mesh(file("m.glb", textured_triangle_glb(four_pixels_png(), true)));
  EXPECT_NEAR(uv_at(mirrored, -1, 0)[0], 0.5f, 1e-6);
  EXPECT_NEAR(uv_at(mirrored, 0, 1)[1], 3, 1e-6);
}

TEST_F(MeshImport, ShrinksALargeTexture) {
  std::vector<uint8_t> rgba(size_t{4} * 5000 * 3, 255);
  for (size_t i = 0; i < rgba.size(); i += 8) rgba[i] = rgba[i + 1] = rgba[i + 2] = 0;
  file("wide.png", png(5000, 3, rgba));
  file("a.mtl", "newmtl t\nmap_Kd wide.png\n");
  const TriangleMesh mesh = import_mesh(file(
      "a.obj", "mtllib a.mtl\n" + kCorners + "vt 0 0\nvt 1 0\nvt 0 1\nusemtl t\nf 1/1 2/2 3/3\n"));
  ASSERT_EQ(mesh.texture_map.textures.size(), 1u);
  const Texture& texture = *mesh.texture_map.textures[0];
  EXPECT_EQ(texture.width, kLargestTexture);
  EXPECT_EQ(texture.height, 1);
  double light = 0;
  for (const Colour& pixel : texture.pixels) light += linear_from_srgb(pixel[0]) / texture.width;
  EXPECT_NEAR(light, 0.5, 0.005);
}

TEST_F(MeshImport, WhereVerticesHaveColoursATextureIsItsMean) {
  const TriangleMesh white =
      import_mesh(file("a.glb", textured_triangle_glb(four_pixels_png(), false, {1, 1, 1})));
  EXPECT_THAT(white.texture_map.texture, ElementsAre(1u));
  const TriangleMesh grey = import_mesh(
      file("b.glb", textured_triangle_glb(four_pixels_png(), false, {0.5f, 0.5f, 0.5f})));
  EXPECT_TRUE(grey.texture_map.empty());
  EXPECT_EQ(grey.colours.size(), 1u);
}

TEST_F(MeshImport, AGreyTextureIsMoreThanOneGrey) {
  file("grey.png", png(2, 1, {90, 90, 90, 255, 210, 210, 210, 255}));
  file("a.mtl", "newmtl t\nmap_Kd grey.png\n");
  const TriangleMesh mesh = import_mesh(
      file("a.obj", "mtllib a.mtl\n" + kCorners +
                        "vt 0 0\nvt 2 0\nvt 2 2\nusemtl t\nf 1/1 2/2 3/3\nf 1/1 3/2 4/3\n"));
  EXPECT_EQ(mesh.texture_map.textures.size(), 1u);
  EXPECT_EQ(mesh.colours.size(), 2u);
}

TEST_F(MeshImport, ATextureThatCannotBeReadIsSaid) {
  const std::string text =
      "mtllib a.mtl\n" + kCorners +
      "vt 0.1 0.9\nvt 0.4 0.9\nvt 0.1 0.6\nusemtl t\nf 1/1 3/2 2/3\nf 1/1 2/2 4/3\n";
  const std::string whole = four_pixels_png();
  file("half.png", whole.substr(0, whole.size() / 2));
  // Its first IDAT chunk is empty: stb_image would copy from nowhere.
  std::string empty = whole;
  empty.insert(whole.find("IDAT") - 4, std::string("\0\0\0\0IDAT\x35\xaf\x06\x1e", 12));
  file("empty.png", empty);
  std::string wide = whole;
  wide.replace(whole.find("IHDR") + 4, 4, std::string("\0\0\x40\0", 4));
  file("wide.png", wide);
  const std::vector<std::pair<std::string, std::string>> faults = {
      {"none.png", "is not there"},
      {"/dev/zero", "is not there"},
      {"a.obj", "is no picture of a known format"},
      {"half.png", "is broken"},
      {"empty.png", "is broken"},
      {"wide.png", "has 16384 x 2 pixels"}};
  for (const auto& [name, why] : faults) {
    file("a.mtl", "newmtl t\nKd 0.2 0.4 0.6\nmap_Kd " + name + '\n');
    const TriangleMesh mesh = import_mesh(file("a.obj", text));
    EXPECT_THAT(mesh.colours, Each(Colour{51, 102, 153})) << name;  // the material's colour
    EXPECT_TRUE(mesh.texture_map.empty()) << name;
    EXPECT_THAT(mesh.lost_textures,
                ElementsAre("texture \"" + name + "\" of material \"t\" " + why));
  }
}

TEST_F(MeshImport, KeepsTheColoursOfVertices) {
  const TriangleMesh mesh = import_mesh(
      file("a.ply",
           "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
           "property float z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n"
           "element face 2\nproperty list uchar int vertex_indices\nend_header\n"
           "0 0 0 250 10 20\n1 0 0 250 10 20\n0 1 0 250 10 20\n0 0 1 10 10 20\n"
           "3 0 2 1\n3 0 1 3\n"));
  ASSERT_EQ(mesh.colours.size(), 2u);
  for (size_t k = 0; k < 3; ++k) {
    EXPECT_NEAR(mesh.colours[0][k], (Colour{250, 10, 20})[k], 1);
  }
  EXPECT_LT(mesh.colours[1][0], 200);
  EXPECT_GT(mesh.colours[1][0], 150);
}

TEST_F(MeshImport, SaysWhatIsWrongWithAFile) {
  expect_error(directory_ / "none.obj", ErrorKind::io, "No such file");
  expect_error(directory_, ErrorKind::io, "Is a directory");
  expect_error(file("empty.obj", ""), ErrorKind::input, "cannot be read as a mesh");
  expect_error(file("text.obj", "hello, hello, hello, hello\n"), ErrorKind::input, "");
  expect_error(file("note.txt", "hello, hello, hello, hello\n"), ErrorKind::input,
               "cannot be read as a mesh");
  expect_error(file("index.obj", kCorners + "f 1 2 9\n"), ErrorKind::input, "out of range");
  expect_error(file("nan.obj", "v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"), ErrorKind::input,
               "not a finite number");
  expect_error(file("inf.obj", "v 1e600 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"), ErrorKind::input,
               "not a finite number");
  expect_error(file("points.obj", kCorners + "p 1 2 3\n"), ErrorKind::input,
               "contains no triangles");
  expect_error(file("spot.obj", "v 1 1 1\nv 1 1 1\nv 1 1 1\nf 1 2 3\n"), ErrorKind::input,
               "contains no triangle of any extent");
}

// A header whose lengths exceed the file.
TEST_F(MeshImport, LengthsThatAreNotThereTakeNoMemory) {
  std::string glb = two_tetrahedra_glb().substr(0, 20);
  const uint32_t length = 0xFFFFFFF0;
  std::memcpy(glb.data() + 12, &length, sizeof length);
  expect_error(file("length.glb", glb + "{}"), ErrorKind::input, "cannot be read as a mesh");
  std::string stl(84, '\0');
  std::memcpy(stl.data() + 80, &length, sizeof length);
  expect_error(file("count.stl", stl), ErrorKind::input, "cannot be read as a mesh");
  expect_error(file("count.ply",
                    "ply\nformat binary_little_endian 1.0\nelement vertex 4000000000\n"
                    "property float x\nproperty float y\nproperty float z\n"
                    "element face 4000000000\nproperty list uchar int vertex_index\nend_header\n"),
               ErrorKind::input, "more elements than bytes");
  // Two lengths up to which assimp would count without reading a byte.
  for (const char* count : {"4000000000", "99999999999999999999"}) {
    expect_error(file("flkat.ply", std::string("ply\nformat binary_little_endian 1.0\n") +
                                       "element vertex " + count +
                                       "\nproperty flkat x\nproperty float y\nend_header\n"),
                 ErrorKind::input, "more elements than bytes");
  }
  expect_error(file("count.off", "OFF\n4000000000 4000000000 0\n0 0 0\n"), ErrorKind::input, "");
  // A list's length is in the body.
  const uint32_t entries = 150'000'000;
  std::string ply =
      "ply\nformat binary_little_endian 1.0\nelement vertex 1\nproperty float x\n"
      "element face 1\nproperty list uint int vertex_index\nend_header\n" +
      std::string(8, '\0');
  std::memcpy(ply.data() + ply.size() - 4, &entries, sizeof entries);
  expect_error(file("list.ply", ply), ErrorKind::input, "cannot be read as a mesh");
  rusage of_children{};
  getrusage(RUSAGE_CHILDREN, &of_children);
  EXPECT_LT(of_children.ru_maxrss, 1 << 20) << "KB, what sanitizers take included";
}

// Found by libFuzzer. Rejected by the header, since assimp would read for ever.
TEST_F(MeshImport, AHeadWithoutAnEndIsRefused) {
  const std::string head =
      "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
      "property float z\nelement face 1\nproperty list uchar int vertex_indices\n";
  for (const std::string end :
       {"", "end_heade", "end_header_\n", "comment end_header\n", "\r\n \n", "element"}) {
    expect_error(file("no_end.ply", head + end), ErrorKind::input, "whose head has no end");
    expect_error(file("no_end.ply", "PLY" + head.substr(3) + end), ErrorKind::input,
                 "whose head has no end");
  }
  const std::string triangle = "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
  for (const std::string end : {"end_header\n", "end_header\r\n", " \tend_header\n"}) {
    EXPECT_EQ(import_mesh(file("whole.ply", head + end + triangle)).triangles.size(), 1u) << end;
  }
}

// Rejects devices and pipes, also when another file names them.
TEST_F(MeshImport, ReadsRegularFilesOnly) {
  expect_error("/dev/zero", ErrorKind::io, "expected a regular file");
  const std::string triangle = kCorners + "f 1 2 3\n";
  EXPECT_EQ(import_mesh(file("a.obj", "mtllib /dev/zero\n" + triangle)).triangles.size(), 1u);
  ASSERT_EQ(mkfifo((directory_ / "pipe.mtl").c_str(), 0600), 0);
  EXPECT_EQ(import_mesh(file("b.obj", "mtllib pipe.mtl\n" + triangle)).triangles.size(), 1u);
}

TEST_F(MeshImport, ReadsBuffersBesideTheFile) {
  const std::string glb = two_tetrahedra_glb();
  file("a.bin", glb.substr(glb.size() - 72));
  std::string json = glb.substr(20, glb.size() - 72 - 8 - 20);
  const std::string length = R"({"byteLength":72})";
  json.replace(json.find(length), length.size(), R"({"byteLength":72,"uri":"a.bin"})");
  EXPECT_EQ(import_mesh(file("a.gltf", json)).triangles.size(), 8u);
  std::filesystem::remove(directory_ / "a.bin");
  expect_error(directory_ / "a.gltf", ErrorKind::input, "cannot be read as a mesh");
}

// Cells of a welding grid counted from the origin would exceed the precision of double.
TEST_F(MeshImport, FarFromTheOriginEndsToo) {
  const TriangleMesh mesh =
      import_mesh(file("far.obj", "v 1e30 0 0\nv 1e30 1 0\nv 1e30 0 1\nf 1 2 3\n"));
  EXPECT_EQ(mesh.triangles.size(), 1u);
  try {
    import_mesh(directory_ / "far.obj", 1e30);
    ADD_FAILURE() << "expected an error";
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), HasSubstr("farther than 1e50 m"));
  }
}

// Numbers as in the text, not in single precision.
TEST_F(MeshImport, TextsKeepAllDigitsOfTheirCoordinates) {
  const std::array<std::string, 4> corners = {
      "500000.0001 -0.25 5200000.125", "500000.1001 -0.25 5200000.125",
      "500000.0001 +0.75e-1 5200000.125", "500000.0001 -0.25 5200000.3251"};
  const auto vertices = [&](const std::string& before, const std::string& after) {
    std::string text;
    for (const std::string& corner : corners) text += before + corner + after;
    return text;
  };
  const auto facet = [&](size_t a, size_t b, size_t c) {
    return "facet normal 0 0 0\nouter loop\n  vertex " + corners[a] + "\n  vertex " + corners[b] +
           "\n  vertex " + corners[c] + "\nendloop\nendfacet\n";
  };
  const std::string faces = "f 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n";
  const std::string header =
      "ply\nformat ascii 1.0\nelement vertex 4\nproperty double x\nproperty double y\nproperty "
      "double z\nproperty float w\nelement face 4\nproperty list uchar int "
      "vertex_indices\nend_header\n";
  const std::vector<std::filesystem::path> files = {
      file("a.obj", "# v 1 2\n" + vertices("v ", "\n") + "vn 0 0 1\n" + faces),
      file("crlf.OBJ", vertices("v  ", " 1 0.5 0\r\n") + faces),
      file("a.stl", "solid a\n" + facet(0, 2, 1) + facet(0, 1, 3) + facet(1, 2, 3) +
                        facet(0, 3, 2) + "endsolid a\n"),
      file("a.ply", header + vertices("", " 7\n") + "3 0 2 1\n3 0 1 3\n3 1 2 3\n3 0 3 2\n")};
  for (const std::filesystem::path& each : files) {
    SCOPED_TRACE(each);
    const TriangleMesh mesh = import_mesh(each);
    ASSERT_EQ(mesh.vertices.size(), 4u);
    EXPECT_EQ(mesh.bounds().min(), Vec3(500000.0001, -0.25, 5200000.125));
    EXPECT_EQ(mesh.bounds().max(), Vec3(500000.1001, 0.075, 5200000.3251));
    EXPECT_LT(mesh.rounding_m, 1e-3);
  }
  // Two vertices that single precision could not distinguish, although near the origin.
  const TriangleMesh near =
      import_mesh(file("near.obj", "v 0 0 0\nv 1 0.1234567890123 0\nv 0 1 0\nv 0 0 1\n" + faces));
  EXPECT_EQ(near.bounds().max().x(), 1);
  EXPECT_TRUE(std::ranges::count(near.vertices, Vec3(1, 0.1234567890123, 0)) == 1);
}

// Quads and concave polygons are triangulated as near the origin.
TEST_F(MeshImport, PolygonsFarFromTheOriginAreTriangulated) {
  const auto text = [](double x) {
    std::string vertices;
    for (const auto& [a, b] :
         {std::pair(0.0, 0.0), {2.0, 0.0}, {2.0, 2.0}, {1.0, 0.5}, {0.0, 2.0}}) {
      vertices += "v " + std::to_string(x + a) + ' ' + std::to_string(b) + " 0\n";
    }
    return vertices + "f 1 2 3 4 5\n";
  };
  const TriangleMesh near = import_mesh(file("near.obj", text(0)));
  const TriangleMesh far = import_mesh(file("far.obj", text(5e6)));
  EXPECT_EQ(far.triangles, near.triangles);
}

TEST_F(MeshImport, RefusesWhatSinglePrecisionWouldSpoil) {
  const float far = 5.2e6F;
  const float positions[] = {far, 0, 0, far + 1, 0, 0, far, 1, 0, far, 0, 1};
  const uint16_t indices[] = {0, 2, 1, 0, 1, 3, 1, 2, 3, 0, 3, 2};
  std::string binary(sizeof positions + sizeof indices, '\0');
  std::memcpy(binary.data(), positions, sizeof positions);
  std::memcpy(binary.data() + sizeof positions, indices, sizeof indices);
  const std::string glb = glb_of(
      R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],
"meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1}]}],
"buffers":[{"byteLength":72}],
"bufferViews":[{"buffer":0,"byteOffset":0,"byteLength":48},{"buffer":0,"byteOffset":48,"byteLength":24}],
"accessors":[{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3","min":[5200000,0,0],"max":[5200001,1,1]},
{"bufferView":1,"componentType":5123,"count":12,"type":"SCALAR"}]})",
      binary);
  expect_error(file("far.glb", glb), ErrorKind::input, "move it near its origin");
}

TEST_F(MeshImport, ReadsBackWhatTheWriterWrote) {
  TriangleMesh mesh = test::joined(box_mesh({1, 2, 3}), sphere_mesh(0.3, 2));
  mesh.groups = {{"box", 0, 12}, {"ball", 12, 320}};
  write_obj(mesh, directory_ / "a.obj");
  const TriangleMesh read = import_mesh(directory_ / "a.obj");
  ASSERT_EQ(read.triangles.size(), mesh.triangles.size());
  ASSERT_EQ(read.vertices.size(), mesh.vertices.size());
  ASSERT_EQ(read.groups.size(), 2u);
  EXPECT_EQ(read.groups[1].name, "ball");
  EXPECT_EQ(read.groups[1].first_triangle, 12u);
  for (size_t i = 0; i < mesh.triangles.size(); ++i) {
    for (size_t corner = 0; corner < 3; ++corner) {
      const Vec3& expected = mesh.vertices[mesh.triangles[i][corner]];
      const Vec3& actual = read.vertices[read.triangles[i][corner]];
      EXPECT_LE((actual - expected).norm(), 1e-6) << "triangle " << i;
    }
  }
}

}  // namespace
}  // namespace pilesim

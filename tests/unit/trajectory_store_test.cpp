#include <gmock/gmock.h>

#include <limits>
#include <nlohmann/json.hpp>
#include <thread>

#include "../support/trajectory_fixture.h"
#include "core/atomic_file.h"
#include "core/hash.h"
#include "core/subprocess.h"
#include "trajectory/trajectory_layout.h"

namespace pilesim {
namespace {

namespace fs = std::filesystem;
using test::error_text;
using test::make_frame;
using test::make_header;
using testing::HasSubstr;

using TrajectoryStore = test::TrajectoryTest;

TEST_F(TrajectoryStore, GivesBackTheHeader) {
  const TrajectoryHeader header = make_header(5);
  write_store(5, 0);
  const TrajectoryReader reader(store_);
  EXPECT_EQ(reader.header().frame_rate, header.frame_rate);
  EXPECT_EQ(reader.header().seed, header.seed);
  EXPECT_EQ(nlohmann::ordered_json::parse(reader.header().resolved_scene),
            nlohmann::ordered_json::parse(header.resolved_scene));
  EXPECT_EQ(reader.header().body_name, header.body_name);
  EXPECT_EQ(reader.header().body_shape, header.body_shape);
  EXPECT_EQ(reader.header().body_colour, header.body_colour);
  EXPECT_EQ(reader.header().body_moves, header.body_moves);
  ASSERT_EQ(reader.header().shapes.size(), 2u);
  EXPECT_EQ(reader.header().shapes[0].name, "tetrahedron");
  EXPECT_EQ(reader.header().shapes[0].vertices, header.shapes[0].vertices);
  EXPECT_EQ(reader.header().shapes[0].triangles, header.shapes[0].triangles);
  EXPECT_EQ(reader.header().shapes[0].type, "mesh");
  EXPECT_EQ(reader.header().shapes[0].file, header.shapes[0].file);
  EXPECT_EQ(reader.header().shapes[0].scale, 0.1);
  EXPECT_EQ(reader.header().shapes[0].centre_of_mass, Vec3(0.25, 1.0 / 3, -2));
  EXPECT_EQ(reader.header().shapes[0].principal_axes.coeffs(),
            header.shapes[0].principal_axes.coeffs());
  EXPECT_EQ(reader.header().materials, header.materials);
  EXPECT_EQ(reader.header().body_material, header.body_material);
  EXPECT_FALSE(reader.header().shapes[0].is_plane);
  EXPECT_TRUE(reader.header().shapes[1].is_plane);
  EXPECT_TRUE(reader.header().shapes[1].vertices.empty());
  EXPECT_EQ(reader.frame_count(), 0u);
}

TEST_F(TrajectoryStore, GivesBackTheColoursOfShapesAndWhoIsPainted) {
  TrajectoryHeader header = make_header(3);
  header.shapes[0].is_z_up = true;
  header.shapes[0].colours = {{1, 2, 3}, {4, 5, 6}, {7, 8, 9}, {250, 251, 252}};
  header.body_painted = {1, 0, 1};
  { const TrajectoryWriter writer(store_, header); }
  const TrajectoryReader reader(store_);
  EXPECT_EQ(reader.header().shapes[0].colours, header.shapes[0].colours);
  EXPECT_TRUE(reader.header().shapes[0].is_z_up);
  EXPECT_TRUE(reader.header().shapes[1].colours.empty());
  EXPECT_EQ(reader.header().body_painted, header.body_painted);
  // As many as triangles.
  fs::remove_all(store_);
  header.shapes[0].colours.pop_back();
  { const TrajectoryWriter writer(store_, header); }
  EXPECT_THROW(TrajectoryReader{store_}, Error);
}

TEST_F(TrajectoryStore, GivesBackRoundSurfacesAndRefusesThoseThatCannotBe) {
  TrajectoryHeader header = make_header(3);
  RoundSurface round{.first_triangle = 1, .triangle_count = 3};
  round.pose = {{1, -2, 0.125}, Quat(0.5, 0.5, -0.5, 0.5)};
  round.outline = {{0, -1, 0}, {0.25, -1, 0.5}, {0, 1, 0}};
  header.shapes[0].round = {round};
  { const TrajectoryWriter writer(store_, header); }
  const RoundSurface back = TrajectoryReader(store_).header().shapes[0].round.at(0);
  EXPECT_EQ(back.first_triangle, 1u);
  EXPECT_EQ(back.triangle_count, 3u);
  EXPECT_EQ(back.pose.position, round.pose.position);
  EXPECT_EQ(back.pose.orientation.coeffs(), round.pose.orientation.coeffs());
  ASSERT_EQ(back.outline.size(), 3u);
  EXPECT_EQ(back.outline[1].radius, 0.25);
  EXPECT_EQ(back.outline[1].y, -1);
  EXPECT_EQ(back.outline[1].bulge, 0.5);
  const auto refused = [&](const auto& change) {
    fs::remove_all(store_);
    TrajectoryHeader wrong = header;
    change(wrong.shapes[0].round[0]);
    { const TrajectoryWriter writer(store_, wrong); }
    EXPECT_THROW(TrajectoryReader{store_}, Error);
  };
  refused([](RoundSurface& surface) { surface.triangle_count = 4; });
  refused([](RoundSurface& surface) { surface.outline[1].bulge = 1.5; });
  refused([](RoundSurface& surface) { surface.outline[1].radius = -1; });
  refused([](RoundSurface& surface) { surface.outline.resize(1); });
  refused([](RoundSurface& surface) { surface.outline.resize(kMostOutlinePoints + 1); });
  header.shapes[0].colours.resize(4);
  refused([](RoundSurface&) {});
}

TEST_F(TrajectoryStore, GivesBackHowGlossyBodiesAre) {
  TrajectoryHeader header = make_header(3);
  header.body_gloss = {{0.45f, 0}, {0.1f, 1}, {1, 0.25f}};
  { const TrajectoryWriter writer(store_, header); }
  EXPECT_EQ(TrajectoryReader(store_).header().body_gloss, header.body_gloss);
  for (const float wrong : {-0.1f, 1.1f, std::numeric_limits<float>::quiet_NaN()}) {
    fs::remove_all(store_);
    header.body_gloss[1][0] = wrong;
    { const TrajectoryWriter writer(store_, header); }
    EXPECT_THROW(TrajectoryReader{store_}, Error) << wrong;
  }
}

TEST_F(TrajectoryStore, GivesBackSubstances) {
  TrajectoryHeader header = make_header(3);
  header.body_substance = {{1, 0, 0}, {0.5f, 1, 0}, {0, 0, 40}};
  { const TrajectoryWriter writer(store_, header); }
  EXPECT_EQ(TrajectoryReader(store_).header().body_substance, header.body_substance);
  for (size_t i = 0; i < 3; ++i) {
    fs::remove_all(store_);
    TrajectoryHeader wrong = header;
    wrong.body_substance[1][i] = -0.1f;
    { const TrajectoryWriter writer(store_, wrong); }
    EXPECT_THROW(TrajectoryReader{store_}, Error) << i;
  }
}

TEST_F(TrajectoryStore, GivesBackPatterns) {
  TrajectoryHeader header = make_header(3);
  header.body_pattern = {{1, 0.5f}, {0, 0.25f}, {3, 2}};
  { const TrajectoryWriter writer(store_, header); }
  EXPECT_EQ(TrajectoryReader(store_).header().body_pattern, header.body_pattern);
  for (const std::array<float, 2> row :
       {std::array{4.0f, 1.0f}, std::array{0.5f, 1.0f}, std::array{1.0f, 0.0f}}) {
    fs::remove_all(store_);
    TrajectoryHeader wrong = header;
    wrong.body_pattern[1] = row;
    { const TrajectoryWriter writer(store_, wrong); }
    EXPECT_THROW(TrajectoryReader{store_}, Error) << row[0] << ", " << row[1];
  }
}

std::shared_ptr<const Texture> plain_texture(int width, int height, uint8_t grey) {
  const auto count = static_cast<size_t>(width) * static_cast<size_t>(height);
  return std::make_shared<const Texture>(Texture{
      .width = width, .height = height, .pixels = std::vector<Colour>(count, {grey, 7, 9})});
}

TEST_F(TrajectoryStore, GivesBackTexturesAndWritesEachOnce) {
  TrajectoryHeader header = make_header(3);
  header.shapes.push_back(header.shapes[0]);
  TextureMap& first = header.shapes[0].texture_map;
  first.textures = {plain_texture(2, 3, 1), plain_texture(64, 64, 2)};
  first.texture = {1, 2, 0, 2};
  first.corners.resize(4);
  first.corners[1] = {{{0.25f, -3}, {1, 2}, {0, 0.5f}}};
  TextureMap& second = header.shapes[2].texture_map;
  second.textures = {plain_texture(64, 64, 2), plain_texture(1, 1, 3)};
  second.texture = {1, 1, 0, 2};
  second.corners.resize(4);
  { const TrajectoryWriter writer(store_, header); }
  EXPECT_TRUE(fs::exists(store_ / "textures/2"));
  EXPECT_FALSE(fs::exists(store_ / "textures/3"));
  const TrajectoryReader reader(store_);
  for (const size_t shape : {0, 2}) {
    const TextureMap& wrote = header.shapes[shape].texture_map;
    const TextureMap& read = reader.header().shapes[shape].texture_map;
    EXPECT_EQ(read.corners, wrote.corners);
    ASSERT_EQ(read.texture.size(), 4u);
    for (size_t i = 0; i < 4; ++i) {
      ASSERT_EQ(read.texture[i] == 0, wrote.texture[i] == 0);
      if (read.texture[i] == 0) continue;
      EXPECT_EQ(*read.textures[read.texture[i] - 1], *wrote.textures[wrote.texture[i] - 1]);
    }
  }
  EXPECT_TRUE(reader.header().shapes[1].texture_map.empty());
}

TEST_F(TrajectoryStore, RefusesTexturesThatCannotBe) {
  TrajectoryHeader header = make_header(3);
  TextureMap& map = header.shapes[0].texture_map;
  map.textures = {plain_texture(2, 3, 1)};
  const auto refuses = [&](const std::vector<uint32_t>& texture, float place, const char* found) {
    fs::remove_all(store_);
    map.texture = texture;
    map.corners.assign(texture.size(), {});
    map.corners[0][2][1] = place;
    { const TrajectoryWriter writer(store_, header); }
    EXPECT_THAT(test::error_text([&] { TrajectoryReader{store_}; }, ErrorKind::input),
                testing::HasSubstr(found));
  };
  refuses({1, 1, 0}, 0, "has 3 entries");
  refuses({1, 1, 0, 0}, std::numeric_limits<float>::quiet_NaN(), "not finite");
  map.textures = {plain_texture(kLargestTexture + 1, 1, 1)};
  refuses({1, 1, 0, 0}, 0, "the width of a texture is 2049");
}

// zstd compresses them to almost nothing.
TEST_F(TrajectoryStore, HoldsAMeshOfManyTrianglesOfOneColour) {
  TrajectoryHeader header = make_header(1);
  TrajectoryShape& shape = header.shapes[0];
  const size_t count = 300'000;
  shape.triangles.clear();
  for (uint32_t i = 0; i < count; ++i) shape.triangles.push_back({i * 7919 % 4, i % 3, i % 2});
  shape.colours.assign(count, {200, 10, 20});
  { const TrajectoryWriter writer(store_, header); }
  EXPECT_EQ(TrajectoryReader(store_).header().shapes[0].colours.size(), count);
}

TEST_F(TrajectoryStore, OfScenesWithoutColoursNothingIsWritten) {
  write_store(2, 0);
  EXPECT_FALSE(fs::exists(store_ / "textures"));
  EXPECT_FALSE(fs::exists(store_ / "shapes/0/texture"));
  EXPECT_FALSE(fs::exists(store_ / "body_painted"));
  EXPECT_FALSE(fs::exists(store_ / "body_gloss"));
  EXPECT_FALSE(fs::exists(store_ / "body_substance"));
  EXPECT_FALSE(fs::exists(store_ / "shapes/0/colours"));
  EXPECT_EQ(TrajectoryReader(store_).header().body_painted, std::vector<uint8_t>(2));
}

TEST_F(TrajectoryStore, GivesBackFramesOfWholeAndPartialChunks) {
  constexpr size_t kBodies = 3000;
  const uint64_t per_chunk = trajectory_layout::frames_per_chunk(kBodies);
  ASSERT_GT(per_chunk, 1u);
  for (const uint64_t frames : {uint64_t{1}, per_chunk, per_chunk + 1, 2 * per_chunk}) {
    fs::remove_all(store_);
    write_store(kBodies, frames);
    test::expect_frames(directory_, kBodies, frames);
  }
}

TEST_F(TrajectoryStore, ReadsInAnyOrder) {
  write_store(2, 600);
  TrajectoryReader reader(store_);
  TrajectoryFrame frame;
  for (const uint64_t index : {599, 0, 300, 255, 256, 599, 1}) {
    reader.read(index, frame);
    EXPECT_TRUE(test::equal(frame, make_frame(2, index))) << index;
  }
}

TEST_F(TrajectoryStore, HoldsASceneWithoutBodies) {
  write_store(0, 3);
  test::expect_frames(directory_, 0, 3);
}

TEST_F(TrajectoryStore, ChunksStayNearTwoMegabytes) {
  EXPECT_EQ(trajectory_layout::frames_per_chunk(0), 256u);
  EXPECT_EQ(trajectory_layout::frames_per_chunk(1), 256u);
  EXPECT_EQ(trajectory_layout::frames_per_chunk(10000), 13u);
  EXPECT_EQ(trajectory_layout::frames_per_chunk(10000000), 1u);
}

TEST_F(TrajectoryStore, FlushesWhatIsTooOldAndCountsHonestly) {
  {
    TrajectoryWriter writer(store_, make_header(2), 0);
    for (uint64_t frame = 0; frame < 3; ++frame) {
      writer.append(make_frame(2, frame));
      EXPECT_EQ(writer.frames_on_disk(), frame + 1);
      test::expect_frames(directory_, 2, frame + 1);
    }
  }
  fs::remove_all(store_);
  TrajectoryWriter writer(store_, make_header(2), 1e9);
  for (uint64_t frame = 0; frame < 3; ++frame) writer.append(make_frame(2, frame));
  EXPECT_EQ(writer.frames_on_disk(), 0u);
  EXPECT_EQ(TrajectoryReader(store_).frame_count(), 0u);
  writer.close();
  EXPECT_EQ(writer.frames_on_disk(), 3u);
  test::expect_frames(directory_, 2, 3);
}

std::string hash_of_tree(const fs::path& directory) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::recursive_directory_iterator(directory)) {
    if (entry.is_regular_file()) files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  Hasher hasher;
  for (const fs::path& file : files) {
    for (const std::string& text : {fs::relative(file, directory).string(), read_file(file)}) {
      hasher.add_values(std::span(text));
    }
  }
  return hasher.digest();
}

TEST_F(TrajectoryStore, TheSameFramesGiveTheSameFilesWheneverTheyWereWritten) {
  constexpr size_t kBodies = 40;
  write_store(kBodies, 300);
  const std::string at_once = hash_of_tree(store_);
  fs::remove_all(store_);
  TrajectoryWriter writer(store_, make_header(kBodies));
  for (uint64_t i = 0; i < 300; ++i) {
    writer.append(make_frame(kBodies, i));
    if (i % 7 == 0) writer.close();  // writes its frames, as it does after a second
  }
  writer.close();
  EXPECT_EQ(hash_of_tree(store_), at_once);
}

TEST_F(TrajectoryStore, RefusesAnExistingDirectory) {
  write_store(1, 1);
  EXPECT_THAT(error_text([&] { TrajectoryWriter(store_, make_header(1)); }, ErrorKind::io),
              HasSubstr("File exists"));
}

TEST_F(TrajectoryStore, ClosesWhenDestroyed) {
  { TrajectoryWriter(store_, make_header(2)).append(make_frame(2, 0)); }
  test::expect_frames(directory_, 2, 1);
}

// The exact numbers, through Debian's python3-zarr and code independent of trajectories.
TEST_F(TrajectoryStore, PythonReadsTheSameNumbers) {
  constexpr size_t kBodies = 700;
  constexpr uint64_t kFrames = 400;
  ASSERT_GT(kFrames, trajectory_layout::frames_per_chunk(kBodies));
  write_store(kBodies, kFrames);
  const std::string script = R"(
import sys, zarr
group = zarr.open(sys.argv[1], mode="r")
for name in ("position", "orientation", "state", "body_shape", "body_colour", "body_moves",
             "shapes/0/vertices", "shapes/0/triangles", "shapes/1/vertices"):
    array = group[name]
    print(name, array.shape, array.dtype, array.attrs["_ARRAY_DIMENSIONS"])
    open(sys.argv[2] + "/" + name.replace("/", "_"), "wb").write(array[:].tobytes())
for key in ("format", "format_version", "frame_rate", "seed", "scene_hash"):
    print(key, group.attrs[key])
print(group.attrs["scene"]["bodies"][0]["a"], group.attrs["scene"]["duration_s"], group.attrs["body_name"][1])
)";
  const TrajectoryHeader header = make_header(kBodies);
  EXPECT_EQ(
      run_program({"/usr/bin/python3", "-c", script, store_, directory_.path()}, "python3-zarr"),
      "position (400, 700, 3) float64 ['frame', 'body', 'xyz']\n"
      "orientation (400, 700, 4) float32 ['frame', 'body', 'wxyz']\n"
      "state (400, 700) uint8 ['frame', 'body']\n"
      "body_shape (700,) uint32 ['body']\n"
      "body_colour (700, 3) uint8 ['body', 'channel']\n"
      "body_moves (700,) uint8 ['body']\n"
      "shapes/0/vertices (4, 3) float32 ['vertex', 'axis']\n"
      "shapes/0/triangles (4, 3) uint32 ['triangle', 'corner']\n"
      "shapes/1/vertices (0, 3) float32 ['vertex', 'axis']\n"
      "format pilesim-trajectory\nformat_version 3\nframe_rate 23.976023976023978\n"
      "seed 18364758544493064720\nscene_hash " +
          header.scene_hash + "\n2 0.1 bodies/1\n");

  std::string position, orientation, state;
  const auto add = [](std::string& bytes, const void* values, size_t size) {
    bytes.append(static_cast<const char*>(values), size);
  };
  for (uint64_t i = 0; i < kFrames; ++i) {
    const TrajectoryFrame frame = make_frame(kBodies, i);
    for (size_t body = 0; body < kBodies; ++body) {
      const Vec3& p = frame.position[body];
      const Quatf& q = frame.orientation[body];
      const double xyz[] = {p.x(), p.y(), p.z()};
      const float wxyz[] = {q.w(), q.x(), q.y(), q.z()};
      add(position, xyz, sizeof xyz);
      add(orientation, wxyz, sizeof wxyz);
      add(state, &frame.state[body], 1);
    }
  }
  EXPECT_TRUE(read_file(directory_ / "position") == position);
  EXPECT_TRUE(read_file(directory_ / "orientation") == orientation);
  EXPECT_TRUE(read_file(directory_ / "state") == state);
  const auto same = [&](const char* file, const auto& values) {
    std::string bytes;
    add(bytes, values.data(), values.size() * sizeof values[0]);
    return read_file(directory_ / file) == bytes;
  };
  EXPECT_TRUE(same("body_shape", header.body_shape));
  EXPECT_TRUE(same("body_colour", header.body_colour));
  EXPECT_TRUE(same("body_moves", header.body_moves));
  EXPECT_TRUE(same("shapes_0_vertices", header.shapes[0].vertices));
  EXPECT_TRUE(same("shapes_0_triangles", header.shapes[0].triangles));
}

// 1e-6 of a body's size, at the origin and 1,000 km away, for a body of any size.
TEST_F(TrajectoryStore, PositionsAreExactFarAway) {
  for (const float size : {1e-3f, 0.2f, 30.0f}) {
    TrajectoryHeader header = make_header(1);
    for (Vec3f& vertex : header.shapes[0].vertices) vertex *= size;
    for (const Vec3& place :
         {Vec3(0.1, 0.2, -0.3), Vec3(500000.1, 0.07, 5200000.3), Vec3(-1e6 / 3, 1e6, 0.7)}) {
      TrajectoryFrame frame = make_frame(1, 0);
      frame.position = {place};
      fs::remove_all(store_);
      TrajectoryWriter(store_, header).append(frame);
      TrajectoryReader(store_).read(0, frame);
      EXPECT_LT((frame.position[0] - place).norm(), 1e-6 * size) << size << " at " << place.x();
    }
  }
}

// Killed between the three renames of a write.
TEST_F(TrajectoryStore, TakesTheShortestOfTheThreeArrays) {
  write_store(2, 5);
  for (const char* name : {"position", "orientation", "state"}) {
    const fs::path file = store_ / name / ".zarray";
    const std::string whole = read_file(file);
    auto json = nlohmann::ordered_json::parse(whole);
    json["shape"][0] = 4;
    write_file_atomically(file, json.dump());
    test::expect_frames(directory_, 2, 4);
    write_file_atomically(file, whole);
  }
  test::expect_frames(directory_, 2, 5);
}

}  // namespace
}  // namespace pilesim

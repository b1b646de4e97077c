// Full disks, kill -9 and damaged stores.
#include <gmock/gmock.h>
#include <sys/wait.h>

#include <csignal>
#include <nlohmann/json.hpp>
#include <thread>

#include "../support/small_disk.h"
#include "../support/trajectory_fixture.h"
#include "core/atomic_file.h"
#include "core/subprocess.h"
#include "support/scratch_directory.h"
#include "trajectory/trajectory_layout.h"
#include "trajectory/zarr_array.h"

namespace pilesim {
namespace {

namespace fs = std::filesystem;
using test::error_text;
using test::make_frame;
using test::make_header;
using testing::AllOf;
using testing::EndsWith;
using testing::HasSubstr;
using testing::StartsWith;

TEST(TrajectoryFailure, FullDiskIsAnErrorAndKeepsTheFramesBefore) {
  test::on_a_small_disk(400 << 10, [](const test::SmallDisk& disk) {
    constexpr size_t kBodies = 300;
    const fs::path store = disk.directory / "trajectory.zarr";
    TrajectoryWriter writer(store, make_header(kBodies));
    uint64_t appended = 0;
    const std::string text = error_text(
        [&] {
          while (appended < 1000) {
            writer.append(make_frame(kBodies, appended));
            ++appended;
            writer.close();  // writes its frames, as it does after a second
          }
        },
        ErrorKind::io);
    EXPECT_THAT(text,
                testing::ContainsRegex("cannot be (written|created): (No space left|File too)"));
    EXPECT_GT(writer.frames_on_disk(), 5u);
    EXPECT_EQ(writer.frames_on_disk(), appended - 1);
    test::expect_frames(store, kBodies, writer.frames_on_disk());
    EXPECT_EQ(test::count_temporary_files(disk.directory), 0u);

    // Frames in memory are not lost either, once there is room.
    disk.make_room();
    writer.append(make_frame(kBodies, appended));
    writer.close();
    test::expect_frames(store, kBodies, appended + 1);
  });
}

TEST(TrajectoryFailure, FullDiskAtTheEndOfAChunkIsAnErrorOfEveryFurtherFrame) {
  test::on_a_small_disk(1 << 20, [](const test::SmallDisk& disk) {
    constexpr size_t kBodies = 20000;  // 6 frames per chunk
    const fs::path store = disk.directory / "trajectory.zarr";
    TrajectoryWriter writer(store, make_header(kBodies));
    uint64_t index = 0;
    const auto append = [&] {
      for (; index < 20; ++index) writer.append(make_frame(kBodies, index));
    };
    error_text(append, ErrorKind::io);
    error_text(append, ErrorKind::io);
    test::expect_frames(store, kBodies, 0);
    disk.make_room();
    ++index;  // its frame is in memory: the append that threw had taken it
    append();
    writer.close();
    test::expect_frames(store, kBodies, 20);
  });
}

TEST(TrajectoryFailure, UnwritableDirectoryIsAnIoError) {
  EXPECT_THAT(
      error_text([] { TrajectoryWriter("/proc/trajectory.zarr", make_header(1)); }, ErrorKind::io),
      HasSubstr("/proc/trajectory.zarr"));
}

// Otherwise a run would continue in a store that has lost its earlier frames.
TEST(TrajectoryFailure, ARemovedStoreIsNotHalfRemade) {
  const test::ScratchDirectory directory;
  const fs::path gone = directory / "gone";
  const auto group = [&] { create_zarr_group(gone / "shapes"); };
  const auto array = [&] {
    create_zarr_array({.directory = gone / "state", .layout = trajectory_layout::state(1)},
                      {"frame", "body"}, "");
  };
  EXPECT_THAT(error_text(group, ErrorKind::io), HasSubstr("cannot be created: No such file"));
  EXPECT_THAT(error_text(array, ErrorKind::io), HasSubstr("cannot be created: No such file"));
  EXPECT_FALSE(fs::exists(gone));
}

// Writes frames one by one until it is killed; reports its start and each frame.
[[noreturn]] void write_for_ever(const fs::path& store, size_t bodies, int progress) {
  TrajectoryWriter writer(store, make_header(bodies));
  for (uint64_t i = 0; write(progress, "f", 1) == 1; ++i) {
    writer.append(make_frame(bodies, i));
    writer.close();
  }
  _exit(1);
}

TEST(TrajectoryFailure, Kill9LeavesAValidPrefix) {
  constexpr int kRounds = 25;
  constexpr size_t kBodies = 12;
  const test::ScratchDirectory directory;
  std::vector<std::string> python = {
      "/usr/bin/python3", "-c",
      "import sys, zarr\n"
      "for path in sys.argv[1:]:\n"
      "    group = zarr.open(path, mode='r')\n"
      "    print(min(len(group[name][:]) for name in ('position', 'orientation', 'state')))\n"};
  std::string expected;
  uint64_t most = 0;
  for (int round = 0; round < kRounds; ++round) {
    const fs::path store = directory / std::to_string(round);
    int progress[2];
    ASSERT_EQ(pipe(progress), 0);
    const pid_t child = fork();
    ASSERT_GE(child, 0);
    if (child == 0) write_for_ever(store, kBodies, progress[1]);
    close(progress[1]);
    // After this many frames and part of the time of the next one.
    Philox random(5, Stream::test, round);
    const uint64_t least = random.index(12);
    char byte;
    for (uint64_t i = 0; i <= least; ++i) ASSERT_EQ(read(progress[0], &byte, 1), 1);
    std::this_thread::sleep_for(std::chrono::microseconds(random.index(3000)));
    kill(child, SIGKILL);
    waitpid(child, nullptr, 0);
    close(progress[0]);

    const uint64_t frames = TrajectoryReader(store).frame_count();
    test::expect_frames(store, kBodies, frames);
    EXPECT_GE(frames, least);
    most = std::max(most, frames);
    python.push_back(store);
    expected += std::to_string(frames) + "\n";
  }
  EXPECT_GT(most, 5u);
  EXPECT_EQ(run_program(python, "python3-zarr"), expected);
}

class DamagedTrajectory : public test::TrajectoryTest {
 protected:
  DamagedTrajectory() { write_store(3, 5); }

  void change(const char* file, const std::function<void(nlohmann::ordered_json&)>& edit) {
    auto json = nlohmann::ordered_json::parse(read_file(store_ / file));
    edit(json);
    write_file_atomically(store_ / file, json.dump());
  }
  std::string open_error(ErrorKind kind = ErrorKind::input) {
    return error_text([&] { TrajectoryReader reader(store_); }, kind);
  }
  std::string read_error() {
    TrajectoryReader reader(store_);
    TrajectoryFrame frame;
    return error_text([&] { reader.read(0, frame); }, ErrorKind::input);
  }
};

TEST_F(DamagedTrajectory, NothingThere) {
  EXPECT_EQ(error_text([] { TrajectoryReader reader("/no/where"); }, ErrorKind::input),
            "/no/where: does not exist; expected a trajectory.zarr, or a directory that holds one. "
            "Name the output directory of `pilesim simulate`");
  fs::remove(store_ / ".zattrs");
  EXPECT_THAT(open_error(), HasSubstr("holds no trajectory"));
}

TEST_F(DamagedTrajectory, OtherFormatOrVersion) {
  change(".zattrs", [](auto& json) { json["format_version"] = 99; });
  EXPECT_THAT(open_error(),
              EndsWith(".zattrs: format_version is 99; expected 3. Run the simulation "
                       "again with this version of pilesim"));
  change(".zattrs", [](auto& json) { json["format"] = "xarray"; });
  EXPECT_THAT(open_error(), HasSubstr("format is \"xarray\"; expected \"pilesim-trajectory\""));
  write_file_atomically(store_ / ".zattrs", "[1, 2");
  EXPECT_THAT(open_error(), HasSubstr(".zattrs:1:6: is no valid JSON"));
  write_file_atomically(store_ / ".zattrs", "[1, 2]");
  EXPECT_THAT(open_error(), HasSubstr(".zattrs: is not a JSON object"));
  write_file_atomically(store_ / ".zattrs", std::string(200'000, '['));
  EXPECT_THAT(open_error(), HasSubstr("is nested too deeply; expected at most 64 levels"));
}

TEST_F(DamagedTrajectory, AttributesOfAWrongKind) {
  change(".zattrs", [](auto& json) { json["frame_rate"] = "fast"; });
  EXPECT_THAT(open_error(), HasSubstr("frame_rate is \"fast\"; expected frames a second"));
  change(".zattrs", [](auto& json) { json["frame_rate"] = 0; });
  EXPECT_THAT(open_error(), HasSubstr("expected a number above 0"));
  change(".zattrs", [](auto& json) { json.erase("frame_rate"); });
  EXPECT_THAT(open_error(), HasSubstr("frame_rate is missing"));
}

TEST_F(DamagedTrajectory, MissingArrayDescription) {
  fs::remove(store_ / "orientation" / ".zarray");
  EXPECT_THAT(open_error(), AllOf(HasSubstr("orientation/.zarray: is missing from the trajectory"),
                                  HasSubstr("Copy the whole directory again")));
}

TEST_F(DamagedTrajectory, ArrayOfAnotherShapeOrType) {
  change("position/.zarray", [](auto& json) { json["shape"] = {5, 4, 3}; });
  EXPECT_THAT(open_error(), HasSubstr("position/.zarray: shape is [5,4,3]; expected [5,3,3]"));
  change("position/.zarray", [](auto& json) { json["shape"] = {5, 3}; });
  EXPECT_THAT(open_error(), HasSubstr("shape is [5,3]; expected 3 numbers"));
  change("position/.zarray", [](auto& json) { json["shape"] = {-5, 3, 3}; });
  EXPECT_THAT(open_error(), HasSubstr("shape is [-5,3,3]"));
  change("position/.zarray", [](auto& json) {
    json["shape"] = {5, 3, 3};
    json["dtype"] = "<f4";
  });
  EXPECT_THAT(open_error(), HasSubstr("dtype is \"<f4\"; expected \"<f8\""));
  change("position/.zarray", [](auto& json) {
    json["dtype"] = "<f8";
    json["compressor"] = {{"id", "blosc"}};
  });
  EXPECT_THAT(open_error(), HasSubstr("compressor is {\"id\":\"blosc\"}; expected zstd"));
}

TEST_F(DamagedTrajectory, IndicesOutOfRange) {
  change(".zattrs", [](auto& json) { json["shapes"].erase(1); });
  EXPECT_THAT(open_error(), HasSubstr("body_shape: holds the index 1; expected indices below 1"));
}

TEST_F(DamagedTrajectory, ShapesThatSayTooLittle) {
  change(".zattrs", [](auto& json) { json["shapes"][0]["centre_of_mass"] = {1, 2}; });
  EXPECT_THAT(open_error(), HasSubstr("centre_of_mass is [1,2]; expected x, y, z"));
  change(".zattrs", [](auto& json) { json["shapes"][0].erase("centre_of_mass"); });
  EXPECT_THAT(open_error(), HasSubstr("centre_of_mass is missing"));
}

TEST_F(DamagedTrajectory, MaterialsOutOfRange) {
  change(".zattrs", [](auto& json) { json["materials"].erase(1); });
  EXPECT_THAT(open_error(),
              HasSubstr("body_material: holds the index 1; expected indices below 1"));
}

TEST_F(DamagedTrajectory, BodyCountsThatDisagree) {
  change(".zattrs", [](auto& json) { json["body_name"].push_back("one more"); });
  EXPECT_THAT(open_error(), HasSubstr("body_shape: has 3 entries; expected 4"));
}

TEST_F(DamagedTrajectory, MissingChunk) {
  fs::remove(store_ / "state" / "0.0");
  EXPECT_THAT(read_error(), HasSubstr("state/0.0: is missing from the trajectory"));
}

TEST_F(DamagedTrajectory, TruncatedOrChangedChunk) {
  const fs::path chunk = store_ / "position" / "0.0.0";
  const std::string whole = read_file(chunk);
  write_file_atomically(chunk, whole.substr(0, whole.size() / 2));
  EXPECT_THAT(read_error(), AllOf(HasSubstr("position/0.0.0: is corrupt"),
                                  HasSubstr("expected a zstd frame of 18432 bytes")));
  std::string changed = whole;
  changed[changed.size() / 2] ^= 1;
  write_file_atomically(chunk, changed);
  EXPECT_THAT(read_error(), HasSubstr("position/0.0.0: is corrupt"));
  write_file_atomically(chunk, "");
  EXPECT_THAT(read_error(), HasSubstr("not a zstd frame"));
  write_file_atomically(chunk, read_file(store_ / "orientation" / "0.0.0"));
  EXPECT_THAT(read_error(), HasSubstr("holds 12288 bytes"));
}

// Zeros compress by a factor of thousands: a zstd frame may promise, and contain, far more than its
// file.
TEST_F(DamagedTrajectory, SizesThatAreNotThereTakeNoMemory) {
  change("position/.zarray", [](auto& json) { json["chunks"][0] = 1'000'000'000; });
  EXPECT_THAT(open_error(), HasSubstr("has chunks of 1000000000 rows; expected at most 256"));
  change("position/.zarray", [](auto& json) { json["chunks"][0] = 256; });

  const fs::path array = store_ / "shapes" / "0" / "vertices";
  static constexpr uint64_t kRows = 100'000'000;
  change("shapes/0/vertices/.zarray", [](auto& json) {
    json["shape"][0] = kRows;
    json["chunks"][0] = kRows;
  });
  EXPECT_THAT(open_error(), AllOf(HasSubstr("vertices/0.0: holds "),
                                  HasSubstr("expected the 100000000 rows that .zarray tells of")));
  const ZarrArray zeros{
      .directory = array, .layout = {"<f4", {3}}, .rows_per_chunk = 10'000'000, .rows = 10'000'000};
  write_zarr_chunk(zeros, 0, {});  // 120 MB of zeros in some 4 KB
  write_zarr_shape(zeros);
  EXPECT_THAT(open_error(), HasSubstr("expected the 10000000 rows that .zarray tells of"));

  change("body_colour/.zarray", [](auto& json) {
    json["shape"][0] = kRows;
    json["chunks"][0] = kRows;
  });
  change("shapes/0/vertices/.zarray", [](auto& json) { json["shape"][0] = json["chunks"][0] = 1; });
  EXPECT_THAT(open_error(), HasSubstr("vertices/0.0: holds 120000000 bytes"));
}

}  // namespace
}  // namespace pilesim

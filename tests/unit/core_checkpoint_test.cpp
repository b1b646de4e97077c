// State streams and their files.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <map>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "core/atomic_file.h"
#include "core/checkpoint_file.h"
#include "core/error.h"
#include "core/state_stream.h"

namespace pilesim {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

struct Part {
  static constexpr bool kStoredAsItLies = true;
  uint32_t a = 0;
  float b = 0;
  bool operator==(const Part&) const = default;
};

struct Whole {
  bool flag = false;
  std::string text;
  std::vector<Vec3> points;
  std::vector<Part> parts;
  std::optional<Quatf> turn;
  std::map<std::pair<uint32_t, uint32_t>, double> by_pair;
  std::array<std::vector<uint8_t>, 2> lists;
  Bounds box;
  Pose pose;

  static void fields(auto& self, auto& stream) {
    stream(self.flag, self.text, self.points, self.parts, self.turn, self.by_pair, self.lists,
           self.box, self.pose);
  }
};

Whole example() {
  return {.flag = true,
          .text = "pile",
          .points = {{1, 2, 3}, {-0.0, 1e300, 5e-324}},
          .parts = {{1, 2.5F}, {3, -4.5F}},
          .turn = Quatf(0.5F, 0.5F, -0.5F, 0.5F),
          .by_pair = {{{1, 2}, 3.5}, {{0, 7}, -1}},
          .lists = {std::vector<uint8_t>{1, 2}, {}},
          .box = Bounds(Vec3(1, 2, 3), Vec3(4, 5, 6)),
          .pose = {Vec3(7, 8, 9), Quat(0, 1, 0, 0)}};
}

std::vector<std::byte> bytes_of(const Whole& whole) {
  StateWriter writer;
  writer(whole);
  return {writer.bytes().begin(), writer.bytes().end()};
}

TEST(StateStream, GivesBackWhatWasWritten) {
  const Whole written = example();
  const std::vector<std::byte> bytes = bytes_of(written);
  StateReader reader(bytes);
  Whole read;
  reader(read);
  EXPECT_EQ(reader.left(), 0U);
  EXPECT_EQ(read.flag, written.flag);
  EXPECT_EQ(read.text, written.text);
  EXPECT_EQ(read.points, written.points);
  EXPECT_EQ(read.parts, written.parts);
  EXPECT_EQ(read.turn->coeffs(), written.turn->coeffs());
  EXPECT_EQ(read.by_pair, written.by_pair);
  EXPECT_EQ(read.lists, written.lists);
  EXPECT_EQ(read.box.max(), written.box.max());
  EXPECT_EQ(read.pose.position, written.pose.position);
  EXPECT_TRUE(bytes_of(read) == bytes);
}

TEST(StateStream, RefusesWhatEndsTooEarly) {
  const std::vector<std::byte> bytes = bytes_of(example());
  for (size_t size = 0; size < bytes.size(); ++size) {
    StateReader reader(std::span<const std::byte>(bytes).first(size));
    Whole read;
    EXPECT_THROW(reader(read), Error) << size << " bytes";
  }
}

// Counts are checked against the bytes present before memory is allocated.
TEST(StateStream, DamagedAtRandomIsReadOrRefused) {
  const std::vector<std::byte> bytes = bytes_of(example());
  std::mt19937 random(3);
  for (int i = 0; i < 3000; ++i) {
    std::vector<std::byte> damaged = bytes;
    for (int change = 0; change <= i % 4; ++change) {
      damaged[random() % damaged.size()] = static_cast<std::byte>(random());
    }
    StateReader reader(damaged);
    Whole read;
    try {
      reader(read);
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::input);
    }
  }
}

class CheckpointFile : public testing::Test {
 protected:
  CheckpointFile()
      : file_(fs::path(testing::TempDir()) /
              (std::string("checkpoint_") +
               testing::UnitTest::GetInstance()->current_test_info()->name())) {
    fs::remove(file_);
  }

  std::string refusal() const {
    try {
      Checkpoint checkpoint(file_);
      checkpoint.require(kKey);
      return "";
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::input);
      EXPECT_THAT(error.what(), HasSubstr(file_.string()));
      return error.what();
    }
  }
  void write(const CheckpointKey& key) const { write_checkpoint(file_, key, bytes_of(example())); }

  static inline const CheckpointKey kKey{"simulate", "program", "scene", ""};
  fs::path file_;
};

TEST_F(CheckpointFile, GivesBackKeyAndState) {
  write(kKey);
  const Checkpoint checkpoint(file_);
  checkpoint.require(kKey);
  const std::vector<std::byte> state = bytes_of(example());
  EXPECT_TRUE(std::ranges::equal(checkpoint.state(), state));
}

TEST_F(CheckpointFile, OfOtherWorkIsRefusedWithTheReason) {
  write({"direct-pile", "program", "scene", ""});
  EXPECT_THAT(refusal(), HasSubstr("is of pilesim direct-pile"));
  write({"simulate", "another", "scene", ""});
  EXPECT_THAT(refusal(), HasSubstr("another build of pilesim"));
  write({"simulate", "program", "another", ""});
  EXPECT_THAT(refusal(), HasSubstr("another scene"));
  write({"simulate", "program", "scene", "state"});
  EXPECT_THAT(refusal(), HasSubstr("began from another state"));
  write(kKey);
  EXPECT_EQ(refusal(), "");
}

TEST_F(CheckpointFile, OfAnotherFormatOrVersionIsRefused) {
  write_file_atomically(file_, "a scene\n");
  EXPECT_THAT(refusal(), HasSubstr("is no checkpoint"));
  write(kKey);
  std::string bytes = read_file(file_);
  bytes[std::string("pilesim checkpoint\n").size()] = 99;
  write_file_atomically(file_, bytes);
  EXPECT_THAT(refusal(), HasSubstr("is of version 99"));
}

TEST_F(CheckpointFile, WithAnyByteChangedOrMissingIsRefused) {
  write(kKey);
  const std::string whole = read_file(file_);
  for (size_t i = 0; i < whole.size(); ++i) {
    std::string damaged = whole;
    damaged[i] = static_cast<char>(damaged[i] ^ 1);
    write_file_atomically(file_, damaged);
    EXPECT_NE(refusal(), "") << "byte " << i;
    write_file_atomically(file_, whole.substr(0, i));
    EXPECT_NE(refusal(), "") << "the first " << i << " bytes";
  }
}

TEST(ProgramHash, IsTheSameWithinAProcess) {
  EXPECT_EQ(program_hash(), program_hash());
  EXPECT_EQ(program_hash().size(), 32U);
}

}  // namespace
}  // namespace pilesim

#include <bit>
#include <cstring>
#include <limits>
#include <map>
#include <string>

#include "../support/trajectory_fixture.h"
#include "core/atomic_file.h"
#include "trajectory/trajectory_layout.h"

namespace pilesim {
namespace {

namespace fs = std::filesystem;

class TrajectoryRandom : public test::TrajectoryTest {};

// Any bit pattern: infinities, denormals, negative zeros and NaNs too.
float random_float(Philox& random) {
  switch (random.index(8)) {
    case 0:
      return std::numeric_limits<float>::infinity();
    case 1:
      return -0.0f;
    case 2:
      return std::numeric_limits<float>::denorm_min();
    default:
      return std::bit_cast<float>(random.bits());
  }
}

TEST_F(TrajectoryRandom, WrittenDataComesBack) {
  for (uint32_t round = 0; round < 10; ++round) {
    Philox random(11, Stream::test, round);
    const size_t bodies = random.index(2) == 0 ? random.index(5) : random.index(30000);
    const uint64_t frames = random.index(bodies < 5 ? 600 : 12);
    std::vector<TrajectoryFrame> written;
    fs::remove_all(store_);
    {
      TrajectoryWriter writer(store_, test::make_header(bodies));
      for (uint64_t i = 0; i < frames; ++i) {
        TrajectoryFrame frame;
        for (size_t body = 0; body < bodies; ++body) {
          float v[7];
          for (float& value : v) value = random_float(random);
          frame.position.emplace_back(v[0], v[1], v[2]);
          frame.orientation.emplace_back(v[3], v[4], v[5], v[6]);
          frame.state.push_back(static_cast<uint8_t>(random.bits()));
        }
        writer.append(frame);
        if (random.index(10) == 0) writer.close();
        written.push_back(std::move(frame));
      }
      writer.close();
    }
    TrajectoryReader reader(store_);
    ASSERT_EQ(reader.frame_count(), frames);
    TrajectoryFrame frame;
    for (uint64_t i = 0; i < frames; ++i) {
      reader.read(i, frame);
      const TrajectoryFrame& expected = written[i];
      ASSERT_EQ(frame.state, expected.state);
      const auto same = [&](const auto& a, const auto& b) {
        return std::memcmp(a.data(), b.data(), a.size() * sizeof a[0]) == 0;
      };
      if (bodies == 0) continue;
      for (size_t body = 0; body < bodies; ++body) {
        const Vec3 &found = frame.position[body], &wanted = expected.position[body];
        // Positions of tetrahedra are rounded, those of planes are not.
        if (body % 2 == 0 && wanted.allFinite()) {
          ASSERT_LE((found - wanted).cwiseAbs().maxCoeff(), 1e-7) << round << " frame " << i;
        } else if (body % 2 == 1) {
          ASSERT_EQ(std::memcmp(found.data(), wanted.data(), sizeof wanted), 0) << round;
        }
      }
      ASSERT_TRUE(same(frame.orientation, expected.orientation)) << round << " frame " << i;
    }
  }
}

std::string damaged(std::string bytes, Philox& random) {
  const auto place = [&] { return random.index(static_cast<uint32_t>(bytes.size())); };
  if (bytes.empty()) return "x";
  switch (random.index(5)) {
    case 0:
      bytes[place()] ^= static_cast<char>(1 << random.index(8));
      break;
    case 1:
      bytes.resize(place());
      break;
    case 2: {
      const auto at = place(), count = 1 + random.index(20);
      bytes.insert(at, count, static_cast<char>('0' + random.index(10)));
      break;
    }
    case 3: {
      const auto at = place();
      bytes.erase(at, 1 + random.index(8));
      break;
    }
    default:
      for (int i = 0; i < 8; ++i) bytes[place()] = static_cast<char>(random.bits());
  }
  return bytes;
}

// Whatever happens to a file, the reader gives frames or an Error, and never wrong numbers from a
// damaged chunk.
TEST_F(TrajectoryRandom, DamageIsAnErrorAndNeverACrash) {
  constexpr size_t kBodies = 3;
  write_store(kBodies, 5);
  std::vector<fs::path> files;
  for (const auto& entry : fs::recursive_directory_iterator(store_)) {
    if (entry.is_regular_file()) files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  int refused = 0;
  constexpr uint32_t kRounds = 700;
  for (uint32_t round = 0; round < kRounds; ++round) {
    Philox random(12, Stream::test, round);
    const fs::path file = files[random.index(static_cast<uint32_t>(files.size()))];
    const bool is_chunk = file.filename().string().front() != '.';
    const std::string whole = read_file(file);
    const std::string changed = damaged(whole, random);
    write_file_atomically(file, changed);
    try {
      TrajectoryReader reader(store_);
      TrajectoryFrame frame;
      for (uint64_t i = 0; i < std::min<uint64_t>(reader.frame_count(), 10); ++i) {
        reader.read(i, frame);
        ASSERT_TRUE(!is_chunk || test::equal(frame, test::make_frame(kBodies, i))) << file;
      }
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::input) << error.what();
      ++refused;
    }
    write_file_atomically(file, whole);
  }
  EXPECT_GT(refused, kRounds / 3);
}

// Repeatedly killed after any number of frames and resumed after as many or fewer, it ends with the
// same files.
TEST_F(TrajectoryRandom, ResumedItEndsAsTheSameFiles) {
  const auto files_of = [](const fs::path& store) {
    std::map<std::string, std::string> files;
    for (const auto& entry : fs::recursive_directory_iterator(store)) {
      if (entry.is_regular_file()) {
        files[fs::relative(entry.path(), store).string()] = read_file(entry.path());
      }
    }
    return files;
  };
  for (uint32_t round = 0; round < 6; ++round) {
    Philox random(12, Stream::test, round);
    const size_t bodies = round == 5 ? 20000 : random.index(4);
    const uint64_t frames = 1 + random.index(bodies < 5 ? 600 : 12);
    const fs::path whole = directory_ / "whole.zarr";
    for (const fs::path& store : {whole, store_}) fs::remove_all(store);
    {
      TrajectoryWriter writer(whole, test::make_header(bodies));
      for (uint64_t i = 0; i < frames; ++i) writer.append(test::make_frame(bodies, i));
    }
    { const TrajectoryWriter writer(store_, test::make_header(bodies)); }
    uint64_t done = 0;
    while (done < frames) {
      const uint64_t from = random.index(static_cast<uint32_t>(done + 1));
      TrajectoryWriter writer(store_, from, test::make_header(bodies));
      EXPECT_EQ(TrajectoryReader(store_).frame_count(), from);
      done = from + random.index(static_cast<uint32_t>(frames - from + 1));
      for (uint64_t i = from; i < done; ++i) writer.append(test::make_frame(bodies, i));
    }
    ASSERT_TRUE(files_of(store_) == files_of(whole)) << "round " << round;
  }
}

TEST_F(TrajectoryRandom, IsNotResumedAfterMoreFramesThanItHas) {
  {
    TrajectoryWriter writer(store_, test::make_header(2));
    writer.append(test::make_frame(2, 0));
  }
  EXPECT_THROW(TrajectoryWriter(store_, 2, test::make_header(2)), Error);
  EXPECT_THROW(TrajectoryWriter(store_, 1, test::make_header(200000)), Error) << "of other chunks";
  EXPECT_EQ(TrajectoryReader(store_).frame_count(), 1U);
}

}  // namespace
}  // namespace pilesim

// Response tables from files of collisions: written files read back, and measurements are in the
// tables, wherever the plane is.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "core/atomic_file.h"
#include "signature/measured_collisions.h"
#include "signature/table/table_sampling.h"
#include "support/random_vectors.h"
#include "support/scratch_directory.h"
#include "support/signature_bodies.h"
#include "support/thrown_error.h"

namespace pilesim {
namespace {

constexpr const char* kHeader =
    "normal_x,normal_y,normal_z,vx_before_m_s,vy_before_m_s,vz_before_m_s,wx_before_rad_s,"
    "wy_before_rad_s,wz_before_rad_s,vx_after_m_s,vy_after_m_s,vz_after_m_s,wx_after_rad_s,"
    "wy_after_rad_s,wz_after_rad_s\n";
constexpr const char* kRow = "0,1,0,1,-2,0,1,2,3,0.5,1,0,0,0,1\n";

class CollisionFiles : public testing::Test {
 protected:
  CollisionFile read(const std::string& text) {
    write_file_atomically(directory_ / "drops.csv", text);
    return read_collisions(directory_ / "drops.csv");
  }
  std::string refusal(const std::string& text) {
    return test::error_text([&] { read(text); }, ErrorKind::input);
  }
  std::vector<PlaneCollision> written_and_read(const std::vector<PlaneCollision>& collisions) {
    write_collisions(collisions, directory_ / "again.csv");
    return read_collisions(directory_ / "again.csv").collisions;
  }

  test::ScratchDirectory directory_;
};

// Each collision in its own axes and at its own speed. Those without a tangential velocity stay
// unchanged: they have no tangential axis, and rotated about the normal their spins would lie
// between the nodes.
void turn_and_scale(std::vector<PlaneCollision>& collisions) {
  Philox random(5, Stream::test, 1);
  for (PlaneCollision& c : collisions) {
    const Quat turn = c.velocity_before.x() == 0 ? Quat::Identity() : random.rotation();
    const double faster = random.uniform(0.5, 4);
    c = {.normal = turn * c.normal,
         .velocity_before = faster * (turn * c.velocity_before),
         .spin_before = faster * (turn * c.spin_before),
         .velocity_after = faster * (turn * c.velocity_after),
         .spin_after = faster * (turn * c.spin_after)};
  }
}

// All cells that represent the same collision as `cell`.
std::vector<size_t> same_cells(const ResponseTable& table, size_t cell) {
  const auto key = [&](size_t of) {
    std::array<uint32_t, 4> index = table.cell_index(of);
    if (index[3] == 0) index[1] = 0;
    if (index[3] == 0 || index[1] == 0 || index[1] == 6) index[2] = 0;
    return index;
  };
  std::vector<size_t> same;
  for (size_t other = 0; other < table.cell_count(); ++other) {
    if (key(other) == key(cell)) same.push_back(other);
  }
  return same;
}

TEST_F(CollisionFiles, GiveTheTablesTheyCameFromWithinTheirErrors) {
  const ContactBody body = test::box_body({1, 0.5, 0.25});
  const ContactMaterial material{.restitution = 0.2};
  const ResponseTable empty = make_table(TableLayout::scale_free, body.gyration_m);
  TableSampler sampler({&body, material}, empty, {.trials_per_cell = 24, .exemplars = 8});
  ASSERT_TRUE(sampler.run([](uint64_t, uint64_t) { return true; }));
  const ResponseTable sampled = sampler.table();
  std::vector<PlaneCollision> collisions =
      collisions_of(sampler.state().responses, body.gyration_m, empty);
  turn_and_scale(collisions);
  const ResponseTable measured =
      table_of(written_and_read(collisions), material, body.gyration_m, empty, 8);

  ASSERT_EQ(measured.mean.size(), sampled.mean.size());
  EXPECT_NEAR(measured.most_growth, sampled.most_growth, 1e-3);
  EXPECT_EQ(measured.exemplars.size(), sampled.exemplars.size());
  size_t far = 0, values = 0;
  for (size_t cell = 0; cell < sampled.cell_count(); ++cell) {
    const std::vector<size_t> same = same_cells(sampled, cell);
    if (cell != same.front()) {
      EXPECT_EQ(measured.trials[cell], measured.trials[same.front()]);
      EXPECT_EQ(measured.mean[6 * cell], measured.mean[6 * same.front()]);
      continue;
    }
    EXPECT_GE(measured.trials[cell], kFewestCollisions);
    const auto count = static_cast<double>(same.size());
    for (size_t i = 0; i < 6; ++i, ++values) {
      double mean = 0, variance = 0;
      for (const size_t one : same) {
        mean += sampled.mean[6 * one + i] / count;
        variance += std::pow(sampled.mean_error[6 * one + i] / count, 2);
      }
      const double error = std::hypot(measured.mean_error[6 * cell + i], std::sqrt(variance));
      const double apart = std::abs(measured.mean[6 * cell + i] - mean);
      EXPECT_LE(apart, 5 * error + 2e-3) << cell;
      if (apart > 3 * error + 2e-3) ++far;
      // The same collisions, away from cells that share theirs.
      const auto index = sampled.cell_index(cell);
      if (index[0] > 0 && index[1] > 1 && index[1] < 5 && index[3] > 1) {
        EXPECT_NEAR(measured.mean[6 * cell + i], mean, error + 2e-3) << cell;
      }
    }
  }
  EXPECT_LT(static_cast<double>(far), 0.005 * static_cast<double>(values));
}

// Collisions at `theta`, with any spin, which all leave along the normal at `speed`, in units of
// the measure before.
void add_cluster(const ResponseTable& table, double theta, double speed, int count,
                 std::vector<PlaneCollision>& collisions) {
  Philox random(7, Stream::test, collisions.size());
  for (int i = 0; i < count; ++i) {
    const double phi = random.uniform(0, kPi), psi = random.uniform(-kPi, kPi);
    const double alpha = random.uniform(0, table.axes[3].nodes.back());
    collisions.push_back(
        {.velocity_before = std::cos(alpha) * Vec3(std::sin(theta), -std::cos(theta), 0),
         .spin_before = std::sin(alpha) * spin_direction(theta, phi, psi),
         .velocity_after = Vec3(0, speed, 0)});
  }
}

TEST_F(CollisionFiles, LeaveCellsEmptyWhichTakeTheNearest) {
  const ResponseTable empty = make_table(TableLayout::scale_free, 1);
  const Axis& theta = empty.axes[0];
  std::vector<PlaneCollision> collisions;
  add_cluster(empty, theta.nodes[0], 0.5, 60000, collisions);
  add_cluster(empty, theta.nodes[6], 0.1, 60000, collisions);
  const ResponseTable table = table_of(collisions, {}, 1, empty, 4);
  for (size_t cell = 0; cell < table.cell_count(); ++cell) {
    const auto index = table.cell_index(cell);
    // Few collisions reach the poles of the spin.
    if (index[0] > 0 && index[0] < 6) {
      EXPECT_EQ(table.trials[cell], 0) << cell;
    } else if (index[1] > 0 && index[1] < 6 && index[3] > 0) {
      EXPECT_GE(table.trials[cell], kFewestCollisions) << cell;
    }
    // The middle is equally near to both.
    if (index[0] == 3) continue;
    EXPECT_NEAR(table.mean[6 * cell + 1], index[0] < 3 ? 0.5 : 0.1, 1e-4) << cell;
    EXPECT_NEAR(table.mean[6 * cell], 0, 1e-4);
  }
}

TEST_F(CollisionFiles, SayOfAnEmptyCellThatItsMeanMayBeAsFarOffAsOneResponse) {
  const ResponseTable empty = make_table(TableLayout::scale_free, 1);
  std::vector<PlaneCollision> collisions;
  for (const double speed : {0.2, 0.6}) add_cluster(empty, 0, speed, 60000, collisions);
  const ResponseTable table = table_of(collisions, {}, 1, empty, 4);
  const size_t met = table.cell({0, 3, 4, 5}), not_met = table.cell({4, 3, 4, 5});
  ASSERT_GT(table.trials[met], 20);
  EXPECT_NEAR(table.mean_error[6 * met + 1] * std::sqrt(table.trials[met]), 0.2, 0.05);
  EXPECT_EQ(table.trials[not_met], 0);
  EXPECT_NEAR(table.mean_error[6 * not_met + 1], 0.2, 0.05);
  // Samples there have the spread of that place.
  EXPECT_NE(std::abs(table.exemplars[6 * 4 * not_met + 1]), 0);
}

TEST_F(CollisionFiles, DoNotFillACellThatTheyGraze) {
  const ResponseTable empty = make_table(TableLayout::scale_free, 1);
  std::vector<PlaneCollision> collisions;
  add_cluster(empty, empty.axes[0].nodes[3] + 1e-6, 0.5, 60000, collisions);
  const ResponseTable table = table_of(collisions, {}, 1, empty, 0);
  EXPECT_GT(table.trials[table.cell({3, 3, 4, 5})], 20);
  EXPECT_EQ(table.trials[table.cell({4, 3, 4, 5})], 0);
}

// Without spin phi and psi are undefined: drops from one height are enough for all such cells.
TEST_F(CollisionFiles, WithoutSpinCountForAllCellsWithout) {
  const ResponseTable empty = make_table(TableLayout::scale_free, 1);
  std::vector<PlaneCollision> collisions(
      10, {.velocity_before = Vec3(0, -3, 0), .velocity_after = Vec3(0, 1.5, 0)});
  const ResponseTable table = table_of(collisions, {}, 1, empty, 0);
  for (uint32_t phi = 0; phi < 7; ++phi) {
    for (uint32_t psi = 0; psi < 12; ++psi) {
      EXPECT_FLOAT_EQ(table.trials[table.cell({0, phi, psi, 0})], 10);
    }
  }
  EXPECT_EQ(std::ranges::count(table.trials, 0.0F), 5880 - 84);
}

TEST_F(CollisionFiles, HaveTheDissertationsResponsesLessAParticles) {
  const ResponseTable empty = make_table(TableLayout::dissertation, 1);
  const ContactMaterial material{.restitution = 0.5, .friction = 0};
  std::vector<PlaneCollision> collisions(40, {.velocity_before = Vec3(0, -3, 0),
                                              .velocity_after = Vec3(0, 1.8, 0),
                                              .spin_after = Vec3(0, 2, 0)});
  const ResponseTable table = table_of(collisions, material, 1, empty, 0);
  const size_t cell =
      static_cast<size_t>(std::ranges::max_element(table.trials) - table.trials.begin());
  EXPECT_NEAR(table.mean[6 * cell + 1], 1.8 - 1.5, 1e-5);
  EXPECT_NEAR(table.mean[6 * cell + 4], 2, 1e-5);
}

TEST_F(CollisionFiles, HaveTheirColumnsInAnyOrderAndOthers) {
  const std::string header = std::string("time_s, ") + kHeader;
  const CollisionFile file = read(header + "\r\n7, " + kRow + "\n8," + kRow);
  EXPECT_THAT(file.ignored, testing::ElementsAre("time_s"));
  ASSERT_EQ(file.collisions.size(), 2);
  EXPECT_EQ(file.collisions[1].velocity_before, Vec3(1, -2, 0));
  EXPECT_EQ(file.collisions[1].spin_before, Vec3(1, 2, 3));
  EXPECT_EQ(file.collisions[1].velocity_after, Vec3(0.5, 1, 0));
  EXPECT_EQ(file.collisions[1].spin_after, Vec3(0, 0, 1));
}

TEST_F(CollisionFiles, AreRefusedByLineAndValue) {
  using testing::HasSubstr;
  const std::string header = kHeader;
  std::string cut = header;
  cut.replace(cut.find("vy_after_m_s,"), 13, "");
  EXPECT_THAT(refusal(cut + kRow),
              HasSubstr("drops.csv:1:1: no column vy_after_m_s; expected all"));
  EXPECT_THAT(refusal("normal_x," + header), HasSubstr("drops.csv:1:1: two columns normal_x"));
  EXPECT_THAT(refusal(header + kRow + "\n0,1,0,1\n"),
              HasSubstr("drops.csv:4:1: 4 values; expected 15"));
  for (const char* bad : {"nan", "inf", "1e999", "x", "", "1 2", "0x1", "-1000001"}) {
    std::string row = kRow;
    row.replace(6, 1, bad);
    EXPECT_THAT(refusal(header + kRow + row),
                HasSubstr(std::string("drops.csv:3:7: vx_before_m_s is \"") + bad +
                          "\"; expected a number of at most 1e6 in size"));
  }
  EXPECT_THAT(refusal(header + "0,2" + std::string(kRow).substr(3)),
              HasSubstr("drops.csv:2:1: the normal's length is 2; expected 1"));
  EXPECT_THAT(
      refusal(header + "0,-1" + std::string(kRow).substr(3)),
      HasSubstr("the velocity before is 2 m/s along the normal; expected a number below 0"));
  EXPECT_THAT(refusal(""),
              HasSubstr("drops.csv: is empty; expected a line that names the columns"));
  // Lists all errors, but not endlessly.
  const std::string two = refusal(header + "1\n" + kRow + "2\n");
  EXPECT_THAT(two, testing::AllOf(HasSubstr("drops.csv:2:"), HasSubstr("drops.csv:4:")));
  std::string many = header;
  for (int i = 0; i < 1000; ++i) many += "1\n";
  EXPECT_EQ(std::ranges::count(refusal(many), '\n'), 49);
}

TEST_F(CollisionFiles, OfTooFewCollisionsMakeNoTable) {
  const ResponseTable empty = make_table(TableLayout::scale_free, 1);
  const std::string text = test::error_text(
      [&] { table_of(read(std::string(kHeader) + kRow + kRow).collisions, {}, 1, empty, 0); },
      ErrorKind::input);
  EXPECT_THAT(text, testing::HasSubstr("no cell of the table has 4 collisions of the 2 in all"));
  EXPECT_THROW(table_of({}, {}, 1, empty, 0), Error);
}

}  // namespace
}  // namespace pilesim

// Collision heights and response tables against closed forms and against trials at contact.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <numeric>

#include "signature/accuracy.h"
#include "signature/table/collision_height.h"
#include "signature/table/table_sampling.h"
#include "support/random_vectors.h"
#include "support/signature_bodies.h"

namespace pilesim {
namespace {

bool never_pause(uint64_t, uint64_t) { return true; }

ResponseTable sample(const TrialSetup& setup, TableLayout layout, const TableSampling& sampling) {
  TableSampler sampler(setup, make_table(layout, setup.body->gyration_m), sampling);
  EXPECT_TRUE(sampler.run(never_pause));
  return sampler.table();
}

// Unit square in the plane z = 0: a prism that turns about its own axis only.
TEST(CollisionHeight, OfTheSquareOfFigure32) {
  const ContactBody body = test::box_body({1, 1, 3});
  Philox random(3, Stream::test, 0);
  double last_mean = 0;
  for (const double spin : {0.0, 2.0, 20.0, 200.0}) {
    double low = 1, high = 0, mean = 0;
    const int count = 400;
    for (int i = 0; i < count; ++i) {
      const Quat turn(Eigen::AngleAxisd(random.uniform(0, 2 * kPi), Vec3::UnitZ()));
      const Flight start = test::make_flight(turn * body.principal_axes, {0, -1, 0}, {0, 0, spin},
                                             body.outer_radius_m);
      const test::FlightResult contact = test::fly_one(body, start);
      ASSERT_EQ(contact.end, FlightEnd::contact);
      low = std::min(low, contact.flight.height);
      high = std::max(high, contact.flight.height);
      mean += contact.flight.height / count;
    }
    EXPECT_GE(low, 0.5 - 1e-9);
    EXPECT_LE(high, std::sqrt(0.5) + 1e-9);
    EXPECT_GT(mean, last_mean) << spin;
    last_mean = mean;
    // Mean of (|cos| + |sin|) / 2 over the rotation.
    if (spin == 0) {
      EXPECT_NEAR(mean, 2 / kPi, 0.01);
    }
  }
  EXPECT_NEAR(last_mean, std::sqrt(0.5), 0.01);
}

TEST(CollisionHeight, OfACubeLiesBetweenItsFaceAndItsCorner) {
  const ContactBody body = test::box_body({1, 1, 1});
  for (const TableLayout layout : {TableLayout::scale_free, TableLayout::dissertation}) {
    const auto table = sample_collision_heights({&body, {}}, layout, 256);
    for (size_t cell = 0; cell < table.cell_count(); ++cell) {
      EXPECT_GE(table.mean_m[cell], 0.5);
      EXPECT_LE(table.mean_m[cell], std::sqrt(0.75));
    }
    // Without spin: the mean width of the unit cube is 3/2.
    EXPECT_NEAR(table.mean_m[0], 0.75, 5 * table.error_m[0]);
    EXPECT_LT(table.mean_m[0], table.mean_m[table.cell_count() - 1]);
  }
}

TEST(CollisionHeight, IsReadBetweenNodesAndScaleFree) {
  const ContactBody body = test::box_body({1, 0.5, 0.25});
  const auto table = sample_collision_heights({&body, {}}, TableLayout::scale_free, 64);
  const auto k = static_cast<float>(body.gyration_m);
  const Vec3f normal = Vec3f::UnitY(), v(0.3F, -1, 0.2F), w(1, 2, 3);
  const CollisionHeight slow = collision_height(table, k, normal, v, w);
  const CollisionHeight fast = collision_height(table, k, normal, 8 * v, 8 * w);
  EXPECT_FLOAT_EQ(slow.mean_m, fast.mean_m);
  EXPECT_FLOAT_EQ(slow.deviation_m, fast.deviation_m);
  const CollisionHeight still = collision_height(table, k, normal, v, Vec3f::Zero());
  EXPECT_GE(still.mean_m, *std::min_element(table.mean_m.begin(), table.mean_m.end()));
}

// A flat body precesses quickly: if contacts were measured at other spins than the keys state, most
// of the variance between collisions would remain.
TEST(CollisionHeight, IsExplainedByItsKeysForABodyThatPrecesses) {
  const ContactBody body = test::box_body({1, 0.9, 0.1});
  const TrialSetup setup{&body, {}};
  const auto table = sample_collision_heights(setup, TableLayout::scale_free, 256);
  const AccuracyReport report =
      measure_accuracy(setup, table, {}, {.collisions = 48, .trials = 256, .slices = 1});
  EXPECT_LT(report.height_unexplained, 0.06);
}

// A fine ball responds alike in every orientation: the mean is the closed form, with nearly no
// spread.
TEST(Responses, OfABallAreItsClosedForm) {
  const double r = 0.5, e = 0.5, mu = 0.2;
  const ContactBody body = make_contact_body(sphere_mesh(r, 4), Mat3::Identity() * 0.4 * r * r);
  const TrialSetup setup{&body, {.restitution = e, .friction = mu}};
  const ResponseTable table = sample(setup, TableLayout::scale_free, {.trials_per_cell = 8});
  const double k = body.gyration_m;
  double worst = 0;
  for (size_t cell = 0; cell < table.cell_count(); ++cell) {
    const CellConfiguration at = cell_configuration(table, cell, k);
    const Vec3 arm(0, -r, 0);
    const Vec3 u = at.velocity + at.spin.cross(arm);
    const Vec3 slide(u.x(), 0, u.z());
    const double j = (1 + e) * -at.velocity.y();
    // Sticking removes 2/7 of the sliding speed.
    const double grip = slide.norm() * 2 / 7;
    const Vec3 friction = -slide.normalized() * std::min(mu * j, grip);
    const Vec3 v = at.velocity + friction + Vec3(0, j, 0);
    const Vec3 w = at.spin + arm.cross(friction) / (0.4 * r * r);
    for (Eigen::Index i = 0; i < 3; ++i) {
      const size_t at_i = 6 * cell + static_cast<size_t>(i);
      worst = std::max(
          {worst, std::abs(table.mean[at_i] - v(i)), std::abs(table.mean[at_i + 3] - k * w(i))});
    }
  }
  // Facets of 4 degrees tilt the normal's lever by up to r sin(4 deg).
  EXPECT_LT(worst, 0.1);
}

// The nodes [first, first + count) of every axis.
struct PartOfTable {
  std::array<size_t, 4> first, count;
};
class TrialsAtContact : public testing::TestWithParam<PartOfTable> {};

// Two ways to the same table: a fit of launches with contacts between cells, and trials that start
// at exactly the cell's velocities. Cells are compared where launches come from all sides.
TEST_P(TrialsAtContact, AgreeWithLaunches) {
  Philox random(17, Stream::test, 0);
  const ContactBody body = test::random_body(random, 24);
  const TrialSetup setup{&body, {}};
  const double k = body.gyration_m;
  const ResponseTable whole = make_table(TableLayout::scale_free, k);
  ResponseTable axes = whole;
  for (size_t i = 0; i < 4; ++i) {
    const auto begin = whole.axes[i].nodes.begin() + static_cast<ptrdiff_t>(GetParam().first[i]);
    axes.axes[i].nodes.assign(begin, begin + static_cast<ptrdiff_t>(GetParam().count[i]));
  }
  TableSampler sampler(setup, axes, {.trials_per_cell = 160});
  ASSERT_TRUE(sampler.run(never_pause));
  const ResponseTable table = sampler.table();
  const auto cut = [&](size_t axis, uint32_t node) {
    return (node == 0 && GetParam().first[axis] > 0) ||
           (node + 1 == table.axes[axis].size() &&
            table.axes[axis].nodes.back() != whole.axes[axis].nodes.back());
  };
  double squares = 0;
  int count = 0;
  for (size_t cell = 1; cell < table.cell_count(); cell += 7) {
    const std::array<uint32_t, 4> index = table.cell_index(cell);
    if (cut(1, index[1]) || cut(3, index[3])) continue;
    const CellConfiguration at = cell_configuration(table, cell, k);
    TrialRequest request{.velocity = at.velocity, .spin = at.spin, .object = cell};
    request.count = candidates_for(setup, request, 2000);
    std::vector<TrialResult> results;
    run_trials(setup, std::span(&request, 1), results);
    Eigen::Matrix<double, 6, 1> mean = Eigen::Matrix<double, 6, 1>::Zero();
    int kept = 0;
    for (const TrialResult& result : results) {
      if (!result.kept) continue;
      mean.head<3>() += result.velocity;
      mean.tail<3>() += k * result.spin;
      ++kept;
    }
    mean /= kept;
    for (Eigen::Index i = 0; i < 6; ++i, ++count) {
      squares += std::pow(mean(i) - table.mean[6 * cell + static_cast<size_t>(i)], 2);
    }
  }
  EXPECT_GT(count, 6 * 12);
  // Units of the speed before; the standard errors of both are about 0.02.
  EXPECT_LT(std::sqrt(squares / count), 0.035);
}

INSTANTIATE_TEST_SUITE_P(Responses, TrialsAtContact,
                         testing::Values(PartOfTable{{2, 2, 0, 3}, {3, 4, 12, 4}},
                                         PartOfTable{{5, 0, 0, 0}, {2, 4, 12, 4}}));

// Contacts occur in proportion to their approach speed: if no part of the body moves away from the
// plane, the mean equals the velocity of the centre, whichever part is lowest.
TEST(Responses, ContactsAreAsFrequentAsTheyApproachFast) {
  const ContactBody body = test::box_body({1, 0.3, 0.2});
  for (const SpinMeasure spins : {SpinMeasure::angular_velocity, SpinMeasure::energy}) {
    const TrialSetup setup{.body = &body, .spins = spins};
    TrialRequest request{.velocity = {0.3, -1, 0}, .spin = {0.9, 0.2, -0.7}};
    if (spins == SpinMeasure::energy) request.spin *= 0.5;
    ASSERT_LT(request.spin.norm() *
                  (spins == SpinMeasure::energy ? body.energy_reach_m : body.outer_radius_m),
              1);
    request.count = 40000;
    std::vector<TrialResult> results;
    run_trials(setup, std::span(&request, 1), results);
    const auto kept = std::ranges::count_if(results, &TrialResult::kept);
    EXPECT_NEAR(static_cast<double>(kept) / request.count, contact_acceptance(setup, request),
                0.01);
    for (const TrialResult& result : results) {
      if (!result.kept) continue;
      ASSERT_LT((result.spin_before - request.spin).norm(), 1e-9);
    }
  }
}

// Mirrored in the plane of velocity and normal: velocities keep x and y, spins keep z.
TEST(Responses, OfAMirroredBodyAreMirrored) {
  Philox random(23, Stream::test, 0);
  std::vector<Vec3> points;
  for (int i = 0; i < 12; ++i) points.push_back(random.direction().cwiseProduct(Vec3(1, 0.7, 0.4)));
  const ContactBody body = make_contact_body(convex_hull(points), "body");
  for (Vec3& p : points) p.z() = -p.z();
  const ContactBody mirrored = make_contact_body(convex_hull(points), "mirrored");
  TrialRequest request{.velocity = {0.6, -0.8, 0}, .spin = {0.5, 1, -1.5}};
  request.start = TrialStart::launch;
  request.count = 40000;
  std::vector<TrialResult> a, b;
  run_trials({&body, {}}, std::span(&request, 1), a);
  request.spin = {-0.5, -1, -1.5};
  run_trials({&mirrored, {}}, std::span(&request, 1), b);
  Vec3 v = Vec3::Zero(), w = Vec3::Zero(), v_scale = Vec3::Zero();
  for (size_t i = 0; i < a.size(); ++i) {
    v += a[i].velocity - Vec3(1, 1, -1).cwiseProduct(b[i].velocity);
    w += a[i].spin - Vec3(-1, -1, 1).cwiseProduct(b[i].spin);
    v_scale += a[i].velocity;
  }
  const double n = request.count;
  // Spreads are below 1, so the standard errors of these differences are below 0.007.
  EXPECT_LT((v / n).norm(), 0.02);
  EXPECT_LT((w / n).norm(), 0.05);
  EXPECT_GT(v_scale.norm() / n, 0.2);
}

double rms_error(const ResponseTable& table) {
  double squares = 0;
  for (const float e : table.mean_error) squares += static_cast<double>(e) * e;
  return std::sqrt(squares / static_cast<double>(table.mean_error.size()));
}

TEST(Responses, StandardErrorsFallWithTheRootOfTheTrials) {
  const ContactBody body = test::box_body({1, 0.6, 0.4});
  const TrialSetup setup{&body, {}};
  const double few = rms_error(sample(setup, TableLayout::scale_free, {.trials_per_cell = 20}));
  const double many = rms_error(sample(setup, TableLayout::scale_free, {.trials_per_cell = 80}));
  EXPECT_NEAR(few / many, 2, 0.1);
}

TEST(Responses, SamplingGoesOnUntilTheTargetErrorIsMet) {
  const ContactBody body = test::box_body({1, 0.6, 0.4});
  const ResponseTable table =
      sample({&body, {}}, TableLayout::scale_free, {.trials_per_cell = 6, .target_error = 0.08});
  for (size_t cell = 0; cell < table.cell_count(); ++cell) {
    double squares = 0;
    for (size_t i = 0; i < 6; ++i) squares += std::pow(table.mean_error[6 * cell + i], 2);
    EXPECT_LE(std::sqrt(squares), 0.08 * 1.01) << cell;
  }
}

TEST(Responses, EveryCellOfBothLayoutsIsMeasured) {
  for (const Vec3& size : {Vec3(1, 1, 1), Vec3(1, 0.1, 0.1), Vec3(1, 1, 0.05)}) {
    const ContactBody body = test::box_body(size);
    for (const TableLayout layout : {TableLayout::scale_free, TableLayout::dissertation}) {
      const ResponseTable table =
          sample({&body, {}, TrialKind::micro}, layout, {.trials_per_cell = 8});
      for (const float n : table.trials) EXPECT_GE(n, 1);
    }
  }
}

TEST(Accuracy, AShiftIsItsOwnDistance) {
  Philox random(1, Stream::test, 0);
  std::vector<Vector6> a, b;
  Vector6 shift;
  shift << 1, 0, 0, 0, 0, 0;
  for (int i = 0; i < 300; ++i) {
    Vector6 x;
    for (Eigen::Index k = 0; k < 6; ++k) x(k) = static_cast<float>(random.normal());
    a.push_back(x);
    b.push_back(x + shift);
  }
  // A sixth of the squared shift projects onto a random direction.
  EXPECT_NEAR(sliced_wasserstein(a, b, 4000), 1 / std::sqrt(6.0), 0.01);
  EXPECT_EQ(sliced_wasserstein(a, a, 10), 0);
}

TEST(Draws, KeepTheLimitsAndTheFrame) {
  const ContactBody body = test::box_body({1, 0.6, 0.4});
  const TrialSetup setup{&body, {}};
  const ResponseTable table =
      sample(setup, TableLayout::scale_free, {.trials_per_cell = 10, .exemplars = 8});
  const auto k = static_cast<float>(body.gyration_m);
  // The value that 1 % of this body's true responses exceed.
  const float most = table.most_growth * table.most_growth;
  EXPECT_GE(most, 1);
  EXPECT_LT(most, 1.3F);
  Philox random(9, Stream::test, 0);
  for (const DrawModel model : {DrawModel::diagonal, DrawModel::full, DrawModel::exemplars}) {
    for (int i = 0; i < 3000; ++i) {
      const Vec3f normal = random.direction().cast<float>();
      Vec3f v = random.direction().cast<float>();
      if (v.dot(normal) > 0) v = -v;
      const Vec3f w = test::random_arrow(random, 0, 5).cast<float>();
      const ResponseDraw draw = draw_response(table, model, k, 0.3, 0.5, normal, v, w, random);
      EXPECT_GE(draw.velocity.dot(normal), -1e-6F);
      const float before = v.squaredNorm() + k * k * w.squaredNorm();
      EXPECT_LE(draw.velocity.squaredNorm() + k * k * draw.spin.squaredNorm(),
                most * before * (1 + 1e-5F));
    }
  }
}

}  // namespace
}  // namespace pilesim

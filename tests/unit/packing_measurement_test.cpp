#include "packing/packing_measurement.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/parallel_for.h"
#include "geometry/obj_writer.h"
#include "geometry/primitives.h"
#include "simulate/modes/make_simulator.h"
#include "support/scratch_directory.h"

namespace pilesim {
namespace {

class PackingMeasurement : public testing::Test {
 protected:
  ~PackingMeasurement() override { set_thread_count(available_threads()); }

  // With a signature from few trials.
  void take(const TriangleMesh& mesh) {
    sampling_.mesh = directory_ / "object.obj";
    write_obj(mesh, sampling_.mesh);
    sampling_.material = {.restitution = 0.3, .friction = 0.5};
    sampling_.sampling = {.trials_per_cell = 3, .exemplars = 3};
    sampling_.accuracy.reset();
    sampling_.progress = ProgressMode::none;
    signature_ = sample_signature(sampling_).signature;
  }
  PouredObject object() const { return poured_object(sampling_, signature_); }
  Packing measure(uint32_t pours = 1) const {
    return measure_packing(object(), signature_, {.pours = pours, .progress = ProgressMode::none});
  }

  test::ScratchDirectory directory_;
  SignatureOptions sampling_;
  Signature signature_;
};

TEST_F(PackingMeasurement, StartsAreApartAndKeyedByTheSeed) {
  take(box_mesh({0.4, 0.1, 0.2}));
  const PouredObject poured = object();
  for (const PourKind kind : {PourKind::heap, PourKind::large_heap, PourKind::column}) {
    const PourTrial trial(poured, kind);
    const Model first = trial.starts(1), again = trial.starts(1), other = trial.starts(2);
    std::vector<Vec3> places;
    for (size_t i = 0; i < first.bodies.size(); ++i) {
      if (first.bodies[i].role != Role::dynamic) continue;
      const Pose& pose = first.bodies[i].pose;
      EXPECT_EQ(pose.position, again.bodies[i].pose.position);
      EXPECT_NE(pose.position, other.bodies[i].pose.position);
      EXPECT_GT(pose.position.y(), poured.outer_radius_m);
      for (const Vec3& place : places) {
        ASSERT_GT((pose.position - place).norm(), 2 * poured.outer_radius_m);
      }
      places.push_back(pose.position);
    }
    EXPECT_GT(places.size(), 100U);
    EXPECT_LE(places.size(), kind == PourKind::large_heap ? 512U : 400U);
  }
}

// Half of them are dropped, half are thrown; none reaches another.
TEST_F(PackingMeasurement, BodiesAloneGoTheirWays) {
  take(box_mesh({0.4, 0.1, 0.2}));
  const PourTrial trial(object(), PourKind::alone);
  const Model model = trial.starts(1);
  Scene scene = trial.scene();
  std::vector<Vec3> starts;
  int thrown = 0;
  for (const ModelBody& body : model.bodies) {
    if (body.role != Role::dynamic) continue;
    starts.push_back(body.pose.position);
    thrown += body.linear_velocity.x() > 0 ? 1 : 0;
  }
  EXPECT_EQ(starts.size(), 64U);
  EXPECT_EQ(thrown, 32);
  const PourFigures figures = trial.run(*make_simulator(scene, model));
  const double r = object().outer_radius_m, g = scene.gravity.norm();
  const double speed = 2 * std::sqrt(g * r);
  // At least half of its way to the ground; at most that plus bounces and the motion that friction
  // leaves.
  const double falls = speed * std::sqrt(2 * 4 * r / g) / r;
  EXPECT_GT(figures.thrown, 0.5 * falls);
  EXPECT_LT(figures.thrown, falls + 2 * speed * speed / (2 * 0.5 * g) / r);
  EXPECT_LT(figures.dropped, 0.5 * figures.thrown);
  EXPECT_GT(figures.dropped, 0.1);
}

// A single pour scatters by 0.02, so the mean of four is judged.
TEST_F(PackingMeasurement, PouredBallsPackLoosely) {
  take(sphere_mesh(0.05, 2));
  const PourTrial trial(object(), PourKind::column);
  double sum = 0;
  for (const uint64_t seed : {1, 2, 3, 4}) {
    const Model model = trial.starts(seed);
    sum += trial.run(*make_simulator(trial.scene(), model)).fraction;
  }
  EXPECT_NEAR(sum / 4, 0.52, 0.08);
}

// A ball packs like itself, up to differences between the engines. It rolls, so its heap is flat.
TEST_F(PackingMeasurement, ABallIsItsOwnSphereAtAnyNumberOfThreads) {
  take(sphere_mesh(0.05, 2));
  // From the faceted ball's volume, beyond which its corners reach.
  const double own_m = std::cbrt(3 * object().volume_m3 / (4 * kPi));
  set_thread_count(3);
  const Packing packing = measure();
  EXPECT_NEAR(packing.radius_m, own_m, 0.004);
  EXPECT_LT(packing.rolling, 0.05);
  EXPECT_NEAR(packing.spheres.column_height / packing.measured.column_height, 1, 0.07);
  set_thread_count(1);
  const Packing alone = measure();
  EXPECT_EQ(alone.radius_m, packing.radius_m);
  EXPECT_EQ(alone.rolling, packing.rolling);
  EXPECT_EQ(alone.spheres.time, packing.spheres.time);
}

// Plates lie flat. The mean height of three columns scatters by 0.01, and is 0.1 too low.
TEST_F(PackingMeasurement, SpheresLieAsPlatesDo) {
  take(box_mesh({1, 0.2, 1}));
  const Packing packing = measure(3);
  const PackingFigures &exact = packing.measured, &spheres = packing.spheres;
  EXPECT_NEAR(spheres.heap_height / exact.heap_height, 1, 0.15);
  EXPECT_NEAR(spheres.column_height / exact.column_height, 1, 0.12);
  EXPECT_NEAR(spheres.column_fraction / exact.column_fraction, 1, 0.25);
}

}  // namespace
}  // namespace pilesim

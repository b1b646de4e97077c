// Figures of trajectories with known motion.
#include "report/run_measures.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "core/philox.h"
#include "core/rotation.h"
#include "report/ensemble_error.h"
#include "support/random_vectors.h"
#include "support/trajectory_fixture.h"

namespace pilesim {
namespace {

constexpr double kRate = 50;

// A box about its centre, closed, outward.
TrajectoryShape box(const Vec3f& size) {
  TrajectoryShape shape{.name = "box"};
  for (int i = 0; i < 8; ++i) {
    shape.vertices.push_back(
        size.cwiseProduct(Vec3f(i & 1 ? 0.5f : -0.5f, i & 2 ? 0.5f : -0.5f, i & 4 ? 0.5f : -0.5f)));
  }
  shape.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                     {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  return shape;
}

const double kDiameter = 0.2 * std::sqrt(3.0);
const double kTime = std::sqrt(kDiameter / 9.81);

using Motion = std::function<Pose(size_t body, double time_s)>;

class RunMeasuresTest : public test::TrajectoryTest {
 protected:
  // Cubes of 0.2 m, or of `size`, with the given `motion`.
  std::filesystem::path write(const std::string& name, size_t bodies, int frames,
                              const Motion& motion, const std::string& scene = "{}",
                              const Vec3f& size = Vec3f::Constant(0.2f)) {
    TrajectoryHeader header;
    header.frame_rate = kRate;
    header.resolved_scene = scene;
    header.shapes = {box(size)};
    header.materials = {"wood"};
    for (size_t body = 0; body < bodies; ++body) {
      header.body_name.push_back("cube/" + std::to_string(body));
      header.body_shape.push_back(0);
      header.body_material.push_back(0);
      header.body_colour.push_back({1, 2, 3});
      header.body_moves.push_back(1);
    }
    const auto path = directory_ / name / "trajectory.zarr";
    TrajectoryWriter writer(path, header);
    for (int frame = 0; frame < frames; ++frame) {
      TrajectoryFrame stored;
      for (size_t body = 0; body < bodies; ++body) {
        const Pose pose = motion(body, frame / kRate);
        stored.position.push_back(pose.position);
        stored.orientation.push_back(pose.orientation.cast<float>());
        stored.state.push_back(kPresent);
      }
      writer.append(stored);
    }
    writer.close();
    return path;
  }
  static RunMeasures measure(const std::filesystem::path& path) {
    TrajectoryReader reader(path);
    return measure_run(reader, 4);
  }
  static const MeasuredQuantity& quantity(const RunMeasures& measures, const std::string& name) {
    return *std::ranges::find(measures.quantities, name, &MeasuredQuantity::name);
  }
};

TEST_F(RunMeasuresTest, SpeedSpinAndEnergyOfAFlight) {
  const auto path = write("run", 3, 51, [](size_t body, double t) {
    return Pose{Vec3(2 * t + static_cast<double>(body), 0, 0),
                Quat(Eigen::AngleAxisd(5 * t, Vec3::UnitY()))};
  });
  const RunMeasures measures = measure(path);
  EXPECT_NEAR(measures.diameter_m, kDiameter, 1e-6);
  EXPECT_NEAR(measures.unit_time_s, kTime, 1e-6);
  EXPECT_EQ(measures.bodies_at_end, 3);
  for (const auto& samples : quantity(measures, "speed").samples) {
    EXPECT_THAT(samples, testing::Each(testing::DoubleNear(2 * kTime / kDiameter, 1e-3)));
  }
  for (const auto& samples : quantity(measures, "spin").samples) {
    EXPECT_THAT(samples, testing::Each(testing::DoubleNear(5 * kTime, 1e-3)));
  }
  // 1/2 v^2 + 1/2 (a^2 / 6) w^2 per unit of mass.
  const double energy = 0.5 * 4 + 0.5 * 0.04 / 6 * 25;
  for (const auto& samples : quantity(measures, "energy").samples) {
    EXPECT_NEAR(samples[0], energy * kTime * kTime / (kDiameter * kDiameter), 1e-3);
  }
  // It is never at rest.
  EXPECT_THAT(quantity(measures, "settling_time").samples[0],
              testing::Each(testing::DoubleNear(1 / kTime, 1e-6)));
}

// A brick on its side that turns about the vertical: about its own long axis.
TEST_F(RunMeasuresTest, EnergyOfASpinIsOfTheBodysAxes) {
  const Quat lying = rotation_between(Vec3::UnitX(), Vec3::UnitY());
  const auto path = write(
      "run", 1, 11,
      [&](size_t, double t) {
        // Quaternions of either sign are equal.
        Quat turned = Quat(Eigen::AngleAxisd(7 * t, Vec3::UnitY())) * lying;
        if (std::lround(kRate * t) % 2 == 1) turned.coeffs() *= -1;
        return Pose{Vec3::Zero(), turned};
      },
      R"({"gravity": [0, 0, 0]})", Vec3f(0.4f, 0.1f, 0.2f));
  const RunMeasures measures = measure(path);
  const double moment = (0.01 + 0.04) / 12;  // per unit of mass
  const double unit2 = measures.diameter_m * measures.diameter_m;
  for (const auto& samples : quantity(measures, "energy").samples) {
    EXPECT_NEAR(samples[0] * unit2, 0.5 * moment * 49, 1e-3 * moment * 49);
  }
}

TEST_F(RunMeasuresTest, FreeFallKeepsItsEnergy) {
  const auto path = write("run", 1, 51, [](size_t, double t) {
    return Pose{Vec3(0, 20 - 0.5 * 9.81 * t * t, 0), Quat::Identity()};
  });
  const RunMeasures measures = measure(path);
  const auto& energy = quantity(measures, "energy").samples;
  // The difference of frames is the velocity half a frame earlier: too small by g h per frame.
  EXPECT_NEAR(energy.front()[0], energy.back()[0], 0.01 * energy.front()[0]);
}

TEST_F(RunMeasuresTest, SettlingTimeAndTilt) {
  const auto path = write("run", 3, 101, [](size_t body, double t) {
    // The last one rotates in place.
    if (body == 2) return Pose{{}, Quat(Eigen::AngleAxisd(std::min(t, 1.5), Vec3::UnitY()))};
    const double moving = body == 0 ? std::min(t, 0.5) : std::min(t, 1.0);
    // The second one ends with a tilt of 30 degrees from a face.
    return Pose{Vec3(moving, 0, 0),
                Quat(Eigen::AngleAxisd(body == 0 ? 0 : radians(30), Vec3::UnitZ()))};
  });
  const RunMeasures measures = measure(path);
  EXPECT_THAT(quantity(measures, "settling_time").samples[0],
              testing::ElementsAre(testing::DoubleNear(0.5 / kTime, 1e-6),
                                   testing::DoubleNear(1 / kTime, 1e-6),
                                   testing::DoubleNear(1.5 / kTime, 1e-6)));
  EXPECT_THAT(quantity(measures, "tilt").samples[0],
              testing::ElementsAre(testing::DoubleNear(0, 0.1), testing::DoubleNear(0, 0.1),
                                   testing::DoubleNear(30, 0.1)));
}

TEST_F(RunMeasuresTest, AngleOfAConeOfBodies) {
  for (const double angle_deg : {10.0, 25.0, 40.0}) {
    const double slope = std::tan(radians(angle_deg));
    const auto path = write("cone" + std::to_string(angle_deg), 4000, 2, [&](size_t body, double) {
      for (uint32_t attempt = 0;; ++attempt) {
        Philox random(5, Stream::test, body, attempt);
        const Vec3 place = test::random_in_box(random, {-10, 0, -10}, {10, 10 * slope, 10});
        const double radius = std::hypot(place.x(), place.z());
        if (place.y() > slope * (10 - radius)) continue;
        return Pose{place + Vec3(0, 3, 0), Quat::Identity()};  // on a table
      }
    });
    EXPECT_NEAR(quantity(measure(path), "pile_angle").samples[0][0], angle_deg, 0.04 * angle_deg);
  }
}

TEST_F(RunMeasuresTest, PackingOfALattice) {
  // Cubes of 0.2 at 0.3 m, five layers: from the underside of the lowest to the top of the highest,
  // as balls of their volume, 4 * 0.3 + 2 * 0.124 m. Columns at the border are partly empty.
  const auto path = write("run", 8000, 2, [](size_t body, double) {
    return Pose{0.3 * Vec3(static_cast<double>(body % 40), static_cast<double>(body / 1600),
                           static_cast<double>(body / 40 % 40)),
                Quat::Identity()};
  });
  const double packing = quantity(measure(path), "packing_fraction").samples[0][0];
  const double expected = 5 * 0.008 / (0.09 * (4 * 0.3 + 2 * 0.124));
  EXPECT_NEAR(packing, expected, 0.1 * expected);
}

TEST_F(RunMeasuresTest, LeavesOutWhatDoesNotMoveByForces) {
  const auto path = write(
      "run", 3, 11,
      [](size_t, double t) {
        return Pose{Vec3(t, 0, 0), Quat::Identity()};
      },
      R"({"bodies": [{"role": "kinematic"}, {"role": "dynamic"}], "gravity": [0, 0, 0]})");
  const RunMeasures measures = measure(path);
  EXPECT_EQ(measures.bodies_at_end, 2);
  EXPECT_EQ(measures.unit_time_s, 1);
}

TEST_F(RunMeasuresTest, CountsALostBody) {
  const auto path = write("run", 4, 11, [](size_t, double) { return Pose{}; });
  TrajectoryReader whole(path);
  TrajectoryWriter writer(directory_ / "lost" / "trajectory.zarr", whole.header());
  TrajectoryFrame frame;
  for (uint64_t i = 0; i < whole.frame_count(); ++i) {
    whole.read(i, frame);
    if (i > 5) frame.state[2] = 0;
    writer.append(frame);
  }
  writer.close();
  const RunMeasures measures = measure(directory_ / "lost");
  EXPECT_EQ(measures.bodies_at_end, 3);
  EXPECT_EQ(quantity(measures, "height").samples.back().size(), 3);
  EXPECT_NEAR(measures.mean_bodies, 3.5, 1e-12);
}

TEST_F(RunMeasuresTest, RefusesWhatCannotBeMeasured) {
  const auto still = [](size_t, double) { return Pose{}; };
  const auto one = write("one", 1, 1, still);
  EXPECT_THAT(test::error_text([&] { measure(one); }, ErrorKind::input),
              testing::HasSubstr("has 1 frame; expected at least 2"));
  const auto fixed = write("fixed", 1, 3, still, R"({"bodies": [{"role": "kinematic"}]})");
  EXPECT_THAT(test::error_text([&] { measure(fixed); }, ErrorKind::input),
              testing::HasSubstr("no dynamic body"));
  TrajectoryReader a(write("a", 2, 5, still)), b(write("b", 3, 5, still));
  EXPECT_THAT(test::error_text([&] { motion_error(a, b); }, ErrorKind::input),
              testing::HasSubstr("differ"));
}

TEST_F(RunMeasuresTest, ErrorsOfMotion) {
  const auto along = [](double speed) {
    return [speed](size_t, double t) { return Pose{Vec3(speed * t, 0, 0), Quat::Identity()}; };
  };
  TrajectoryReader a(write("a", 2, 11, along(2))), same(write("same", 2, 11, along(2)));
  EXPECT_EQ(motion_error(a, same).relative, 0);
  TrajectoryReader slower(write("slower", 2, 11, along(1.5)));
  const MotionError error = motion_error(a, slower);
  EXPECT_NEAR(error.relative, 0.25, 1e-5);
  EXPECT_NEAR(error.absolute, 0.5 / kRate / kDiameter, 1e-5);
  EXPECT_EQ(error.absolute_by_frame.size(), 10);
  // Without motion there is no relative error, but there is an absolute one.
  TrajectoryReader still(write("still", 2, 11, along(0)));
  EXPECT_EQ(motion_error(still, a).relative, 0);
  EXPECT_GT(motion_error(still, a).absolute, 0);
}

// Faults that comparisons must reveal, in heaps of random positions.
TEST_F(RunMeasuresTest, InjectedFaultsAreSeen) {
  enum class Fault { none, larger, lower, bouncier };
  const auto heap = [&](const std::string& name, Fault fault) {
    std::vector<RunMeasures> runs;
    for (uint64_t seed = 0; seed < 5; ++seed) {
      const auto path = write(name + std::to_string(seed), 300, 3, [&](size_t body, double t) {
        Philox random(seed + (fault == Fault::none ? 0 : 50), Stream::test, body);
        Vec3 place = test::random_arrow(random, 0.2, 1);
        const double speed = random.uniform(0.5, 1.5);
        if (fault == Fault::larger) place *= 1.1;  // a radius 10 % too large
        if (fault == Fault::lower) place.y() -= 0.1;
        place.x() += t * speed * (fault == Fault::bouncier ? 2 : 1);
        return Pose{place, Quat::Identity()};
      });
      runs.push_back(measure(path));
    }
    return runs;
  };
  const auto reference = heap("reference", Fault::none);
  const auto error = [&](const std::string& name, Fault fault, const std::string& quantity) {
    for (const QuantityError& one : ensemble_errors(reference, heap(name, fault), 1)) {
      if (one.name == quantity) return one.normalised;
    }
    return Interval{};
  };
  EXPECT_GT(error("larger", Fault::larger, "radial_distance").low, 1.2);
  EXPECT_GT(error("lower", Fault::lower, "height").low, 1.5);
  EXPECT_GT(error("bouncier", Fault::bouncier, "speed").low, 5);
}

}  // namespace
}  // namespace pilesim

// Signatures that no scene names: measured once for each geometry and material, and kept.
#include "job/measured_signatures.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "core/error.h"
#include "core/parallel_for.h"
#include "signature/signature_file.h"
#include "simulate/modes/make_simulator.h"
#include "simulate/simulator.h"
#include "support/scratch_directory.h"

namespace pilesim {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

constexpr MeasuringEffort kLittle{.trials_per_cell = 2,
                                  .rest_drops = 2,
                                  .pours = 1,
                                  .rounds = 1,
                                  .pours_a_round = 1,
                                  .pours_of_result = 1};

class MeasuredSignatures : public testing::Test {
 protected:
  MeasuredSignatures() {
    setenv("XDG_CACHE_HOME", directory_.path().c_str(), 1);
    scene_.simulator.mode = SimulatorMode::statistical;
    scene_.materials["wood"] = {.restitution = 0.2, .friction = 0.6};
    scene_.materials["rubber"] = {.restitution = 0.6, .friction = 0.9};
    scene_.shapes["ground"] = PlaneShape{};
    scene_.shapes["brick"] = BoxShape{{0.2, 0.1, 0.3}};
    scene_.bodies.push_back(
        {.name = "ground", .shape = "ground", .material = "wood", .role = Role::fixed});
    add("a", "wood", 1);
  }
  ~MeasuredSignatures() override { set_thread_count(available_threads()); }

  void add(const std::string& name, const std::string& material, double height_m) {
    Body& body =
        scene_.bodies.emplace_back(Body{.name = name, .shape = "brick", .material = material});
    body.pose.position.y() = height_m;
  }

  // The model with its signatures, and the time that they took.
  double measure() {
    model_ = build_model(scene_);
    return measure_signatures(scene_, model_, ProgressMode::none, kLittle);
  }
  std::vector<std::vector<uint8_t>> measured() const {
    std::vector<std::vector<uint8_t>> bytes;
    for (const auto& [object, signature] : model_.signatures) {
      bytes.push_back(encode_signature(*signature));
    }
    return bytes;
  }
  std::vector<fs::path> cached() const {
    std::vector<fs::path> files;
    for (const auto& entry : fs::recursive_directory_iterator(directory_.path())) {
      if (entry.path().filename().string().starts_with("signature-")) files.push_back(entry);
    }
    return files;
  }

  test::ScratchDirectory directory_;
  Scene scene_;
  Model model_;
};

TEST_F(MeasuredSignatures, AreMeasuredOnceAndTheSameAtAnyNumberOfThreads) {
  set_thread_count(1);
  EXPECT_GT(measure(), 0);
  const auto first = measured();
  ASSERT_THAT(first, SizeIs(1));
  ASSERT_THAT(cached(), SizeIs(1));
  // Whatever the scene's seed is.
  scene_.seed = 99;
  EXPECT_EQ(measure(), 0);
  EXPECT_EQ(measured(), first);

  std::fstream file(cached()[0], std::ios::binary | std::ios::in | std::ios::out);
  file.seekp(static_cast<std::streamoff>(fs::file_size(cached()[0]) / 2));
  file.write("damaged", 7);
  file.close();
  set_thread_count(3);
  EXPECT_GT(measure(), 0);
  EXPECT_EQ(measured(), first);
  EXPECT_EQ(measure(), 0);
}

TEST_F(MeasuredSignatures, AreOfTheMaterialOfEachBody) {
  add("b", "rubber", 2);
  measure();
  const auto bytes = measured();
  ASSERT_THAT(bytes, SizeIs(2));
  EXPECT_NE(bytes[0], bytes[1]);
  const auto simulator = make_simulator(scene_, model_);
  EXPECT_THAT(simulator->signatures(),
              ElementsAre(HasSubstr("brick: measured for restitution 0.6 and friction 0.9"),
                          HasSubstr("brick: measured for restitution 0.2 and friction 0.6")));
  simulator->step_frame();
}

TEST_F(MeasuredSignatures, AreLeftOutWhereNothingIsToBeMeasured) {
  model_ = build_model(scene_);
  find_signatures(scene_, model_);
  EXPECT_THAT(cached(), IsEmpty());
  EXPECT_THAT(make_simulator(scene_, model_)->signatures(),
              ElementsAre(AllOf(HasSubstr("brick: "), HasSubstr("to be measured"))));
}

TEST_F(MeasuredSignatures, AreNotMeasuredForAModeThatRefusesTheScene) {
  scene_.bodies.back().hinge = Hinge{};
  EXPECT_THROW(measure(), Error);
  EXPECT_THAT(cached(), IsEmpty());
}

TEST_F(MeasuredSignatures, AreForModesThatCollideByThem) {
  add("b", "rubber", 2);
  add("c", "rubber", 3);
  scene_.bodies.back().preference = Preference::must_impulse;
  model_ = build_model(scene_);
  const auto count_in = [&](SimulatorMode mode) {
    scene_.simulator.mode = mode;
    return objects_to_measure(scene_, model_).size();
  };
  EXPECT_EQ(count_in(SimulatorMode::impulse), 0);
  EXPECT_EQ(count_in(SimulatorMode::particle), 0);
  EXPECT_EQ(count_in(SimulatorMode::statistical), 2);
  EXPECT_EQ(count_in(SimulatorMode::mixed), 2);
  model_.bodies[1].preference = Preference::must_impulse;
  EXPECT_EQ(count_in(SimulatorMode::mixed), 1);
  EXPECT_EQ(count_in(SimulatorMode::statistical), 2);
}

}  // namespace
}  // namespace pilesim

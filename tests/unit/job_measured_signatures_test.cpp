// Signatures that no scene names: measured once for each geometry and material, and cached.
#include "job/measured_signatures.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <future>
#include <map>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "core/error.h"
#include "core/parallel_for.h"
#include "geometry/cache_file.h"
#include "geometry/convex_hull.h"
#include "geometry/obj_writer.h"
#include "geometry/primitives.h"
#include "signature/signature_file.h"
#include "simulate/modes/make_simulator.h"
#include "simulate/simulator.h"
#include "support/coarse_signature.h"
#include "support/scratch_directory.h"

namespace pilesim {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

class MeasuredSignatures : public testing::Test {
 protected:
  MeasuredSignatures() {
    setenv("XDG_CACHE_HOME", directory_.path().c_str(), 1);
    scene_.simulator.mode = SimulatorMode::statistical;
    scene_.materials["wood"] = {.restitution = 0.2, .friction = 0.6};
    scene_.materials["oak"] = scene_.materials["wood"];
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
  // Bodies of two sizes, `from` and `to` times the brick's.
  void add_in_sizes(double from, double to) {
    Emitter emitter{.name = "sized", .shapes = {"brick"}, .material = "wood"};
    emitter.sizes = Sizes{.from = from, .to = to, .steps = 2};
    emitter.source = GridSource{.centre = {0, 10, 0}, .count = {3, 3, 3}, .spacing = {3, 3, 3}};
    scene_.emitters.push_back(emitter);
  }

  // Returns the number of measurements, which take few trials and no pours.
  int measure() {
    model_ = build_model(scene_);
    int count = 0;
    measure_signatures(scene_, model_, {.measure = [&](const MeasuredObject& object, ProgressMode) {
                         ++count;
                         return coarse(object);
                       }});
    return count;
  }
  static Signature coarse(const MeasuredObject& object) {
    return test::coarse_signature({.name = object.shape.name,
                                   .hull = convex_hull(object.solid.vertices),
                                   .mass = object.shape.mass},
                                  object.material);
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
  EXPECT_EQ(measure(), 1);
  const auto first = measured();
  ASSERT_THAT(first, SizeIs(1));
  ASSERT_THAT(cached(), SizeIs(1));
  // Independent of the scene's seed.
  scene_.seed = 99;
  EXPECT_EQ(measure(), 0);
  EXPECT_EQ(measured(), first);

  std::fstream file(cached()[0], std::ios::binary | std::ios::in | std::ios::out);
  file.seekp(static_cast<std::streamoff>(fs::file_size(cached()[0]) / 2));
  file.write("damaged", 7);
  file.close();
  set_thread_count(3);
  EXPECT_EQ(measure(), 1);
  EXPECT_EQ(measured(), first);
  EXPECT_EQ(measure(), 0);
}

TEST_F(MeasuredSignatures, AreOfTheMaterialOfEachBody) {
  add("b", "rubber", 2);
  add("c", "oak", 3);  // equal to wood
  EXPECT_EQ(measure(), 2);
  const auto bytes = measured();
  ASSERT_THAT(bytes, SizeIs(3));
  EXPECT_EQ(bytes[0], bytes[2]);
  EXPECT_NE(bytes[0], bytes[1]);
  const auto simulator = make_simulator(scene_, model_);
  EXPECT_THAT(simulator->signatures(),
              ElementsAre(HasSubstr("brick: measured for restitution 0.2 and friction 0.6"),
                          HasSubstr("brick: measured for restitution 0.6 and friction 0.9"),
                          HasSubstr("brick: measured for restitution 0.2 and friction 0.6")));
  simulator->step_frame();
}

TEST_F(MeasuredSignatures, OfAnotherSizeAreScaled) {
  add_in_sizes(2, 4);
  EXPECT_EQ(measure(), 1);
  ASSERT_THAT(model_.signatures, SizeIs(3));
  std::map<double, std::shared_ptr<const Signature>> by_size;
  for (const auto& [object, signature] : model_.signatures) {
    by_size[model_.shapes[object.first].size] = signature;
  }
  const Signature &own = *by_size.at(1), &twice = *by_size.at(2);

  // The object that is measured.
  scene_.shapes["brick"] = BoxShape{{0.4, 0.2, 0.6}};
  scene_.emitters.clear();
  EXPECT_EQ(measure(), 1);
  const Signature& large = *model_.signatures.begin()->second;
  constexpr double kLike = 1e-6;
  EXPECT_NEAR(twice.body.volume_m3, large.body.volume_m3, kLike);
  EXPECT_TRUE(twice.body.inertia_m2.isApprox(large.body.inertia_m2, kLike));
  EXPECT_NEAR(twice.body.gyration_m, large.body.gyration_m, kLike);
  EXPECT_NEAR(twice.body.outer_radius_m, large.body.outer_radius_m, kLike);
  EXPECT_NEAR(twice.packing->radius_m, large.packing->radius_m, kLike);
  EXPECT_NEAR(twice.rest_poses.at(0).height_m, large.rest_poses.at(0).height_m, kLike);
  EXPECT_FLOAT_EQ(twice.heights.mean_m.at(0), 2 * own.heights.mean_m.at(0));
  EXPECT_FLOAT_EQ(twice.heights.deviation_m.at(0), 2 * own.heights.deviation_m.at(0));
  EXPECT_EQ(twice.responses.mean, own.responses.mean);
}

// The first one measures until the second one says that it waits.
TEST_F(MeasuredSignatures, AreMeasuredByOneOfTwoRunsAtOnce) {
  std::promise<void> begun, waits;
  std::jthread first([&] {
    Model model = build_model(scene_);
    measure_signatures(scene_, model, {.measure = [&](const MeasuredObject& object, ProgressMode) {
                         begun.set_value();
                         waits.get_future().wait();
                         return coarse(object);
                       }});
  });
  begun.get_future().wait();
  model_ = build_model(scene_);
  int count = 0;
  std::vector<std::string> said;
  const double took_s = measure_signatures(scene_, model_,
                                           {.say =
                                                [&](const std::string& line) {
                                                  said.push_back(line);
                                                  waits.set_value();
                                                },
                                            .measure =
                                                [&](const MeasuredObject& object, ProgressMode) {
                                                  // Else the first one would wait for ever.
                                                  if (said.empty()) waits.set_value();
                                                  ++count;
                                                  return coarse(object);
                                                }});
  first.join();
  EXPECT_EQ(count, 0);
  EXPECT_EQ(took_s, 0);
  EXPECT_THAT(said, ElementsAre(HasSubstr("measures the signature of brick")));
  EXPECT_NE(model_.signatures.begin()->second, nullptr);
  EXPECT_EQ(measure(), 0);
  // Nothing but the signature is left.
  EXPECT_THAT(cached(), SizeIs(1));
}

// A process that is killed leaves a lock file behind, which holds nobody up.
TEST_F(MeasuredSignatures, AreNotLockedByARunThatWasKilled) {
  const CacheFile file(directory_.path(), "signature", "0");
  std::array<int, 2> pipe_ends{};
  ASSERT_EQ(pipe(pipe_ends.data()), 0);
  const pid_t other = fork();
  if (other == 0) {
    const CacheLock lock(file, [] {});
    if (write(pipe_ends[1], "", 1) == 1) pause();
    _exit(1);
  }
  char byte = 0;
  ASSERT_EQ(read(pipe_ends[0], &byte, 1), 1);
  int waits = 0;
  const auto before_waiting = [&] {
    ++waits;
    kill(other, SIGKILL);
    waitpid(other, nullptr, 0);
  };
  { const CacheLock lock(file, before_waiting); }
  EXPECT_EQ(waits, 1);
  { const CacheLock lock(file, before_waiting); }
  EXPECT_EQ(waits, 1);
  EXPECT_THAT(cached(), IsEmpty());
  for (const int end : pipe_ends) close(end);
}

// The solid of a mesh is measured and identifies it in the cache, wherever its file is.
TEST_F(MeasuredSignatures, OfMeshesFollowFromTheMesh) {
  write_obj(box_mesh({0.2, 0.1, 0.3}), directory_ / "brick.obj");
  write_obj(box_mesh({0.2, 0.1, 0.3}), directory_ / "same.obj");
  write_obj(box_mesh({0.2, 0.1, 0.4}), directory_ / "longer.obj");
  scene_.shapes["brick"] = MeshShape{.file = directory_ / "brick.obj"};
  EXPECT_EQ(measure(), 1);
  make_simulator(scene_, model_)->step_frame();
  scene_.shapes["brick"] = MeshShape{.file = directory_ / "same.obj"};
  EXPECT_EQ(measure(), 0);
  // Independent of the scene's collision shape.
  MeshShape coarse{.file = directory_ / "same.obj"};
  coarse.collision = CollisionKind::decomposition;
  coarse.decomposition_max_pieces = 2;
  scene_.shapes["brick"] = coarse;
  EXPECT_EQ(measure(), 0);
  scene_.shapes["brick"] = MeshShape{.file = directory_ / "longer.obj"};
  EXPECT_EQ(measure(), 1);
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

TEST_F(MeasuredSignatures, NameTheShapeThatCannotBeMeasured) {
  model_ = build_model(scene_);
  const auto fault_of = [&](ErrorKind kind) {
    try {
      measure_signatures(scene_, model_,
                         {.measure = [&](const MeasuredObject&, ProgressMode) -> Signature {
                           throw Error(kind, {.found = "it is flat"});
                         }});
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), kind);
      return error.problems().at(0);
    }
    return Problem{};
  };
  EXPECT_EQ(fault_of(ErrorKind::input).pointer, "/shapes/brick");
  EXPECT_EQ(fault_of(ErrorKind::input).found, "it is flat");
  EXPECT_THAT(fault_of(ErrorKind::interrupted).remedy, HasSubstr("measures it again"));
  EXPECT_THAT(cached(), IsEmpty());
}

TEST_F(MeasuredSignatures, AreMeasuredWithoutACache) {
  model_ = build_model(scene_);
  EXPECT_EQ(describe_unkept_signatures(scene_, model_), "");
  std::ofstream(directory_ / "file") << "no directory";
  setenv("XDG_CACHE_HOME", (directory_ / "file").c_str(), 1);
  EXPECT_THAT(describe_unkept_signatures(scene_, model_), HasSubstr("XDG_CACHE_HOME"));
  EXPECT_EQ(measure(), 1);
  EXPECT_EQ(measure(), 1);
  scene_.simulator.mode = SimulatorMode::impulse;
  EXPECT_EQ(describe_unkept_signatures(scene_, model_), "");
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

// N frames of a preset, saved and loaded into another simulator, followed by N more, equal the 2 N
// frames of an uninterrupted run on one thread bit by bit, on three. This covers every scene in
// presets/, shrunk by one rule (support/small_preset.h); exceptions to the rule are listed below.
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <tuple>
#include <vector>

#include "core/parallel_for.h"
#include "core/state_stream.h"
#include "geometry/convex_hull.h"
#include "job/direction.h"
#include "model/mesh_hints.h"
#include "scene/scene_loader.h"
#include "simulate/modes/make_simulator.h"
#include "support/coarse_signature.h"
#include "support/scratch_directory.h"
#include "support/small_preset.h"
#include "support/small_runs.h"

namespace pilesim {
namespace {

namespace fs = std::filesystem;

const fs::path kPresets = fs::path(PILESIM_SOURCE_DIR) / "presets";

// Relative to presets/, without the extension.
std::vector<std::string> preset_names() {
  std::vector<std::string> names;
  for (const auto& entry : fs::recursive_directory_iterator(kPresets)) {
    const bool is_plan = entry.path().stem().extension() == ".plan";  // a plan for a batch
    if (entry.path().extension() == ".json" && !is_plan) {
      names.push_back(fs::relative(entry.path(), kPresets).replace_extension().generic_string());
    }
  }
  std::ranges::sort(names);
  return names;
}

// For presets for which the rule gives a run without events.
const test::PresetSize kAsleepSoon = {.simulated_s = 0.25};
const test::PresetSize kFromFarUp = {.simulated_s = 1.5};
const test::PresetSize kOfWraps = {.as_hulls = true};
const std::map<std::string, test::PresetSize> kSizes = {
    {"artist/things_on_a_table", kOfWraps},  {"equilibrium/wedged_crates", kAsleepSoon},
    {"hard/contact_on_edge", kAsleepSoon},   {"hard/heavy_on_light", kAsleepSoon},
    {"hard/iron_on_gravel", kFromFarUp},     {"hard/plates", kAsleepSoon},
    {"hard/pyramid", kAsleepSoon},           {"hard/rings", kAsleepSoon},
    {"hard/spikes_and_wedges", kAsleepSoon}, {"statistical/rabbits_100000", kFromFarUp},
    {"finish/rabbits_100000", kFromFarUp},
};

// Shared by the tests of one process.
struct Scratch {
  Scratch() { setenv("XDG_CACHE_HOME", directory.path().c_str(), 1); }

  // Measures each geometry and material once.
  std::shared_ptr<const Signature> signature(const ModelShape& shape, const Material& material) {
    std::shared_ptr<const Signature>& known =
        signatures[{shape.mesh_hash, material.restitution, material.friction}];
    if (known) return known;
    const SampledObject object{
        .name = shape.name, .hull = convex_hull(shape.mesh.vertices), .mass = shape.mass};
    known = std::make_shared<const Signature>(test::coarse_signature(
        object, {.restitution = material.restitution, .friction = material.friction}));
    return known;
  }

  test::ScratchDirectory directory;
  std::map<std::tuple<std::string, double, double>, std::shared_ptr<const Signature>> signatures;
};

class PresetResume : public testing::TestWithParam<std::string> {
 protected:
  static void SetUpTestSuite() { scratch_ = std::make_unique<Scratch>(); }
  static void TearDownTestSuite() { scratch_.reset(); }
  ~PresetResume() override { set_thread_count(available_threads()); }

  fs::path file() const { return kPresets / (GetParam() + ".json"); }

  test::SmallPreset small() const {
    const auto size = kSizes.find(GetParam());
    return test::PresetShrinker(file(), size == kSizes.end() ? test::PresetSize{} : size->second)
        .result();
  }

  static std::unique_ptr<Scratch> scratch_;
};
std::unique_ptr<Scratch> PresetResume::scratch_;

// A preset's run at its beginning, as `simulate` or `direct-pile` create it.
struct PresetRun {
  PresetRun(const Scene& scene, const Model& model, const GuideFilling& filling, bool is_directed)
      : direction(is_directed ? direction_of("preset", scene, model, filling)
                              : no_direction(scene, model)),
        simulator(direction->make_simulator()) {}

  std::unique_ptr<Direction> direction;
  std::unique_ptr<Simulator> simulator;
};

// By more than gravity in a frame: a body that bounces within a frame touches nothing at its end.
bool anything_pushed(const std::vector<Vec3>& before, const std::vector<Vec3>& after,
                     const Vec3& by_gravity) {
  for (size_t i = 0; i < after.size(); ++i) {
    if ((after[i] - before[i] - by_gravity).norm() > 1e-6 * (1 + before[i].norm()) &&
        !after[i].isZero(0)) {
      return true;
    }
  }
  return false;
}

TEST_P(PresetResume, EndsWithTheSameBytes) {
  const test::SmallPreset preset = small();
  const Scene scene = load_scene(file(), preset.overrides).scene;
  Model model = build_model(scene);
  const GuideFilling filling = fill_guide(scene, model);
  for (const ObjectKey& object : objects_to_measure(scene, model)) {
    model.signatures[object] =
        scratch_->signature(model.shapes[object.first], model.materials[object.second]);
  }

  set_thread_count(1);
  const PresetRun whole(scene, model, filling, preset.is_directed);
  std::vector<std::string> hashes = {test::hash_of(whole.simulator->states())};
  std::vector<std::vector<double>> figures = {test::figures_of(whole.simulator->statistics())};
  std::vector<std::byte> half;
  bool has_met = false;
  for (size_t frame = 1; frame <= 2 * preset.half; ++frame) {
    const std::vector<Vec3> before = whole.simulator->states().linear_velocity;
    const FrameStatistics statistics = whole.simulator->step_frame();
    hashes.push_back(test::hash_of(whole.simulator->states()));
    figures.push_back(test::figures_of(statistics));
    if (frame <= preset.half) {
      has_met = has_met || statistics.contacts > 0 ||
                anything_pushed(before, whole.simulator->states().linear_velocity,
                                scene.gravity / scene.frame_rate);
    }
    if (frame == preset.half) half = test::saved(*whole.simulator);
  }
  // A run without contacts could not lose any: such a preset needs its own size.
  EXPECT_TRUE(has_met) << "nothing has met by the frame from which the run is resumed";
  EXPECT_NE(hashes[preset.half], hashes.back()) << "nothing moves after that frame";

  set_thread_count(3);
  const PresetRun resumed(scene, model, filling, preset.is_directed);
  StateReader reader(half);
  resumed.simulator->load(reader);
  ASSERT_EQ(test::hash_of(resumed.simulator->states()), hashes[preset.half]);
  for (size_t frame = preset.half + 1; frame < hashes.size(); ++frame) {
    const FrameStatistics statistics = resumed.simulator->step_frame();
    ASSERT_EQ(test::hash_of(resumed.simulator->states()), hashes[frame]) << "frame " << frame;
    ASSERT_EQ(test::figures_of(statistics), figures[frame]) << "frame " << frame;
  }
  // A director's state includes the time that it took.
  if (!preset.is_directed) {
    EXPECT_TRUE(test::saved(*resumed.simulator) == test::saved(*whole.simulator));
  }
}

// Warnings of validate about the unit or the up axis of a mesh.
TEST_P(PresetResume, ItsMeshesAreNotDoubted) {
  Scene scene = load_scene(file(), small().overrides).scene;
  scene.duration_s =
      test::PresetJson::parse(std::ifstream(file()), nullptr, true, true).value("duration_s", 5.0);
  for (const std::string& hint : describe_unlikely_meshes(scene, build_model(scene))) {
    ADD_FAILURE() << hint;
  }
}

INSTANTIATE_TEST_SUITE_P(Of, PresetResume, testing::ValuesIn(preset_names()), [](const auto& test) {
  std::string name = test.param;
  std::ranges::replace(name, '/', '_');
  return name;
});

}  // namespace
}  // namespace pilesim

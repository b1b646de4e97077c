// Every mode and every director gives the bytes that it gave before, at 1, 2 and 4 threads.
// pinned_hashes.txt has them, and says how they are pinned anew.
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/hash.h"
#include "core/parallel_for.h"
#include "job/rest_drops.h"
#include "pile/guide/guided_simulator.h"
#include "pile/guide/upside_down.h"
#include "pile/repose/repose_director.h"
#include "scene/scene_loader.h"
#include "signature/signature_file.h"
#include "signature/signature_fitting.h"
#include "signature/signature_sampling.h"
#include "simulate/modes/make_simulator.h"
#include "support/pinned_hashes.h"

namespace pilesim {
namespace {

const std::filesystem::path kFolder = PILESIM_SOURCE_DIR "/tests/determinism";

enum class Directed { no, piles, whole_piles, guide };
enum class Measured { no, table, splines };

struct PinnedRun {
  std::string name, scene;
  std::vector<std::string> overrides = {};
  Directed directed = Directed::no;
  Measured signature = Measured::no;  // of the shape l_shape
};
void PrintTo(const PinnedRun& run, std::ostream* stream) { *stream << run.name; }

std::vector<PinnedRun> pinned_runs() {
  const std::string mode = "/simulator/mode=", levels = "/simulator/level_of_detail/";
  const std::vector<std::string> by_distance = {levels + "distances_m=[5,7]"};
  return {
      {"impulse_hulls", "hulls"},
      {"impulse_pieces", "pieces"},
      {"impulse_round_shapes", "round_shapes"},
      {"impulse_boxes", "boxes"},
      {"impulse_without_sleep", "boxes", {"/simulator/sleeping=false"}},
      {"statistical_table", "spheres", {}, Directed::no, Measured::table},
      {"statistical_splines", "spheres", {}, Directed::no, Measured::splines},
      {"particle", "spheres", {mode + "particle"}},
      {"mixed_level_1", "mixed", {levels + "level=1"}, Directed::no, Measured::table},
      {"mixed_level_2", "mixed", {levels + "level=2"}, Directed::no, Measured::table},
      {"mixed_level_3", "mixed", {levels + "level=3"}, Directed::no, Measured::splines},
      {"mixed_by_distance", "mixed", by_distance, Directed::no, Measured::table},
      {"mixed_by_budget",
       "mixed",
       {"/simulator/budget_ms_per_step=0.3"},
       Directed::no,
       Measured::table},
      {"mixed_by_error", "mixed", {"/simulator/max_error=2"}, Directed::no, Measured::table},
      {"repose_impulse", "piles", {}, Directed::piles},
      {"repose_mixed", "piles", {mode + "mixed"}, Directed::piles},
      {"repose_whole_piles", "piles", {}, Directed::whole_piles},
      {"guide_freeze", "guide", {}, Directed::guide},
      {"guide_nail", "guide", {"/guide/hold=nail"}, Directed::guide},
      {"guide_without_mesh", "guide", {"/guide={}", "/emitters=[]"}, Directed::guide},
  };
}

class Pinned : public testing::Test {
 protected:
  Pinned() {
    std::string pattern = (std::filesystem::temp_directory_path() / "pinned.XXXXXX").string();
    EXPECT_NE(mkdtemp(pattern.data()), nullptr);
    directory_ = pattern;
    // No decompositions that an earlier run, perhaps of other code, left.
    setenv("XDG_CACHE_HOME", directory_.c_str(), 1);
  }
  ~Pinned() override {
    set_thread_count(available_threads());
    std::filesystem::remove_all(directory_);
  }

  // Calls `expect` with the name and the hash of each part of a result, for every number of
  // threads.
  template <class Result>
  void expect_pinned(const Result& result) {
    for (const int threads : {1, 2, 4}) {
      SCOPED_TRACE(std::to_string(threads) + " threads");
      set_thread_count(threads);
      result([&](const std::string& name, const std::string& hash) { hashes_.expect(name, hash); });
    }
  }

  static SignatureOptions coarse(const std::string& mesh) {
    SignatureOptions options{.mesh = PILESIM_SOURCE_DIR "/assets/" + mesh};
    options.material = {.restitution = 0.3, .friction = 0.5};
    options.sampling = {.trials_per_cell = 3, .exemplars = 2};
    options.accuracy.reset();
    options.progress = ProgressMode::none;
    return options;
  }

  std::string signature_file(Measured measured) {
    Signature signature = sample_signature(coarse("l_shape.obj")).signature;
    if (measured == Measured::splines) signature = fitted_signature(signature, FitSettings{});
    const std::filesystem::path file = directory_ / "l_shape.sig";
    write_signature(signature, file);
    return file.string();
  }

  std::filesystem::path directory_;
  test::PinnedHashes hashes_{kFolder / "pinned_hashes.txt"};
};

std::string hash_of(const BodyStates& states) {
  Hasher hasher;
  hasher.add_values(std::span(states.position));
  hasher.add_values(std::span(states.orientation));
  hasher.add_values(std::span(states.linear_velocity));
  hasher.add_values(std::span(states.angular_velocity));
  hasher.add_values(std::span(states.flags));
  return hasher.digest();
}

class PinnedRuns : public Pinned, public testing::WithParamInterface<PinnedRun> {};

TEST_P(PinnedRuns, GiveTheseBytes) {
  const PinnedRun& run = GetParam();
  std::vector<std::string> overrides = run.overrides;
  if (run.signature != Measured::no) {
    overrides.push_back("/shapes/l_shape/signature=" + signature_file(run.signature));
  }
  const std::filesystem::path file = kFolder / "scenes" / (run.scene + ".json");
  expect_pinned([&](const auto& expect) {
    const Scene scene = load_scene(file, overrides).scene;
    Model model = build_model(scene);
    fill_guide(scene, model);
    std::optional<ReposeDirector> director;
    std::unique_ptr<Simulator> simulator;
    if (run.directed == Directed::guide) {
      simulator = std::make_unique<GuidedSimulator>(scene, model);
    } else if (run.directed != Directed::no) {
      const Waking waking = run.directed == Directed::piles ? Waking::local : Waking::whole_pile;
      director.emplace(scene, model, waking);
      simulator = make_directed_simulator(scene, model, *director);
    } else {
      simulator = make_simulator(scene, model);
    }
    for (int frame = 1; frame <= 45; ++frame) {
      simulator->step_frame();
      if (frame % 15 == 0) {
        expect(run.name + "/frame_" + std::to_string(frame), hash_of(simulator->states()));
      }
    }
  });
}

INSTANTIATE_TEST_SUITE_P(Of, PinnedRuns, testing::ValuesIn(pinned_runs()),
                         [](const auto& run) { return run.param.name; });

std::string hash_of(const Signature& signature) {
  const std::vector<uint8_t> bytes = encode_signature(signature);
  return content_hash(std::as_bytes(std::span(bytes)));
}

TEST_F(Pinned, Signatures) {
  expect_pinned([&](const auto& expect) {
    SignatureOptions options = coarse("l_shape.obj");
    options.accuracy = AccuracySettings{.collisions = 4, .trials = 16};
    options.drop_to_rest = [](const TriangleMesh& mesh) {
      return drop_to_rest(mesh, {.drops = 6, .progress = ProgressMode::none}).rests;
    };
    const Signature table = sample_signature(options).signature;
    expect("signature/scale_free_macro", hash_of(table));
    for (const ResponseCoordinates coordinates :
         {ResponseCoordinates::cartesian, ResponseCoordinates::spherical}) {
      const FitSettings fit{.coordinates = coordinates,
                            .parametrisation = Parametrisation::centripetal};
      expect("signature/fit_" + coordinates_name(coordinates),
             hash_of(fitted_signature(table, fit)));
    }
    options = coarse("biped_50.obj");
    options.kind = TrialKind::micro;
    options.sampling.target_error = 0.5;
    expect("signature/scale_free_micro", hash_of(sample_signature(options).signature));
    options.layout = TableLayout::dissertation;
    options.sampling.exemplars = 0;
    expect("signature/dissertation_micro", hash_of(sample_signature(options).signature));
  });
}

TEST_F(Pinned, SignatureOfABoundedSize) {
  const std::filesystem::path table = signature_file(Measured::table);
  expect_pinned([&](const auto& expect) {
    expect("signature/within_5000_bytes",
           hash_of(fit_signature({.signature = table, .max_bytes = 5000}).fitted));
  });
}

TEST_F(Pinned, HashesAreAllOfARunThatThereIs) {
  std::vector<std::string> names = {"signature"};
  for (const PinnedRun& run : pinned_runs()) names.push_back(run.name);
  for (const auto& [name, hash] : hashes_.hashes()) {
    EXPECT_NE(std::ranges::find(names, name.substr(0, name.find('/'))), names.end()) << name;
  }
}

}  // namespace
}  // namespace pilesim

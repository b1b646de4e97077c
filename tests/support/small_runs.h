// Runs of all modes and directors, small enough to be repeated often.
#pragma once

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <memory>
#include <optional>
#include <ostream>
#include <string>
#include <vector>

#include "core/hash.h"
#include "core/parallel_for.h"
#include "core/state_stream.h"
#include "geometry/mesh_import.h"
#include "pile/guide/guided_simulator.h"
#include "pile/guide/upside_down.h"
#include "pile/repose/repose_director.h"
#include "scene/scene_loader.h"
#include "signature/signature_file.h"
#include "signature/signature_fitting.h"
#include "signature/signature_sampling.h"
#include "simulate/modes/make_simulator.h"
#include "support/coarse_signature.h"
#include "support/plain_packing.h"
#include "support/scratch_directory.h"

namespace pilesim::test {

enum class Directed { no, piles, guide };
enum class Measured { no, table, splines };

struct SmallRun {
  std::string name, scene;
  std::vector<std::string> overrides = {};
  Directed directed = Directed::no;
  Measured signature = Measured::no;  // of the shape l_shape
};
inline void PrintTo(const SmallRun& run, std::ostream* stream) { *stream << run.name; }

inline std::vector<SmallRun> small_runs() {
  const std::string mode = "/simulator/mode=", levels = "/simulator/level_of_detail/";
  const std::vector<std::string> by_distance = {levels + "distances_m=[6]"};
  return {
      {"impulse_hulls", "hulls"},
      {"impulse_pieces", "pieces"},
      {"impulse_round_shapes", "round_shapes"},
      {"impulse_boxes", "boxes"},
      {"impulse_without_sleep", "boxes", {"/simulator/sleeping=false"}},
      {"bullet_pieces", "pieces", {"/simulator/engine=bullet"}},
      {"statistical_table", "spheres", {}, Directed::no, Measured::table},
      {"statistical_splines", "spheres", {}, Directed::no, Measured::splines},
      {"dissertation",
       "spheres",
       {"/simulator/method=dissertation"},
       Directed::no,
       Measured::table},
      {"particle", "spheres", {mode + "particle"}},
      {"particle_sleepers", "sleepers"},
      {"mixed_level_1", "mixed", {levels + "level=1"}, Directed::no, Measured::table},
      {"mixed_level_2", "mixed", {levels + "level=2"}, Directed::no, Measured::splines},
      {"mixed_dissertation",
       "mixed",
       {"/simulator/method=dissertation", levels + "level=2"},
       Directed::no,
       Measured::table},
      {"mixed_by_distance", "mixed", by_distance, Directed::no, Measured::table},
      {"repose_impulse", "piles", {}, Directed::piles},
      {"repose_dissertation",
       "piles",
       {"/piles/0/method=dissertation", "/piles/1/method=dissertation", "/piles/0/tau=0.1"},
       Directed::piles},
      {"repose_mixed", "piles", {mode + "mixed"}, Directed::piles},
      {"guide_freeze", "guide", {}, Directed::guide},
      {"guide_dissertation",
       "guide",
       {"/guide/hold=nail", "/guide/neighbours=true"},
       Directed::guide},
      {"guide_without_mesh",
       "guide",
       {R"(/guide={"hold":"freeze"})", "/emitters=[]"},
       Directed::guide},
  };
}

inline constexpr int kFramesOfRun = 45;

inline SignatureOptions coarse(const std::string& mesh) {
  SignatureOptions options = coarse_options({.restitution = 0.3, .friction = 0.5}, 3, 2);
  options.mesh = PILESIM_SOURCE_DIR "/assets/" + mesh;
  return options;
}

inline std::string hash_of(const BodyStates& states) {
  Hasher hasher;
  hasher.add_values(std::span(states.position));
  hasher.add_values(std::span(states.orientation));
  hasher.add_values(std::span(states.linear_velocity));
  hasher.add_values(std::span(states.angular_velocity));
  hasher.add_values(std::span(states.flags));
  return hasher.digest();
}

inline std::vector<std::byte> saved(const Simulator& simulator) {
  StateWriter writer;
  simulator.save(writer);
  return {writer.bytes().begin(), writer.bytes().end()};
}

// Figures of reports, without times.
inline std::vector<double> figures_of(const FrameStatistics& s) {
  return {static_cast<double>(s.steps),
          static_cast<double>(s.bodies_present),
          static_cast<double>(s.bodies_awake),
          static_cast<double>(s.contacts),
          s.deepest_penetration_m,
          s.kinetic_energy_j,
          s.potential_energy_j};
}

// Input of a run.
struct RunScene {
  RunScene(const SmallRun& run, const std::vector<std::string>& overrides)
      : scene(load_scene(PILESIM_SOURCE_DIR "/tests/determinism/scenes/" + run.scene + ".json",
                         overrides)
                  .scene),
        model(build_model(scene)) {
    fill_guide(scene, model);
  }
  RunScene(const RunScene&) = delete;
  RunScene& operator=(const RunScene&) = delete;

  Scene scene;
  Model model;
};

// A run at its beginning. `of` must outlive it.
struct RunningRun {
  RunningRun(const SmallRun& run, const RunScene& of) {
    const auto& [scene, model] = of;
    if (run.directed == Directed::guide) {
      simulator = std::make_unique<GuidedSimulator>(scene, model);
    } else if (run.directed != Directed::no) {
      director.emplace(scene, model);
      simulator = make_directed_simulator(scene, model, *director);
    } else {
      simulator = make_simulator(scene, model);
    }
  }
  RunningRun(const RunningRun&) = delete;
  RunningRun& operator=(const RunningRun&) = delete;

  std::optional<ReposeDirector> director;
  std::unique_ptr<Simulator> simulator;
};

// With their own cache directory, so that no decompositions of earlier code are used.
class SmallRuns : public testing::Test {
 protected:
  SmallRuns() { setenv("XDG_CACHE_HOME", directory_.path().c_str(), 1); }
  ~SmallRuns() override { set_thread_count(available_threads()); }

  std::string signature_file(Measured measured) {
    const SignatureOptions options = coarse("l_shape.obj");
    Signature signature = sample_signature(options).signature;
    signature.packing = plain_packing(signature, import_mesh(options.mesh));
    if (measured == Measured::splines) signature = fitted_signature(signature, FitSettings{});
    const std::filesystem::path file = directory_ / "l_shape.sig";
    write_signature(signature, file);
    return file.string();
  }
  // The run's overrides, and the signature that it needs.
  std::vector<std::string> overrides_of(const SmallRun& run) {
    std::vector<std::string> overrides = run.overrides;
    if (run.signature != Measured::no) {
      overrides.push_back("/shapes/l_shape/signature=" + signature_file(run.signature));
    }
    return overrides;
  }

  ScratchDirectory directory_;
};

}  // namespace pilesim::test

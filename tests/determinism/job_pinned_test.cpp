// Every mode and every director gives the pinned bytes at 1, 2 and 4 threads. pinned_hashes.txt
// contains them, and says how to pin them again.
#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <vector>

#include "core/hash.h"
#include "core/parallel_for.h"
#include "job/rest_drops.h"
#include "signature/signature_file.h"
#include "signature/signature_fitting.h"
#include "support/pinned_hashes.h"
#include "support/small_runs.h"

namespace pilesim {
namespace {

const std::filesystem::path kFolder = PILESIM_SOURCE_DIR "/tests/determinism";

using test::SmallRun;

class Pinned : public test::SmallRuns {
 protected:
  // Calls `expect` with the name and hash of each part of a result, for every number of threads.
  template <class Result>
  void expect_pinned(const Result& result) {
    for (const int threads : {1, 2, 4}) {
      SCOPED_TRACE(std::to_string(threads) + " threads");
      set_thread_count(threads);
      result([&](const std::string& name, const std::string& hash) { hashes_.expect(name, hash); });
    }
  }

  test::PinnedHashes hashes_{kFolder / "pinned_hashes.txt"};
};

class PinnedRuns : public Pinned, public testing::WithParamInterface<SmallRun> {};

TEST_P(PinnedRuns, GiveTheseBytes) {
  const SmallRun& run = GetParam();
  const std::vector<std::string> overrides = overrides_of(run);
  expect_pinned([&](const auto& expect) {
    const test::RunScene scene(run, overrides);
    const test::RunningRun running(run, scene);
    for (int frame = 1; frame <= test::kFramesOfRun; ++frame) {
      running.simulator->step_frame();
      if (frame % 15 == 0) {
        expect(run.name + "/frame_" + std::to_string(frame),
               test::hash_of(running.simulator->states()));
      }
    }
  });
}

INSTANTIATE_TEST_SUITE_P(Of, PinnedRuns, testing::ValuesIn(test::small_runs()),
                         [](const auto& run) { return run.param.name; });

std::string hash_of(const Signature& signature) {
  const std::vector<uint8_t> bytes = encode_signature(signature);
  return content_hash(std::as_bytes(std::span(bytes)));
}

TEST_F(Pinned, Signatures) {
  expect_pinned([&](const auto& expect) {
    SignatureOptions options = test::coarse("l_shape.obj");
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
    options = test::coarse("biped_50.obj");
    options.kind = TrialKind::micro;
    options.sampling.target_error = 0.5;
    expect("signature/scale_free_micro", hash_of(sample_signature(options).signature));
    options.layout = TableLayout::dissertation;
    options.sampling.exemplars = 0;
    expect("signature/dissertation_micro", hash_of(sample_signature(options).signature));
  });
}

TEST_F(Pinned, SignatureOfABoundedSize) {
  const std::filesystem::path table = signature_file(test::Measured::table);
  expect_pinned([&](const auto& expect) {
    expect("signature/within_5000_bytes",
           hash_of(fit_signature({.signature = table, .max_bytes = 5000}).fitted));
  });
}

TEST_F(Pinned, HashesAreAllOfARunThatThereIs) {
  std::vector<std::string> names = {"signature"};
  for (const SmallRun& run : test::small_runs()) names.push_back(run.name);
  for (const auto& [name, hash] : hashes_.hashes()) {
    EXPECT_NE(std::ranges::find(names, name.substr(0, name.find('/'))), names.end()) << name;
  }
}

}  // namespace
}  // namespace pilesim

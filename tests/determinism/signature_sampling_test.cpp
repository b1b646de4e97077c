// The same signature, byte for byte, for any number of threads and after interruptions.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "core/atomic_file.h"
#include "core/parallel_for.h"
#include "signature/signature_file.h"
#include "signature/signature_sampling.h"
#include "signature/table/table_sampling.h"
#include "support/scratch_directory.h"
#include "support/signature_bodies.h"

namespace pilesim {
namespace {

class Signatures : public testing::Test {
 protected:
  ~Signatures() override { set_thread_count(available_threads()); }
  test::ScratchDirectory dir_;
};

TEST_F(Signatures, DoNotDependOnThreads) {
  SignatureOptions options{.mesh = PILESIM_SOURCE_DIR "/assets/l_shape.obj"};
  options.sampling = {.trials_per_cell = 6, .exemplars = 4};
  options.accuracy = AccuracySettings{.collisions = 4, .trials = 32};
  options.progress = ProgressMode::none;
  std::vector<std::string> files;
  for (const int threads : {1, 3}) {
    set_thread_count(threads);
    const auto file = dir_ / (std::to_string(threads) + ".sig");
    write_signature(sample_signature(options).signature, file);
    files.push_back(read_file(file));
  }
  EXPECT_GT(files[0].size(), 100000U);
  EXPECT_EQ(files[0], files[1]);
}

TEST_F(Signatures, DoNotDependOnInterruptions) {
  const ContactBody body = test::box_body({1, 0.6, 0.4});
  const TrialSetup setup{&body, {}, TrialKind::micro};
  const ResponseTable axes = make_table(TableLayout::scale_free, body.gyration_m);
  // Tight enough for several rounds.
  const TableSampling sampling{.trials_per_cell = 10, .target_error = 0.12, .exemplars = 2};
  TableSampler whole(setup, axes, sampling);
  ASSERT_TRUE(whole.run([](uint64_t, uint64_t) { return true; }));

  SamplingState state = TableSampler(setup, axes, sampling).state();
  int interruptions = 0;
  for (bool done = false; !done; ++interruptions) {
    TableSampler part(setup, axes, sampling);
    part.restore(state);
    int pauses = 0;
    done = part.run([&](uint64_t, uint64_t) { return ++pauses % 2 != 0; });
    write_partial_sampling({"print", part.state()}, dir_ / "partial");
    state = read_partial_sampling(dir_ / "partial").state;
    if (done) {
      EXPECT_EQ(part.table().mean, whole.table().mean);
      EXPECT_EQ(part.table().spread, whole.table().spread);
      EXPECT_EQ(part.table().exemplars, whole.table().exemplars);
    }
  }
  EXPECT_GE(interruptions, 3);
}

}  // namespace
}  // namespace pilesim

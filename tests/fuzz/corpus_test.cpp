// Runs every file of the corpus through its reader, as libFuzzer would: among them are files that
// once crashed a reader, exhausted memory or hung.
#include <gmock/gmock.h>
#include <sys/resource.h>

#include <filesystem>
#include <vector>

#include "core/atomic_file.h"
#include "targets.h"

namespace pilesim {
namespace {

namespace fs = std::filesystem;

const fs::path kCorpus = PILESIM_SOURCE_DIR "/tests/fuzz/corpus";

class Corpus : public testing::TestWithParam<fuzz::Target> {};

// With little memory, since the files have at most a few kilobytes.
TEST_P(Corpus, EveryFileGivesAResultOrAnError) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(kCorpus / GetParam().name)) {
    files.push_back(entry.path());
  }
  std::ranges::sort(files);
  EXPECT_GT(files.size(), 1u);
  for (const fs::path& file : files) {
    SCOPED_TRACE(file.string());
    EXPECT_NO_THROW(GetParam().run(read_file(file)));
  }
  GetParam().run("");
  rusage usage{}, of_children{};
  getrusage(RUSAGE_SELF, &usage);
  getrusage(RUSAGE_CHILDREN, &of_children);
  constexpr long kMostKilobytes = 1 << 20;  // includes that of sanitizers
  EXPECT_LT(usage.ru_maxrss, kMostKilobytes);
  EXPECT_LT(of_children.ru_maxrss, kMostKilobytes);
}

std::string name_of(const testing::TestParamInfo<fuzz::Target>& one) { return one.param.name; }

INSTANTIATE_TEST_SUITE_P(OfFormats, Corpus,
                         testing::ValuesIn(fuzz::format_targets().begin(),
                                           fuzz::format_targets().end()),
                         name_of);
INSTANTIATE_TEST_SUITE_P(OfTheProgram, Corpus,
                         testing::ValuesIn(fuzz::program_targets().begin(),
                                           fuzz::program_targets().end()),
                         name_of);

}  // namespace
}  // namespace pilesim

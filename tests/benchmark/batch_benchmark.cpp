// What a batch itself costs: jobs whose steps do nothing but leave a file, through the code that
// runs real ones.
//
//   batch_benchmark [JOBS] [DIRECTORY]
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <string>

#include "batch/batch.h"

namespace {

namespace fs = std::filesystem;
using namespace pilesim;

double seconds_of(const char* what, uint64_t jobs, const std::function<void()>& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  const double s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  std::printf("| %s | %.2f s | %.1f us a job |\n", what, s, 1e6 * s / static_cast<double>(jobs));
  std::fflush(stdout);
  return s;
}

}  // namespace

int main(int argc, char** argv) {
  const uint64_t jobs = argc > 1 ? std::stoull(argv[1]) : 100'000;
  const fs::path directory = argc > 2 ? argv[2] : "batch_benchmark_out";
  fs::remove_all(directory);
  fs::create_directories(directory);
  std::ofstream(directory / "scene.json") << R"({"version": 1})";
  std::ofstream(directory / "plan.json")
      << R"({"version": 1, "scene": "scene.json", "count": )" << jobs
      << R"(, "vary": [{"set": "/duration_s", "uniform": [1, 2]}], "steps": [["simulate"]]})";
  const RunStep step = [](const StepCommand& command) {
    fs::create_directories(command.directory / "run");
    std::ofstream(command.directory / "run" / "out") << command.words.back();
    return StepResult{};
  };
  BatchRequest request{.plan_file = directory / "plan.json",
                       .output = directory / "out",
                       .progress = ProgressMode::none};
  std::printf("| %llu jobs | all | each |\n|---|---|---|\n", static_cast<unsigned long long>(jobs));
  seconds_of("run", jobs, [&] { run_batch(request, step); });
  seconds_of("run again: nothing to do", jobs, [&] { run_batch(request, step); });
  seconds_of("collect, a file a job", jobs, [&] { collect_batch(request); });
  for (uint64_t i = 0; i < 40; ++i) {
    BatchRequest shard = request;
    shard.shard = Shard{.index = i, .count = 40};
    run_batch(shard, step);
  }
  seconds_of("collect, a file a shard of 40", jobs, [&] { collect_batch(request); });
  fs::remove_all(directory);
}

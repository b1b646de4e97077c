#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <mutex>

#include "batch/batch.h"
#include "batch/pool.h"
#include "core/atomic_file.h"
#include "core/error.h"
#include "support/scratch_directory.h"

namespace pilesim {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

// Simulates the death of the process.
struct Killed {};

std::string word_after(const StepCommand& command, const std::string& option) {
  const auto found = std::ranges::find(command.words, option);
  return found == command.words.end() ? "" : *std::next(found);
}

// Writes its arguments except the thread count into a file; ends with `exit_status`.
StepResult leave_a_file(const StepCommand& command, int exit_status = 0) {
  fs::create_directories(command.directory / "run");
  std::ofstream(command.directory / "run" / (command.words[0] + ".out"))
      << word_after(command, "--seed") << ' ' << word_after(command, "--set");
  std::ofstream(command.directory / "run" / "timing.csv") << rand();  // never the same, like times
  return {.exit_status = exit_status,
          .output = "said",
          .last_words = "complained",
          .wall_s = 0.5,
          .processor_s = 0.25,
          .peak_memory_bytes = 1000};
}

class BatchRunTest : public testing::Test {
 protected:
  BatchRunTest() {
    std::ofstream(scratch_ / "scene.json") << R"({"version": 1})";
    write_plan(R"("count": 20, "tries": 3)");
  }

  void write_plan(const std::string& more) const {
    std::ofstream(scratch_ / "plan.json")
        << R"({"version": 1, "scene": "scene.json", "vary": [{"set": "/duration_s", "uniform": [1, 2]}],
              "steps": [["simulate"], ["render"]], )"
        << more << "}";
  }
  BatchRequest request(const std::string& output) const {
    return {.plan_file = scratch_ / "plan.json",
            .output = scratch_ / output,
            .progress = ProgressMode::none};
  }
  BatchSummary run(
      const std::string& output, const RunStep& step = [](const StepCommand& command) {
        return leave_a_file(command);
      }) const {
    return run_batch(request(output), step);
  }
  std::string index(const std::string& output) const {
    return read_file(scratch_ / output / "index.jsonl");
  }

  test::ScratchDirectory scratch_;
};

TEST_F(BatchRunTest, DoesEachJobOnce) {
  std::mutex mutex;
  std::map<std::string, int> steps;
  const RunStep count = [&](const StepCommand& command) {
    const std::lock_guard lock(mutex);
    ++steps[command.words[0]];
    return leave_a_file(command);
  };
  const BatchSummary first = run("a", count);
  EXPECT_EQ(first.done, 20u);
  EXPECT_EQ(steps["simulate"], 20);
  EXPECT_EQ(steps["render"], 20);
  const BatchSummary again = run("a", count);
  EXPECT_EQ(again.of_before, 20u);
  EXPECT_EQ(steps["simulate"], 20);
  const JobRecord record = read_job_record(scratch_ / "a/jobs/0000/0000003/job.json");
  EXPECT_EQ(record.index, 3u);
  EXPECT_DOUBLE_EQ(record.wall_s(), 1);
  EXPECT_DOUBLE_EQ(record.processor_s(), 0.5);
  EXPECT_EQ(record.peak_memory_bytes(), 1000u);
}

TEST_F(BatchRunTest, TriesWhatFailsAGateWithOtherSeeds) {
  // Every second seed fails: with three tries one job in eight fails.
  std::mutex mutex;
  uint64_t tries = 0;
  const auto is_bad = [](const StepCommand& command) {
    return std::stoull(word_after(command, "--seed")) % 2 == 1;
  };
  const RunStep step = [&](const StepCommand& command) {
    if (command.words[0] != "simulate") return leave_a_file(command);
    const std::lock_guard lock(mutex);
    ++tries;
    return leave_a_file(command, is_bad(command) ? 5 : 0);
  };
  const BatchSummary summary = run("a", step);
  EXPECT_EQ(summary.done + summary.gate, 20u);
  EXPECT_GT(summary.gate, 0u);
  EXPECT_GT(summary.tried_again, summary.gate);
  uint64_t recorded = 0;
  for (uint64_t i = 0; i < 20; ++i) {
    const BatchPlan plan = load_batch_plan(scratch_ / "plan.json");
    const JobRecord record = *find_job(scratch_ / "a", batch_job(plan, i));
    recorded += record.attempts.size();
    for (size_t k = 0; k < record.attempts.size(); ++k) {
      EXPECT_EQ(record.attempts[k].seed, scene_seed(plan, batch_job(plan, i), static_cast<int>(k)));
      EXPECT_EQ(record.attempts[k].end == AttemptEnd::done, record.attempts[k].seed % 2 == 0);
    }
    if (!record.is_done()) {
      EXPECT_EQ(record.attempts.size(), 3u);
      EXPECT_THAT(record.attempts[0].what, HasSubstr("complained"));
      EXPECT_FALSE(fs::exists(job_directory(scratch_ / "a", batch_job(plan, i)) / "run"));
    }
  }
  EXPECT_EQ(recorded, tries);
  // First without changes, then with a forced repetition.
  const uint64_t before = tries;
  run("a", step);
  EXPECT_EQ(tries, before);
  BatchRequest retry = request("a");
  retry.retry = true;
  EXPECT_EQ(run_batch(retry, step).gate, summary.gate);
  EXPECT_EQ(tries, before + 3 * summary.gate);
}

TEST_F(BatchRunTest, DoesNotTryAgainWhatIsWrongInItself) {
  const BatchSummary summary =
      run("a", [](const StepCommand& command) { return leave_a_file(command, 3); });
  EXPECT_EQ(summary.failed, 20u);
  EXPECT_EQ(summary.tried_again, 0u);
}

TEST_F(BatchRunTest, AJobThatDiedIsDoneAgainWithoutATrace) {
  run("whole");
  std::mutex mutex;
  std::map<std::string, int> tries;
  const RunStep once = [&](const StepCommand& command) {
    const std::lock_guard lock(mutex);
    return leave_a_file(command, ++tries[command.directory] == 1 ? 128 + 9 : 0);
  };
  EXPECT_EQ(run("a", once).done, 20u);
  EXPECT_EQ(index("a"), index("whole"));
  // After all tries are used up, the next run tries again.
  EXPECT_EQ(run("b", [](const StepCommand& command) { return leave_a_file(command, 6); }).died,
            20u);
  EXPECT_EQ(run("b").done, 20u);
  EXPECT_EQ(index("b"), index("whole"));
}

TEST_F(BatchRunTest, EndsWithTheSameBytesHoweverOftenItIsKilled) {
  run("whole");
  std::mutex mutex;
  int steps = 0, kills = 0;
  const RunStep dying = [&](const StepCommand& command) {
    StepResult result = leave_a_file(command);
    const std::lock_guard lock(mutex);
    // After its work but before the record, and once after half the work.
    if (++steps % 3 == 0) {
      ++kills;
      if (steps % 2 == 0) fs::remove_all(command.directory / "run" / "timing.csv");
      throw Killed();
    }
    return result;
  };
  for (bool is_done = false; !is_done;) {
    try {
      EXPECT_EQ(run("killed", dying).done, 20u);
      is_done = true;
    } catch (const Killed&) {
    }
  }
  EXPECT_GT(kills, 10);
  EXPECT_EQ(index("killed"), index("whole"));
}

// Killed when only the renaming of the directory was left.
TEST_F(BatchRunTest, EndedJobsAreNotTriedAgain) {
  run("a");
  const std::string whole = index("a");
  const fs::path jobs = scratch_ / "a/jobs/0000";
  for (const char* job : {"0000003", "0000004", "0000005"}) {
    fs::rename(jobs / job, jobs / ("." + std::string(job) + ".part"));
  }
  int steps = 0;
  run("a", [&](const StepCommand& command) {
    ++steps;
    return leave_a_file(command);
  });
  EXPECT_EQ(steps, 0);
  EXPECT_EQ(index("a"), whole);
}

TEST_F(BatchRunTest, AJobThatDiedInOneShardMayBeDoneInAnother) {
  run("whole");
  const auto run_shard = [&](uint64_t i, uint64_t count, int exit_status) {
    BatchRequest shard = request("shards");
    shard.shard = Shard{.index = i, .count = count};
    run_batch(shard,
              [&](const StepCommand& command) { return leave_a_file(command, exit_status); });
  };
  run_shard(0, 3, 0);
  run_shard(1, 3, 128 + 9);
  run_shard(2, 3, 0);
  EXPECT_GT(collect_batch(request("shards")).died, 0u);
  run_shard(0, 1, 0);
  EXPECT_EQ(collect_batch(request("shards")).done, 20u);
  EXPECT_EQ(index("shards"), index("whole"));
}

TEST_F(BatchRunTest, ShardsAreTheSameJobs) {
  run("whole");
  for (uint64_t i = 0; i < 3; ++i) {
    BatchRequest shard = request("shards");
    shard.shard = Shard{.index = i, .count = 3};
    run_batch(shard, [](const StepCommand& command) { return leave_a_file(command); });
  }
  EXPECT_EQ(collect_batch(request("shards")).done, 20u);
  EXPECT_EQ(index("shards"), index("whole"));
  // Also without the shards' records.
  fs::remove_all(scratch_ / "shards" / "shards");
  EXPECT_EQ(collect_batch(request("shards")).done, 20u);
  EXPECT_EQ(index("shards"), index("whole"));
}

TEST_F(BatchRunTest, LeavesAloneWhatAnotherProcessWorksOn) {
  // A second batch over the same directory during each step of the first.
  const RunStep step = [&](const StepCommand& command) { return leave_a_file(command); };
  bool is_inner = false;
  const RunStep outer = [&](const StepCommand& command) {
    if (!is_inner) {
      is_inner = true;
      BatchRequest other = request("a");
      other.processes = 1;
      const BatchSummary summary = run_batch(other, step);
      EXPECT_GE(summary.elsewhere, 1u);
      EXPECT_EQ(summary.done + summary.elsewhere, 20u);
    }
    return leave_a_file(command);
  };
  BatchRequest one = request("a");
  one.processes = 1;
  EXPECT_EQ(run_batch(one, outer).done, 20u);
}

TEST_F(BatchRunTest, RefusesToMixPlans) {
  run("a");
  write_plan(R"("count": 20, "seed": 2)");
  try {
    run("a");
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::usage);
    EXPECT_THAT(error.what(), HasSubstr("/seed: was nothing, is 2"));
    EXPECT_THAT(error.what(), HasSubstr("20 jobs"));
    EXPECT_THAT(error.what(), HasSubstr("--force"));
  }
  BatchRequest forced = request("a");
  forced.force = true;
  run_batch(forced, [](const StepCommand& command) { return leave_a_file(command); });
  run("b");
  EXPECT_EQ(index("a"), index("b"));
}

TEST_F(BatchRunTest, StopsWhereAFileCannotBeWritten) {
  int steps = 0;
  BatchRequest one = request("a");
  one.processes = 1;
  const RunStep full = [&](const StepCommand& command) {
    return leave_a_file(command, ++steps > 4 ? 4 : 0);
  };
  EXPECT_THROW(run_batch(one, full), Error);
  EXPECT_EQ(steps, 5);
  EXPECT_EQ(run("a").done, 20u);
  run("b");
  EXPECT_EQ(index("a"), index("b"));
}

TEST_F(BatchRunTest, ForecastsFromASample) {
  write_plan(R"("count": 1000)");
  const RunStep step = [](const StepCommand& command) { return leave_a_file(command); };
  const BatchForecast forecast = forecast_batch(request("a"), 3, step);
  EXPECT_EQ(forecast.jobs, 1000u);
  EXPECT_EQ(forecast.sample, 3u);
  EXPECT_NEAR(forecast.processor_s, 500, 1e-9);
  EXPECT_FALSE(fs::exists(scratch_ / "a"));
  EXPECT_FALSE(fs::exists(scratch_ / "a.sample"));
}

TEST_F(BatchRunTest, DropsWhatIsNotKept) {
  write_plan(R"("count": 1, "drop": ["run/render.out"])");
  run("a");
  EXPECT_FALSE(fs::exists(scratch_ / "a/jobs/0000/0000000/run/render.out"));
  EXPECT_TRUE(fs::exists(scratch_ / "a/jobs/0000/0000000/run/simulate.out"));
}

TEST(Pool, RunsNoMoreAtOnceThanMemoryAllows) {
  std::vector<uint64_t> jobs(40);
  std::mutex mutex;
  int running = 0, most_later = 0, started = 0;
  run_pool(
      jobs, {.cores = 8, .memory_bytes = 350},
      [&](uint64_t, int threads) -> uint64_t {
        {
          const std::lock_guard lock(mutex);
          ++running;
          // The first eight start before the limit is known; later ones respect it.
          if (++started > 16) most_later = std::max(most_later, running);
          EXPECT_GE(threads, 1);
        }
        std::this_thread::sleep_for(std::chrono::milliseconds(2));
        const std::lock_guard lock(mutex);
        --running;
        return 100;
      },
      [] { return false; });
  EXPECT_EQ(started, 40);
  EXPECT_LE(most_later, 3);
}

}  // namespace
}  // namespace pilesim

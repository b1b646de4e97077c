#include "batch/batch.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <map>
#include <mutex>

#include "batch/pool.h"
#include "core/atomic_file.h"
#include "core/counted.h"
#include "core/error.h"
#include "core/interrupt.h"
#include "core/output_directory.h"
#include "core/parallel_for.h"
#include "core/printable.h"
#include "core/temporary_file.h"

namespace pilesim {
namespace {

namespace fs = std::filesystem;

constexpr char kPlanFile[] = "plan.json";
constexpr int kVersion = 1;
constexpr size_t kMostChanges = 20;
// Of the memory that is free when a batch begins, what its jobs may take.
constexpr double kMemoryShare = 0.9;

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

// What is there of a batch, beside its plan.
struct Stock {
  std::vector<uint64_t> to_do, changed;
  std::vector<JobRecord> records;  // of all others: tried to the end
};

std::pair<uint64_t, uint64_t> bounds_of(const BatchRequest& request, uint64_t jobs) {
  if (!request.shard) return {0, jobs};
  const auto [index, count] = *request.shard;
  return {jobs * index / count, jobs * (index + 1) / count};
}

Stock take_stock(const BatchRequest& request, const BatchPlan& plan, const JobKeys& keys) {
  Stock stock;
  const auto [begin, end] = bounds_of(request, plan.jobs());
  for (uint64_t index = begin; index < end; ++index) {
    const BatchJob job = batch_job(plan, index);
    std::optional<JobRecord> record = find_job(request.output, job);
    if (!record) {
      stock.to_do.push_back(index);
    } else if (record->key != keys.key(job)) {
      stock.changed.push_back(index);
    } else if (!record->is_done() &&
               (request.retry || record->attempts.back().end == AttemptEnd::died)) {
      forget_job(request.output, job);
      stock.to_do.push_back(index);
    } else {
      stock.records.push_back(std::move(*record));
    }
  }
  return stock;
}

// Of the plan as it was when the batch was last run.
std::vector<std::string> plan_changes(const fs::path& output, const BatchPlan& plan) {
  const fs::path file = output / kPlanFile;
  if (!fs::exists(file)) return {};
  const Json stored = read_json_file(file);
  const Json before = stored.value("plan", Json::object());
  std::vector<std::string> lines;
  for (const Json& change : Json::diff(before, plan.document)) {
    if (lines.size() == kMostChanges) break;
    const std::string pointer = change.at("path");
    const Json::json_pointer place(pointer);
    const auto text = [&](const Json& document) {
      return document.contains(place) ? shortened(document.at(place).dump(), 60) : "nothing";
    };
    lines.push_back(pointer + ": was " + text(before) + ", is " + text(plan.document));
  }
  return lines;
}

void refuse_changes(const BatchRequest& request, const BatchPlan& plan, size_t changed) {
  std::vector<Problem> problems;
  for (const std::string& line : plan_changes(request.output, plan)) {
    problems.push_back({.file = request.plan_file.string(), .found = line});
  }
  if (problems.empty()) {
    problems.push_back({.file = plan.scene.string(),
                        .found = "this scene, or a file that it names, is not what it was"});
  }
  problems.push_back({.file = request.output.string(),
                      .found = "has " + counted(changed, "job") + " that would be another now",
                      .remedy = "Give --force to make them anew, or another directory"});
  throw Error(ErrorKind::usage, std::move(problems));
}

void write_plan(const BatchRequest& request, const BatchPlan& plan) {
  const Json json = {{"format", "pilesim batch"}, {"version", kVersion}, {"plan", plan.document}};
  write_file_atomically(request.output / kPlanFile, json.dump(2) + '\n');
}

void count(const std::vector<JobRecord>& records, BatchSummary& summary) {
  for (const JobRecord& record : records) {
    switch (record.attempts.empty() ? AttemptEnd::failed : record.attempts.back().end) {
      case AttemptEnd::done:
        ++summary.done;
        break;
      case AttemptEnd::gate:
        ++summary.gate;
        break;
      case AttemptEnd::failed:
        ++summary.failed;
        break;
      case AttemptEnd::died:
        ++summary.died;
        break;
      case AttemptEnd::too_long:
        ++summary.too_long;
        break;
    }
    if (record.attempts.size() > 1) ++summary.tried_again;
    summary.bytes += record.bytes;
  }
}

void write_tables(const BatchRequest& request, const BatchPlan& plan,
                  std::vector<JobRecord> records) {
  std::ranges::sort(records, {}, &JobRecord::index);
  std::string index;
  for (const JobRecord& record : records) index += index_line(record);
  write_file_atomically(request.output / "index.jsonl", index);
  write_file_atomically(request.output / "table.csv", record_table(plan, records));
}

fs::path shard_file(const fs::path& output, uint64_t index) {
  std::string digits = std::to_string(index);
  return output / "shards" /
         (std::string(digits.size() < 5 ? 5 - digits.size() : 0, '0') + digits + ".jsonl");
}

void write_shard(const BatchRequest& request, std::vector<JobRecord> records) {
  std::ranges::sort(records, {}, &JobRecord::index);
  std::string text;
  for (const JobRecord& record : records) text += record_line(record);
  make_output_directory(request.output / "shards");
  write_file_atomically(shard_file(request.output, request.shard->index), text);
}

// By index; what shards have said, which is quicker to read than a file a job.
std::map<uint64_t, JobRecord> shard_records(const fs::path& output) {
  std::map<uint64_t, JobRecord> records;
  std::error_code fault;
  for (const auto& entry : fs::directory_iterator(output / "shards", fault)) {
    if (entry.path().extension() != ".jsonl") continue;
    const std::string text = read_file(entry.path());
    for (size_t begin = 0, end; (end = text.find('\n', begin)) != text.npos; begin = end + 1) {
      JobRecord record = parse_record(text.substr(begin, end - begin), entry.path().string());
      records[record.index] = std::move(record);
    }
  }
  return records;
}

}  // namespace

BatchSummary run_batch(const BatchRequest& request, const RunStep& run_step) {
  const auto start = std::chrono::steady_clock::now();
  const BatchPlan plan = load_batch_plan(request.plan_file);
  const JobKeys keys(plan);
  claim_output(request.output, {}, request.force);
  const fs::path output = fs::absolute(request.output);
  Stock stock = take_stock(request, plan, keys);
  if (!stock.changed.empty() && !request.force) refuse_changes(request, plan, stock.changed.size());

  make_output_directory(output);
  for (const uint64_t index : stock.changed) forget_job(output, batch_job(plan, index));
  stock.to_do.insert(stock.to_do.end(), stock.changed.begin(), stock.changed.end());
  std::ranges::sort(stock.to_do);
  if (!request.shard) {
    if (fs::exists(output / "shards")) remove_in_one_go(output / "shards");
    write_plan(request, plan);
  }

  const auto [begin, end] = bounds_of(request, plan.jobs());
  BatchSummary summary{
      .jobs = end - begin, .of_before = stock.records.size(), .cores = available_threads()};
  const PoolLimits limits{.cores = summary.cores,
                          .processes = request.processes,
                          .memory_bytes = static_cast<uint64_t>(
                              kMemoryShare * static_cast<double>(available_memory()))};
  const BatchPlace place{plan, keys, output};
  install_interrupt_handler();
  std::mutex mutex;
  uint64_t finished = stock.records.size();
  Progress progress(request.progress, "batch", std::max<uint64_t>(end - begin, 1), "jobs");
  progress.update(finished);
  const auto run = [&](uint64_t index, int threads) -> uint64_t {
    const std::optional<JobRecord> record =
        run_job(place, batch_job(plan, index), threads, run_step);
    const std::lock_guard lock(mutex);
    if (!record) {
      if (!interrupted()) ++summary.elsewhere;
      return 0;
    }
    summary.processor_s += record->processor_s();
    stock.records.push_back(*record);
    progress.update(++finished);
    return record->peak_memory_bytes();
  };
  run_pool(stock.to_do, limits, run, interrupted);
  progress.finish();

  count(stock.records, summary);
  if (request.shard) {
    write_shard(request, std::move(stock.records));
  } else {
    write_tables(request, plan, std::move(stock.records));
  }
  summary.wall_s = seconds_since(start);
  if (interrupted()) {
    throw Error(ErrorKind::interrupted,
                Problem{.file = request.output.string(),
                        .found = "was interrupted with " + std::to_string(summary.done) + " of " +
                                 counted(summary.jobs, "job") + " done",
                        .remedy = "The same command goes on from there"});
  }
  return summary;
}

BatchSummary collect_batch(const BatchRequest& request) {
  const auto start = std::chrono::steady_clock::now();
  const BatchPlan plan = load_batch_plan(request.plan_file);
  const JobKeys keys(plan);
  std::map<uint64_t, JobRecord> of_shards = shard_records(request.output);
  std::vector<JobRecord> records;
  BatchSummary summary{.jobs = plan.jobs(), .cores = available_threads()};
  for (uint64_t index = 0; index < summary.jobs; ++index) {
    const BatchJob job = batch_job(plan, index);
    const auto found = of_shards.find(index);
    // What failed in a shard may have been done since, in one of another number.
    if (found != of_shards.end() && found->second.is_done() && found->second.key == keys.key(job)) {
      records.push_back(std::move(found->second));
    } else if (auto record = find_job(request.output, job)) {
      records.push_back(std::move(*record));
    }
  }
  for (const JobRecord& record : records) summary.processor_s += record.processor_s();
  count(records, summary);
  make_output_directory(request.output);
  write_tables(request, plan, std::move(records));
  write_plan(request, plan);
  summary.wall_s = seconds_since(start);
  return summary;
}

BatchForecast forecast_batch(const BatchRequest& request, size_t sample, const RunStep& run_step) {
  const BatchPlan plan = load_batch_plan(request.plan_file);
  const JobKeys keys(plan);
  claim_output(request.output, {}, true);
  BatchRequest looking = request;
  looking.retry = false;
  Stock stock = take_stock(looking, plan, keys);
  BatchForecast forecast{
      .jobs = plan.jobs(), .done = stock.records.size(), .changed = stock.changed.size()};
  if (forecast.changed > 0) forecast.changes = plan_changes(request.output, plan);

  std::vector<JobRecord> samples = std::move(stock.records);
  const fs::path beside = fs::absolute(request.output).string() + ".sample";
  if (samples.empty()) {
    install_interrupt_handler();
    const BatchPlace place{plan, keys, beside};
    for (size_t i = 0; i < sample && !interrupted(); ++i) {
      // Evenly over the batch.
      const uint64_t index = (2 * i + 1) * plan.jobs() / (2 * sample);
      if (!samples.empty() && samples.back().index == index) continue;
      // One thread: as it is where all cores have jobs.
      if (auto record = run_job(place, batch_job(plan, index), 1, run_step)) {
        samples.push_back(std::move(*record));
      }
    }
    if (fs::exists(beside)) remove_in_one_go(beside);
  }
  if (interrupted()) throw Error(ErrorKind::interrupted, Problem{.found = "was interrupted"});

  forecast.sample = samples.size();
  const auto to_do = static_cast<double>(forecast.jobs - forecast.done);
  for (const JobRecord& record : samples) {
    forecast.processor_s_each += record.processor_s() / static_cast<double>(samples.size());
    forecast.longest_s_each = std::max(forecast.longest_s_each, record.wall_s());
    forecast.bytes +=
        static_cast<double>(record.bytes) * to_do / static_cast<double>(samples.size());
    forecast.files +=
        static_cast<double>(record.files) * to_do / static_cast<double>(samples.size());
    forecast.peak_memory_bytes = std::max(forecast.peak_memory_bytes, record.peak_memory_bytes());
  }
  forecast.processor_s = forecast.processor_s_each * to_do;
  forecast.wall_s = forecast.processor_s / available_threads();
  return forecast;
}

}  // namespace pilesim

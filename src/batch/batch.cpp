#include "batch/batch.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <functional>
#include <mutex>

#include "batch/appended_file.h"
#include "batch/job_records.h"
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
// Share of the free memory that the jobs of a batch may take.
constexpr double kMemoryShare = 0.9;

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

std::pair<uint64_t, uint64_t> bounds_of(const BatchRequest& request, uint64_t jobs) {
  if (!request.shard) return {0, jobs};
  const auto [index, count] = *request.shard;
  return {jobs * index / count, jobs * (index + 1) / count};
}

// Counts of a batch's jobs besides its plan; all other jobs were tried.
struct Stock {
  std::vector<uint64_t> to_do, changed;
};

Stock take_stock(const BatchRequest& request, const BatchPlace& place,
                 const std::function<void(const JobRecord&)>& tried) {
  Stock stock;
  const auto [begin, end] = bounds_of(request, place.plan.jobs());
  for (uint64_t index = begin; index < end; ++index) {
    const BatchJob job = batch_job(place.plan, index);
    const std::optional<JobRecord> record = find_job(place.directory, job);
    if (!record) {
      stock.to_do.push_back(index);
    } else if (record->key != place.keys.key(job)) {
      stock.changed.push_back(index);
    } else if (!record->is_done() &&
               (request.retry || record->attempts.back().end == AttemptEnd::died)) {
      forget_job(place.directory, job);
      stock.to_do.push_back(index);
    } else {
      tried(*record);
    }
  }
  return stock;
}

// Changes to the plan since the batch was last run.
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
    problems.push_back(
        {.file = plan.scene.string(), .found = "this scene, or a file that it names, has changed"});
  }
  problems.push_back({.file = request.output.string(),
                      .found = "has " + counted(changed, "job") + " that would be another now",
                      .remedy = "Give --force to make them again, or another directory"});
  throw Error(ErrorKind::usage, std::move(problems));
}

void write_plan(const BatchRequest& request, const BatchPlan& plan) {
  const Json json = {{"format", "pilesim batch"}, {"version", kVersion}, {"plan", plan.document}};
  write_file_atomically(request.output / kPlanFile, json.dump(2) + '\n');
}

void count(const JobRecord& record, BatchSummary& summary) {
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

void write_tables(const BatchPlace& place, const JobRecords& records,
                  const std::function<void(const JobRecord&)>& visit) {
  AppendedFile index(place.directory / "index.jsonl"), table(place.directory / "table.csv");
  table.add(table_head(place.plan));
  records.each(0, place.plan.jobs(), [&](const BatchJob&, const JobRecord& record) {
    index.add(index_line(record));
    table.add(table_row(place.plan, record));
    visit(record);
  });
  index.take_place();
  table.take_place();
}

fs::path shard_file(const fs::path& output, uint64_t index) {
  std::string digits = std::to_string(index);
  return output / "shards" /
         (std::string(digits.size() < 5 ? 5 - digits.size() : 0, '0') + digits + ".jsonl");
}

void write_shard(const BatchRequest& request, const BatchPlace& place, const JobRecords& records) {
  make_output_directory(place.directory / "shards");
  AppendedFile file(shard_file(place.directory, request.shard->index));
  const auto [begin, end] = bounds_of(request, place.plan.jobs());
  records.each(begin, end,
               [&](const BatchJob&, const JobRecord& record) { file.add(record_line(record)); });
  file.take_place();
}

}  // namespace

BatchSummary run_batch(const BatchRequest& request, const RunStep& run_step) {
  const auto start = std::chrono::steady_clock::now();
  const BatchPlan plan = load_batch_plan(request.plan_file);
  const JobKeys keys(plan);
  claim_output(request.output, {}, request.force);
  const fs::path output = fs::absolute(request.output);
  const BatchPlace place{plan, keys, output};
  const auto [begin, end] = bounds_of(request, plan.jobs());
  BatchSummary summary{.jobs = end - begin, .cores = available_threads()};
  const auto tried = [&](const JobRecord& record) { count(record, summary); };
  Stock stock = take_stock(request, place, tried);
  if (!stock.changed.empty() && !request.force) refuse_changes(request, plan, stock.changed.size());

  make_output_directory(output);
  for (const uint64_t index : stock.changed) forget_job(output, batch_job(plan, index));
  stock.to_do.insert(stock.to_do.end(), stock.changed.begin(), stock.changed.end());
  std::ranges::sort(stock.to_do);
  if (!request.shard) {
    if (fs::exists(output / "shards")) remove_in_one_go(output / "shards");
    write_plan(request, plan);
  }

  summary.of_before = end - begin - stock.to_do.size();
  const PoolLimits limits{.cores = summary.cores,
                          .processes = request.processes,
                          .memory_bytes = static_cast<uint64_t>(
                              kMemoryShare * static_cast<double>(available_memory()))};
  install_interrupt_handler();
  std::mutex mutex;
  uint64_t finished = summary.of_before;
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
    tried(*record);
    progress.update(++finished);
    return record->peak_memory_bytes();
  };
  run_pool(stock.to_do, limits, run, interrupted);
  progress.finish();

  const JobRecords records(place);
  if (request.shard) {
    write_shard(request, place, records);
    if (!interrupted()) summary.collected = pack_tars(place, records, begin, end);
  } else {
    write_tables(place, records, [](const JobRecord&) {});
    if (!interrupted()) summary.collected = collect_datasets(place, records);
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
  claim_output(request.output, {}, true);
  const BatchPlace place{plan, keys, fs::absolute(request.output)};
  make_output_directory(place.directory);
  install_interrupt_handler();
  const JobRecords records(place, true);
  BatchSummary summary{.jobs = plan.jobs(), .cores = available_threads()};
  write_tables(place, records, [&](const JobRecord& record) {
    count(record, summary);
    summary.processor_s += record.processor_s();
  });
  write_plan(request, plan);
  summary.collected = collect_datasets(place, records);
  summary.wall_s = seconds_since(start);
  return summary;
}

BatchForecast forecast_batch(const BatchRequest& request, size_t sample, const RunStep& run_step) {
  const BatchPlan plan = load_batch_plan(request.plan_file);
  const JobKeys keys(plan);
  claim_output(request.output, {}, true);
  BatchRequest looking = request;
  looking.retry = false;
  BatchForecast forecast{.jobs = plan.jobs()};
  const auto measured = [&](const JobRecord& record) {
    ++forecast.sample;
    forecast.processor_s_each += record.processor_s();
    forecast.bytes_each += static_cast<double>(record.bytes);
    forecast.files_each += static_cast<double>(record.files);
    forecast.longest_s_each = std::max(forecast.longest_s_each, record.wall_s());
    forecast.peak_memory_bytes = std::max(forecast.peak_memory_bytes, record.peak_memory_bytes());
  };
  const BatchPlace place{plan, keys, fs::absolute(request.output)};
  const Stock stock = take_stock(looking, place, measured);
  forecast.done = forecast.sample;
  forecast.changed = stock.changed.size();
  if (forecast.changed > 0) forecast.changes = plan_changes(request.output, plan);

  const fs::path beside = fs::absolute(request.output).string() + ".sample";
  if (forecast.sample == 0) {
    install_interrupt_handler();
    const BatchPlace samples{plan, keys, beside};
    uint64_t last = plan.jobs();
    for (size_t i = 0; i < sample && !interrupted(); ++i) {
      // Spread the sample evenly over the batch.
      const uint64_t index = (2 * i + 1) * plan.jobs() / (2 * sample);
      if (index == last) continue;
      last = index;
      // One thread, as when all cores have jobs.
      if (const auto record = run_job(samples, batch_job(plan, index), 1, run_step)) {
        measured(*record);
      }
    }
    if (fs::exists(beside)) remove_in_one_go(beside);
  }
  if (interrupted()) throw Error(ErrorKind::interrupted, Problem{.found = "was interrupted"});

  const double share = 1 / static_cast<double>(std::max<size_t>(forecast.sample, 1));
  forecast.processor_s_each *= share;
  forecast.bytes_each *= share;
  forecast.files_each *= share;
  const auto to_do = static_cast<double>(forecast.jobs - forecast.done);
  forecast.processor_s = forecast.processor_s_each * to_do;
  forecast.wall_s = forecast.processor_s / available_threads();
  forecast.bytes = forecast.bytes_each * to_do;
  forecast.files = forecast.files_each * to_do;
  return forecast;
}

}  // namespace pilesim

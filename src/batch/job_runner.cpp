#include "batch/job_runner.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <chrono>
#include <fstream>

#include "batch/steps.h"
#include "core/atomic_file.h"
#include "core/error.h"
#include "core/interrupt.h"
#include "core/output_directory.h"
#include "core/subprocess.h"
#include "core/temporary_file.h"
#include "core/text.h"

namespace pilesim {
namespace {

namespace fs = std::filesystem;

constexpr double kPatience_s = 10;  // between the request to stop and the kill
constexpr double kPoll_s = 0.02;    // largest delay until the end of a step is noticed
constexpr size_t kLongestWords = 400;

// A lock for work on a job; released with the process, however it ends.
class JobLock {
 public:
  explicit JobLock(const fs::path& directory)
      : descriptor_(open((directory / "lock").c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644)) {
    if (descriptor_ < 0) throw io_error((directory / "lock").string(), "cannot be written", errno);
    is_held_ = flock(descriptor_, LOCK_EX | LOCK_NB) == 0;
  }
  ~JobLock() { close(descriptor_); }
  JobLock(const JobLock&) = delete;
  JobLock& operator=(const JobLock&) = delete;

  bool is_held() const { return is_held_; }

 private:
  int descriptor_;
  bool is_held_ = false;
};

std::string last_line(std::string text) {
  while (!text.empty() && text.back() == '\n') text.pop_back();
  text = text.substr(text.rfind('\n') + 1);
  return text.size() > kLongestWords ? text.substr(0, kLongestWords) + "..." : text;
}

// Removes all of an attempt except the job's own records.
void clear(const fs::path& directory) {
  std::vector<fs::path> entries;
  for (const auto& entry : fs::directory_iterator(directory)) {
    const std::string name = entry.path().filename().string();
    if (name != "lock" && name != kJobFile && name != "log.txt") entries.push_back(entry.path());
  }
  for (const fs::path& entry : entries) remove_in_one_go(entry);
}

void log_step(const fs::path& directory, const StepCommand& command, const StepResult& result) {
  std::string text = "$ pilesim";
  for (const std::string& word : command.words) text += ' ' + word;
  text += '\n' + result.output + '\n';
  std::ofstream stream(directory / "log.txt", std::ios::app);
  stream << text;
  if (!stream.flush()) throw io_error((directory / "log.txt").string(), "cannot be written", errno);
}

AttemptEnd end_of(const StepResult& result) {
  if (result.was_too_long) return AttemptEnd::too_long;
  if (result.exit_status == 0) return AttemptEnd::done;
  if (result.exit_status == static_cast<int>(ErrorKind::quality)) return AttemptEnd::gate;
  const bool has_said_why = result.exit_status == static_cast<int>(ErrorKind::usage) ||
                            result.exit_status == static_cast<int>(ErrorKind::input);
  return has_said_why ? AttemptEnd::failed : AttemptEnd::died;
}

// One job in progress.
class Job {
 public:
  Job(const BatchPlace& place, const BatchJob& job, int threads, const RunStep& run_step,
      fs::path directory)
      : place_(place),
        job_(job),
        threads_(threads),
        run_step_(run_step),
        directory_(std::move(directory)) {
    begin();
  }

  // False if it was interrupted.
  bool run() {
    while (!has_ended()) {
      const std::optional<Attempt> attempt =
          run_attempt(scene_seed(place_.plan, job_, record_.verdicts()));
      if (!attempt) return false;
      record_.attempts.push_back(*attempt);
      record_.steps_done = 0;
      save();
      if (!has_ended()) clear(directory_);
    }
    return true;
  }

  // Afterwards only the directory has to be renamed.
  JobRecord finish() {
    save();  // replaces the partial output of a process killed during this step
    if (record_.is_done()) {
      for (const std::string& path : place_.plan.drop) {
        if (fs::exists(directory_ / path)) remove_in_one_go(directory_ / path);
      }
      const ResultSum sum = sum_results(directory_);
      record_.hash = sum.hash;
      record_.files = sum.files;
      record_.bytes = sum.bytes;
    } else {
      clear(directory_);
    }
    save();
    fs::remove(directory_ / "lock");
    return record_;
  }

 private:
  // True also if an earlier process was killed before it renamed the directory.
  bool has_ended() const {
    if (record_.attempts.empty()) return false;
    const AttemptEnd end = record_.attempts.back().end;
    return end == AttemptEnd::done || end == AttemptEnd::failed ||
           static_cast<int>(record_.attempts.size()) >= place_.plan.tries;
  }

  // Continues the results of an earlier process if they belong to the same job.
  void begin() {
    const fs::path file = directory_ / kJobFile;
    const std::string key = place_.keys.key(job_);
    if (fs::exists(file)) {
      record_ = read_job_record(file);
      was_resumed_ = record_.key == key;
    }
    if (was_resumed_) return;
    clear(directory_);
    fs::remove(directory_ / "log.txt");
    record_ = {.index = job_.index, .key = key, .values = Json::object()};
    for (const JobValue& value : job_.values) record_.values[value.pointer] = value.value;
    save();
  }

  void save() const { write_job_record(directory_ / kJobFile, record_); }

  std::optional<Attempt> run_attempt(uint64_t seed) {
    Attempt attempt{.seed = seed};
    const auto steps = static_cast<int>(place_.plan.steps.size());
    while (record_.steps_done < steps) {
      const auto step = static_cast<size_t>(record_.steps_done);
      const StepCommand command{.words = step_words(place_.plan, job_, step, seed, threads_),
                                .directory = directory_,
                                .longest_s = place_.plan.longest_s};
      try {
        require_inside(command.words, place_.plan.steps[step], directory_);
      } catch (const Error& error) {
        attempt.end = AttemptEnd::failed;
        attempt.what = "pilesim " + command.words[0] + ": " + error.what();
        return attempt;
      }
      const StepResult result = run_step_(command);
      attempt.wall_s += result.wall_s;
      attempt.processor_s += result.processor_s;
      attempt.peak_memory_bytes = std::max(attempt.peak_memory_bytes, result.peak_memory_bytes);
      if (result.was_interrupted) return std::nullopt;
      log_step(directory_, command, result);
      attempt.end = end_of(result);
      if (result.exit_status == static_cast<int>(ErrorKind::io)) {
        throw Error(ErrorKind::io,
                    Problem{.file = directory_.string(), .found = result.last_words});
      }
      if (attempt.end == AttemptEnd::failed && was_resumed_) {
        // Earlier results may come from another version of pilesim.
        was_resumed_ = false;
        clear(directory_);
        record_.steps_done = 0;
        continue;
      }
      if (attempt.end != AttemptEnd::done) {
        attempt.what =
            "pilesim " + command.words[0] + ": " +
            (result.was_too_long ? "took longer than " + with_digits(command.longest_s, 3) + " s"
                                 : result.last_words);
        return attempt;
      }
      ++record_.steps_done;
      save();
    }
    return attempt;
  }

  const BatchPlace& place_;
  const BatchJob& job_;
  int threads_;
  const RunStep& run_step_;
  fs::path directory_;
  JobRecord record_;
  bool was_resumed_ = false;
};

}  // namespace

RunStep step_processes() {
  return [](const StepCommand& command) {
    using Clock = std::chrono::steady_clock;
    const auto start = Clock::now();
    const auto elapsed = [&] {
      return std::chrono::duration<double>(Clock::now() - start).count();
    };
    std::vector<std::string> words = {"/proc/self/exe"};
    words.insert(words.end(), command.words.begin(), command.words.end());
    StepResult step;
    SubprocessResult ended;
    {
      Subprocess process(words, "pilesim", command.directory);
      while (!process.ends_within(kPoll_s)) {
        step.was_interrupted = interrupted();
        step.was_too_long = elapsed() > command.longest_s;
        if (!step.was_interrupted && !step.was_too_long) continue;
        process.ask_to_end();
        if (!process.ends_within(kPatience_s)) process.kill();
        break;
      }
      ended = process.wait();
    }
    step.exit_status = ended.exit_status;
    step.output = ended.output + ended.errors;
    step.last_words = last_line(ended.errors);
    if (step.last_words.empty() && ended.exit_status > 128) {
      step.last_words = "was ended by signal " + std::to_string(ended.exit_status - 128);
    }
    step.wall_s = elapsed();
    step.processor_s = ended.processor_s;
    step.peak_memory_bytes = ended.peak_memory_bytes;
    return step;
  };
}

fs::path job_directory(const fs::path& batch, const BatchJob& job) {
  const std::string name = job.name();
  return batch / "jobs" / name.substr(0, name.size() - 3) / name;
}

fs::path partial_directory(const fs::path& batch, const BatchJob& job) {
  const fs::path whole = job_directory(batch, job);
  return whole.parent_path() / ('.' + whole.filename().string() + ".part");
}

std::optional<JobRecord> find_job(const fs::path& batch, const BatchJob& job) {
  const fs::path file = job_directory(batch, job) / kJobFile;
  if (!fs::exists(file)) return std::nullopt;
  return read_job_record(file);
}

void forget_job(const fs::path& batch, const BatchJob& job) {
  const fs::path whole = job_directory(batch, job), partial = partial_directory(batch, job);
  if (fs::exists(whole)) remove_in_one_go(whole);
  if (!fs::exists(partial)) return;
  const JobLock lock(partial);
  if (lock.is_held()) remove_in_one_go(partial);
}

std::optional<JobRecord> run_job(const BatchPlace& place, const BatchJob& job, int threads,
                                 const RunStep& run_step) {
  const fs::path whole = job_directory(place.directory, job);
  const fs::path partial = partial_directory(place.directory, job);
  make_output_directory(partial);
  // A symbolic link would redirect what the job writes and removes.
  const fs::path way = fs::canonical(partial).lexically_relative(fs::canonical(place.directory));
  if (way != partial.lexically_relative(place.directory)) {
    throw Error(ErrorKind::usage, Problem{.file = partial.string(),
                                          .found = "is a symbolic link, or lies behind one",
                                          .remedy = "Remove the link, or name another directory"});
  }
  const JobLock lock(partial);
  if (!lock.is_held()) return std::nullopt;
  if (fs::exists(whole)) {  // another process has just finished the job
    fs::remove_all(partial);
    return find_job(place.directory, job);
  }
  Job under_way(place, job, threads, run_step, partial);
  if (!under_way.run()) return std::nullopt;
  JobRecord record = under_way.finish();
  std::error_code fault;
  fs::rename(partial, whole, fault);
  if (fault) throw io_error(whole.string(), "cannot be made", fault.value());
  return record;
}

}  // namespace pilesim

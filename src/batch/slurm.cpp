#include "batch/slurm.h"

#include <unistd.h>

#include <algorithm>
#include <cmath>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/output_directory.h"
#include "core/printable.h"
#include "core/subprocess.h"

namespace pilesim {
namespace {

namespace fs = std::filesystem;

// The usual limit of a cluster on arrays (MaxArraySize 1001).
constexpr uint64_t kMostTasks = 1000;
// Nodes are shared and slower than the machine of the sample. A task that runs out of time
// continues once it is queued again.
constexpr double kTimeToSpare = 3;
constexpr double kMemoryToSpare = 1.5;
constexpr double kLeastMinutes = 5;
constexpr uint64_t kLeastMegabytes = 512;

// The path of the running program.
std::string program() { return fs::read_symlink("/proc/self/exe").string(); }

std::string batch_words(const BatchRequest& request, const fs::path& output) {
  return shell_word(program()) + " batch " + shell_word(fs::absolute(request.plan_file).string()) +
         " -o " + shell_word(output.string()) + " --progress none";
}

}  // namespace

SlurmSubmission submit_to_slurm(const BatchRequest& request, const BatchForecast& forecast,
                                const SlurmChoice& choice) {
  const fs::path output = fs::absolute(request.output).lexically_normal();
  for (const std::string& path :
       {output.string(), fs::absolute(request.plan_file).string(), program()}) {
    if (printable(path) == path) continue;
    throw Error(ErrorKind::usage,
                Problem{.file = path,
                        .found = "has characters in its name that no script can hold",
                        .remedy = "Give it another name, without line ends and the like"});
  }
  const uint64_t to_do = forecast.jobs - forecast.done;
  const double minutes = forecast.processor_s_each * static_cast<double>(to_do) / 60;
  SlurmSubmission submission;
  submission.tasks =
      std::clamp<uint64_t>(static_cast<uint64_t>(std::ceil(minutes / choice.minutes_each)), 1,
                           std::min(kMostTasks, std::max<uint64_t>(to_do, 1)));
  const double each =
      std::max(minutes / static_cast<double>(submission.tasks), forecast.longest_s_each / 60);
  submission.minutes_asked = std::ceil(std::max(kTimeToSpare * each, kLeastMinutes));
  submission.megabytes_asked = std::max(
      static_cast<uint64_t>(kMemoryToSpare * static_cast<double>(forecast.peak_memory_bytes) / 1e6),
      kLeastMegabytes);

  const fs::path scripts = output / "slurm";
  make_output_directory(scripts);
  const std::string last = std::to_string(submission.tasks - 1);
  const std::string array =
      "#!/bin/sh\n"
      "#SBATCH --job-name=pilesim\n"
      "#SBATCH --array=0-" +
      last +
      "\n"
      "#SBATCH --cpus-per-task=1\n"
      "#SBATCH --time=" +
      std::to_string(std::lround(submission.minutes_asked)) +
      "\n"
      "#SBATCH --mem=" +
      std::to_string(submission.megabytes_asked) +
      "M\n"
      "#SBATCH --requeue\n"
      "#SBATCH --open-mode=append\n"
      "#SBATCH --output=" +
      (scripts / "task_%a.log").string() +
      "\n"
      "# A minute before its time is over a task ends in good order and is queued again: it goes "
      "on\n"
      "# where it was.\n"
      "#SBATCH --signal=B:USR1@60\n"
      "trap 'kill -TERM \"$work\"; wait \"$work\"; scontrol requeue \"$SLURM_JOB_ID\"; exit 0' "
      "USR1\n" +
      batch_words(request, output) + " --processes 1 --shard \"$SLURM_ARRAY_TASK_ID/" +
      std::to_string(submission.tasks) + "\"" + (request.retry ? " --retry" : "") +
      (request.force ? " --force" : "") + " &\nwork=$!\nwait \"$work\"\n";
  const std::string collect =
      "#!/bin/sh\n"
      "#SBATCH --job-name=pilesim-collect\n"
      "#SBATCH --time=60\n"
      "#SBATCH --mem=1G\n"
      "#SBATCH --output=" +
      (scripts / "collect.log").string() +
      "\n"
      "exec " +
      batch_words(request, output) + " --collect\n";
  write_file_atomically(scripts / "array.sh", array);
  write_file_atomically(scripts / "collect.sh", collect);
  if (!choice.submit) return submission;

  const auto submit = [&](const std::vector<std::string>& options, const fs::path& script) {
    std::vector<std::string> words = {"sbatch", "--parsable"};
    words.insert(words.end(), choice.options.begin(), choice.options.end());
    words.insert(words.end(), options.begin(), options.end());
    words.push_back(script.string());
    std::string id = run_program(words, "slurm-client");
    return id.substr(0, id.find_first_of(";\n"));
  };
  submission.array_id = submit({}, scripts / "array.sh");
  try {
    submission.collect_id =
        submit({"--dependency=afterany:" + submission.array_id}, scripts / "collect.sh");
  } catch (const Error&) {  // submit all or nothing
    run_program({"scancel", submission.array_id}, "slurm-client");
    throw;
  }
  return submission;
}

}  // namespace pilesim

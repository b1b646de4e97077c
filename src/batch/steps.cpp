#include "batch/steps.h"

#include <algorithm>
#include <cctype>
#include <functional>
#include <set>

#include "core/error.h"
#include "core/printable.h"
#include "json/codec.h"

namespace pilesim {
namespace {

constexpr char kOpening = '{';

// A command that can be a step: its name, its possible predecessors, and whether its first word is
// the plan's scene.
struct Command {
  std::string_view name;
  bool may_begin = false, may_follow = false;
  bool wants_scene = false;  // as the first step; otherwise its first word is a path from the plan
};
constexpr Command kCommands[] = {
    {.name = "simulate", .may_begin = true, .may_follow = true, .wants_scene = true},
    {.name = "direct-pile", .may_begin = true, .wants_scene = true},
    {.name = "compare", .may_begin = true, .wants_scene = true},
    {.name = "sample-signature", .may_begin = true},
    {.name = "render", .may_begin = true, .may_follow = true},
    {.name = "finish", .may_follow = true},
    {.name = "export", .may_follow = true},
};

const Command* command_of(const BatchStep& step) {
  const auto found = std::ranges::find(kCommands, step[0], &Command::name);
  return found == std::end(kCommands) ? nullptr : found;
}

// The picture takes 0.2 s per job and most of the report: plans that need pictures have a step for
// them.
constexpr const char* kNoPicture = "--no-picture";

// Options that plans may not set, since the batch chooses them.
const std::set<std::string> kOurs = {
    "--threads", "--resume",   "--progress", "--quiet",           "-q",       "--print-config",
    "--from",    "--force",    "--seed",     "--checkpoint",      kNoPicture, "--help",
    "-h",        "--help-all", "--version",  "--write-collisions"};

std::string option_of(const std::string& word) { return word.substr(0, word.find('=')); }

bool names_output(const std::string& word) {
  const std::string option = option_of(word);
  return option == "-o" || option == "--output";
}

// Calls take(begin, end, name) for each {name} of `word`. JSON in braces never matches a name.
void for_each_name(const std::string& word,
                   const std::function<void(size_t, size_t, const std::string&)>& take) {
  for (size_t begin = 0; (begin = word.find(kOpening, begin)) != word.npos; ++begin) {
    size_t end = begin + 1;
    while (end < word.size() &&
           (std::isalnum(static_cast<unsigned char>(word[end])) != 0 || word[end] == '_')) {
      ++end;
    }
    if (end < word.size() && word[end] == '}' && end > begin + 1) {
      take(begin, end + 1, word.substr(begin + 1, end - begin - 1));
    }
  }
}

std::string filled(const std::string& word, const BatchJob& job) {
  std::string text;
  size_t at = 0;
  for_each_name(word, [&](size_t begin, size_t end, const std::string& name) {
    const auto value = std::ranges::find(job.values, name, &JobValue::pointer);
    text += word.substr(at, begin - at);
    text += value->value.is_string() ? value->value.get<std::string>() : value->value.dump();
    at = end;
  });
  return text + word.substr(at);
}

// "run", "run_2": each simulation of a job has its own directory, with its finish beside it.
std::string numbered(const std::string& name, int number) {
  return number == 1 ? name : name + '_' + std::to_string(number);
}

struct Runs {
  int count = 0;        // simulations before the step
  std::string current;  // the trajectory that it reads
};

Runs runs_before(const BatchPlan& plan, size_t step) {
  Runs runs;
  for (size_t i = 0; i < step; ++i) {
    const std::string& name = plan.steps[i][0];
    if (name == "simulate" || name == "direct-pile") {
      runs.current = numbered("run", ++runs.count);
    } else if (name == "finish") {
      runs.current = numbered("finished", runs.count);
    }
  }
  return runs;
}

// Directory of a render step's pictures.
std::string pictures_of(const BatchPlan& plan, size_t step) {
  const BatchStep& words = plan.steps[step];
  for (size_t i = 1; i < words.size(); ++i) {
    if (!names_output(words[i])) continue;
    const size_t value = words[i].find('=');
    if (value != std::string::npos) return words[i].substr(value + 1);
    if (i + 1 < words.size()) return words[i + 1];
  }
  return step == 0 ? "run" : runs_before(plan, step).current;
}

// "-oX", "-qo": a one-letter option joined with its value or another option.
bool is_joined(const std::string& word) {
  return word.size() > 2 && word[0] == '-' &&
         std::isalpha(static_cast<unsigned char>(word[1])) != 0;
}

// The values of -o in a step.
std::vector<std::string> outputs_of(const std::vector<std::string>& words) {
  std::vector<std::string> outputs;
  for (size_t i = 1; i < words.size(); ++i) {
    if (!names_output(words[i])) continue;
    const size_t value = words[i].find('=');
    if (value != std::string::npos) {
      outputs.push_back(words[i].substr(value + 1));
    } else if (i + 1 < words.size()) {
      outputs.push_back(words[++i]);
    }
  }
  return outputs;
}

bool is_below(const std::string& name) {
  const auto normal = std::filesystem::path(name).lexically_normal();
  return !normal.empty() && !normal.is_absolute() && *normal.begin() != ".." && normal != ".";
}

void check_words(const BatchPlan& plan, size_t i, std::set<std::string>& used, ProblemLog& log) {
  const Path root, steps = root / "steps", step = steps / i;
  const BatchStep& words = plan.steps[i];
  for (size_t word = 1; word < words.size(); ++word) {
    const std::string option = option_of(words[word]);
    const bool may_name = words[0] == "export" || words[0] == "render";
    if (kOurs.contains(option) || (names_output(words[word]) && !may_name)) {
      log.report(step / word, "is \"" + option + '"',
                 "an option that the batch does not set itself", "Leave it out");
    }
    if (is_joined(words[word])) {
      log.report(step / word, "is \"" + printable(words[word]) + '"',
                 "an option of one letter and its value as two words");
    }
    for_each_name(words[word], [&](size_t, size_t, const std::string& name) {
      used.insert(name);
      const bool is_set = std::ranges::any_of(plan.vary, [&](const Variation& variation) {
        return std::ranges::find(variation.pointers, name) != variation.pointers.end();
      });
      if (!is_set) {
        log.report(step / word, "has {" + printable(name) + "}", "a name that \"vary\" sets");
      }
    });
  }
  for (const std::string& output : outputs_of(words)) {
    if (words[0] != "render" && !is_below(output)) {
      log.report(step, "writes \"" + printable(output) + '"', "a path below the job's directory");
    }
  }
  if (words[0] == "render" && !is_below(pictures_of(plan, i))) {
    log.report(step, "draws into \"" + printable(pictures_of(plan, i)) + '"',
               "a path below the job's directory");
  }
}

// Checks the input of the first step: the scene, or its own first word.
void check_input(const BatchPlan& plan, const Command& first, ProblemLog& log) {
  const Path root, steps = root / "steps", step = steps / size_t{0};
  const BatchStep& words = plan.steps[0];
  const bool has_word = words.size() > 1 && !words[1].starts_with('-');
  if (first.wants_scene && plan.scene.empty()) {
    log.report(root, "has no \"scene\"", "the scene file that \"" + words[0] + "\" works on");
  }
  if (first.wants_scene) return;
  if (!plan.scene.empty()) {
    log.report(root / "scene", "stands beside a first step \"" + words[0] + '"',
               "no scene: that command has its input among its own words");
  }
  if (!has_word) {
    log.report(step, "is \"" + words[0] + "\" without an input",
               words[0] == "render" ? "the directory of a run after it, relative to the plan"
                                    : "a mesh after it, relative to the plan: \"{mesh}\"");
  }
}

}  // namespace

void check_steps(const BatchPlan& plan, ProblemLog& log) {
  const Path root, path = root / "steps";
  std::set<std::string> used;
  for (size_t i = 0; i < plan.steps.size(); ++i) {
    const Path step = path / i;
    const Command* command = command_of(plan.steps[i]);
    const bool comes_after_run =
        i > 0 && (plan.steps[0][0] == "simulate" || plan.steps[0][0] == "direct-pile");
    const bool fits =
        command && (i == 0 ? command->may_begin : command->may_follow && comes_after_run);
    if (!fits) {
      const std::string expected =
          i == 0 ? "\"simulate\" or \"direct-pile\"; or \"compare\", \"render\" or "
                   "\"sample-signature\""
          : comes_after_run
              ? "\"finish\", \"render\", \"export\" or, from where the bodies lie, \"simulate\""
              : "no further step after \"" + printable(plan.steps[0][0]) + '"';
      log.report(step / size_t{0}, "is \"" + printable(plan.steps[i][0]) + '"', expected);
      continue;
    }
    if (i == 0) check_input(plan, *command, log);
    check_words(plan, i, used, log);
  }
  const Path vary = root / "vary";
  const bool takes_values = plan.steps[0][0] != "sample-signature";
  for (size_t i = 0; i < plan.vary.size(); ++i) {
    for (const std::string& pointer : plan.vary[i].pointers) {
      const Path set = vary / i;
      if (pointer.starts_with('/') && !takes_values) {
        log.report(set / "set", "is \"" + printable(pointer) + "\", and there is no scene",
                   "a name that stands in braces in \"steps\"");
      } else if (!pointer.starts_with('/') && !used.contains(pointer)) {
        log.report(
            set / "set", "is \"" + printable(pointer) + "\", which no step has in braces",
            "a JSON pointer into the scene (\"/seed\"), or {" + printable(pointer) + "} in a step");
      }
    }
  }
}

std::vector<std::string> step_words(const BatchPlan& plan, const BatchJob& job, size_t step,
                                    uint64_t seed, int threads) {
  const BatchStep& said = plan.steps[step];
  const std::string& name = said[0];
  const auto [count, current] = runs_before(plan, step);
  std::vector<std::string> words = {name};
  const auto add = [&](std::initializer_list<std::string> more) {
    words.insert(words.end(), more);
  };
  const auto add_values = [&] {
    for (const JobValue& value : job.values) {
      if (value.is_in_scene() && value.pointer != "/seed") add({"--set", override_text(value)});
    }
  };
  const std::string scene = plan.scene.string();
  size_t first_said = 1;
  if (name == "simulate" || name == "direct-pile") {
    add({scene, "-o", numbered("run", count + 1), "--resume", kNoPicture});
    if (count > 0) add({"--from", current});
    add_values();
    // Views and other random choices of pictures depend on the seed, which differs between the runs
    // of a job.
    add({"--seed", std::to_string(seed + static_cast<uint64_t>(count))});
  } else if (name == "compare") {
    add({scene, "-o", "comparison", "--resume"});
    add_values();
    add({"--seed", std::to_string(seed)});
  } else if (name == "finish") {
    add({current, "-o", numbered("finished", count), "--scene", scene, "--resume", kNoPicture});
  } else if (name == "sample-signature") {
    add({step_input(plan, job).string(), "-o", "signature.sig", "--seed", std::to_string(seed)});
    first_said = 2;
  } else if (name == "render" && step == 0) {
    add({step_input(plan, job).string(), "-o", pictures_of(plan, step), "--resume"});
    add_values();
    first_said = 2;
  } else if (name == "render") {
    add({current, "--resume"});
  } else {
    add({current, "--force"});
  }
  if (name != "export") add({"--threads", std::to_string(threads)});
  for (size_t i = first_said; i < said.size(); ++i) words.push_back(filled(said[i], job));
  return words;
}

void require_inside(const std::vector<std::string>& words, const BatchStep& said,
                    const std::filesystem::path& directory) {
  namespace fs = std::filesystem;
  const auto refuse = [](std::string found, std::string expected) {
    throw Error(ErrorKind::input,
                Problem{.found = std::move(found), .expected = std::move(expected)});
  };
  // A value in braces must not become an option; the plan's author may write options in full.
  for (size_t i = 1, first = words.size() - said.size(); i < said.size(); ++i) {
    const std::string& word = words[first + i];
    if (said[i].starts_with(kOpening) && word.starts_with('-') && word != said[i]) {
      refuse(said[i] + " is \"" + word + '"', "a value that does not begin with -");
    }
  }
  const fs::path whole = fs::canonical(directory);
  for (const std::string& output : outputs_of(words)) {
    const fs::path way = fs::weakly_canonical(directory / output).lexically_relative(whole);
    if (way.empty() || way == "." || *way.begin() == "..") {
      refuse("the output \"" + output + "\" lies outside of the job's directory",
             "a path below it, as links lead");
    }
  }
}

std::filesystem::path step_input(const BatchPlan& plan, const BatchJob& job) {
  return (plan.file.parent_path() / filled(plan.steps[0][1], job)).lexically_normal();
}

std::vector<std::string> picture_directories(const BatchPlan& plan, const BatchJob& job) {
  std::vector<std::string> names;
  for (size_t i = 0; i < plan.steps.size(); ++i) {
    if (plan.steps[i][0] != "render") continue;
    const std::string name = filled(pictures_of(plan, i), job);
    if (std::ranges::find(names, name) == names.end()) names.push_back(name);
  }
  return names;
}

}  // namespace pilesim

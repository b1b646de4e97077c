#include "options.h"

#include <algorithm>
#include <array>
#include <optional>
#include <string_view>

#include "core/parallel_for.h"
#include "numbers.h"
#include "scene/overrides.h"

namespace pilesim {

std::function<std::string(const std::string&)> named() {
  return [](const std::string& path) {
    return path.empty() ? "the name of a file or directory is empty" : "";
  };
}

CLI::Option* add_word(CLI::App& command, const std::string& name, std::vector<std::string> words,
                      std::function<void(size_t)> take, const std::string& description) {
  const std::string type = CLI::detail::join(words, "|");
  const auto read = [name, words = std::move(words),
                     take = std::move(take)](const std::string& text) {
    const auto found = std::ranges::find(words, text);
    if (found != words.end()) return take(static_cast<size_t>(found - words.begin()));
    throw CLI::ValidationError(name,
                               "'" + text + "' is not one of " + CLI::detail::join(words, ", "));
  };
  return command.add_option_function<std::string>(name, read, description)->type_name(type);
}

void Overrides::add(const std::string& text, const std::string& option, const std::string& value) {
  texts.push_back(text);
  given_as[text] = option + ' ' + value;
}

void with_options_named(const Overrides& overrides, const std::function<void()>& work) {
  try {
    work();
  } catch (const Error& error) {
    std::vector<Problem> problems = error.problems();
    for (Problem& problem : problems) {
      for (const auto& [text, option] : overrides.given_as) {
        if (problem.file == parse_override(text).place()) problem.file = option;
      }
    }
    throw Error(error.kind(), std::move(problems));
  }
}

void add_override_option(CLI::App& command, Overrides& overrides, const std::string& description) {
  const auto check = [](const std::string& argument) -> std::string {
    if (argument.starts_with('/') && argument.find('=') != argument.npos) return {};
    return "'" + argument + "' is not /POINTER=VALUE; write for example /simulator/sleeping=false";
  };
  // Added to what other options put there, whatever their order.
  const auto add = [&texts = overrides.texts](const std::vector<std::string>& more) {
    texts.insert(texts.end(), more.begin(), more.end());
  };
  command.add_option_function<std::vector<std::string>>("--set", add, description)
      ->check(check, "")
      ->type_name("/POINTER=VALUE")
      ->allow_extra_args(false);
}

void add_scene_options(CLI::App& command, SceneOptions& options) {
  command.add_option("scene", options.file, "The scene file (JSON)")
      ->required()
      ->type_name("FILE")
      ->check(named(), "");
  add_override_option(command, options.overrides,
                      "Override a value: --set /simulator/sleeping=false (repeatable)");
  add_whole_number(
      command, "--seed", {},
      [&options](uint64_t seed) {
        const std::string number = std::to_string(seed);
        options.overrides.add("/seed=" + number, "--seed", number);
      },
      "Seed of every random choice; the same as --set /seed=N");
}

void check_picture_overrides(const std::vector<std::string>& overrides) {
  for (const std::string& argument : overrides) {
    const bool has_effect =
        std::ranges::any_of(std::array{"/camera", "/cameras", "/render"}, [&](auto place) {
          return argument.starts_with(std::string(place) + "/") ||
                 argument.starts_with(std::string(place) + "=");
        });
    if (has_effect) continue;
    throw CLI::ValidationError("--set", "'" + argument + "' has no effect on pictures; expected " +
                                            "/camera, /cameras or /render, or a value in them");
  }
}

void add_run_options(CLI::App& command, RunOptions& options) {
  add_choice<ProgressMode>(command, "--progress",
                           {{"auto", ProgressMode::automatic},
                            {"bar", ProgressMode::bar},
                            {"json", ProgressMode::json},
                            {"none", ProgressMode::none}},
                           options.progress,
                           "auto (default: a bar where stderr is a terminal), bar, json or none");
  command.add_flag("--quiet,-q", options.quiet, "Print nothing but errors");
  command.add_flag("--force", options.force, "Replace output that exists");
  add_whole_number(
      command, "--threads", {1, 1024},
      [](uint64_t threads) { set_thread_count(static_cast<int>(threads)); },
      "Threads to use; the results do not depend on it; default: as many as "
      "the machine runs at once");
}

CLI::Option* add_resume_options(CLI::App& command, ResumeOptions& options) {
  add_real_number(
      command, "--checkpoint", {},
      [&options](double period_s) { options.checkpoint_period_s = period_s; },
      "Wall time between two checkpoints for --resume, s (default: 5); they take at most 2 % of "
      "the "
      "time. 0: one after each frame, whatever it takes");
  return command
      .add_flag("--resume", options.resume,
                "Go on where the run in the output directory was interrupted or killed, or begin "
                "if there is none. The result has the same bytes as without interruption")
      ->excludes(command.get_option("--force"));
}

std::vector<QualityGate> ReportOptions::gates() const {
  return fail_on ? parse_quality_gates(*fail_on) : std::vector<QualityGate>{};
}

void add_report_options(CLI::App& command, ReportOptions& options) {
  command
      .add_option("--fail-on", options.fail_on,
                  "Exit with 5 if one of these is true at the end: penetration>LENGTH (in "
                  "diameters, 0.02D, or metres, 0.004m), unsettled>N, escaped>N, floating>N, and "
                  "with a guide's mesh empty>SHARE, outside>SHARE; several with commas")
      ->type_name("GATES");
  add_whole_number(
      command, "--inspect-every", {1, uint64_t{1} << 32},
      [&options](uint64_t n) { options.inspect_every = n; },
      "Judge the pile in every N-th frame, not only at the end: quality_of_run in report.json");
  command.add_flag("--no-picture", options.no_picture, "Write report.html without its picture");
}

std::array<int, 2> parse_pair(const std::string& text, const std::string& option,
                              const std::string& example) {
  std::string_view rest = text;
  const std::optional<uint64_t> first = take_whole_number(rest);
  const bool has_cross = first && rest.starts_with('x');
  if (has_cross) rest.remove_prefix(1);
  const std::optional<uint64_t> second = has_cross ? take_whole_number(rest) : std::nullopt;
  constexpr uint64_t kMost = 999'999;
  const auto fits = [](uint64_t number) { return number >= 1 && number <= kMost; };
  if (!second || !rest.empty() || !fits(*first) || !fits(*second)) {
    throw CLI::ValidationError(
        option,
        "'" + text + "' is not two integers above 0 with an x between them, such as " + example);
  }
  return {static_cast<int>(*first), static_cast<int>(*second)};
}

}  // namespace pilesim

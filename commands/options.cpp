#include "options.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <map>

#include "core/parallel_for.h"

namespace pilesim {

void add_override_option(CLI::App& command, std::vector<std::string>& overrides,
                         const std::string& description) {
  const auto check = [](const std::string& argument) -> std::string {
    if (argument.starts_with('/') && argument.find('=') != argument.npos) return {};
    return "'" + argument + "' is not /POINTER=VALUE; write for example /simulator/sleeping=false";
  };
  // Added to what other options put there, whatever their order.
  const auto add = [&overrides](const std::vector<std::string>& more) {
    overrides.insert(overrides.end(), more.begin(), more.end());
  };
  command.add_option_function<std::vector<std::string>>("--set", add, description)
      ->check(check, "")
      ->type_name("/POINTER=VALUE")
      ->allow_extra_args(false);
}

void add_scene_options(CLI::App& command, SceneOptions& options) {
  command.add_option("scene", options.file, "The scene file (JSON)")->required();
  add_override_option(command, options.overrides,
                      "Override a value: --set /simulator/sleeping=false (repeatable)");
  command.add_option_function<uint64_t>(
      "--seed",
      [&options](uint64_t seed) { options.overrides.push_back("/seed=" + std::to_string(seed)); },
      "Seed of every random choice; the same as --set /seed=N");
}

void check_picture_overrides(const std::vector<std::string>& overrides) {
  for (const std::string& argument : overrides) {
    const bool has_effect = std::ranges::any_of(std::array{"/camera", "/render"}, [&](auto place) {
      return argument.starts_with(std::string(place) + "/") ||
             argument.starts_with(std::string(place) + "=");
    });
    if (has_effect) continue;
    throw CLI::ValidationError("--set", "'" + argument + "' has no effect on pictures; expected " +
                                            "/camera or /render, or a value in them");
  }
}

void add_run_options(CLI::App& command, RunOptions& options) {
  static const std::map<std::string, ProgressMode> kModes = {{"auto", ProgressMode::automatic},
                                                             {"bar", ProgressMode::bar},
                                                             {"json", ProgressMode::json},
                                                             {"none", ProgressMode::none}};
  command
      .add_option("--progress", options.progress,
                  "auto (a bar where stderr is a terminal), bar, json or none")
      ->transform(CLI::CheckedTransformer(kModes))
      ->type_name("MODE")
      ->default_str("auto");
  command.add_flag("--quiet,-q", options.quiet, "Print nothing but errors");
  command.add_flag("--force", options.force, "Replace output that is there already");
  command
      .add_option_function<int>(
          "--threads", [](int threads) { set_thread_count(threads); },
          "Threads to use; the results do not depend on it (default: all " +
              std::to_string(available_threads()) + ")")
      ->check(CLI::Range(1, 1024))
      ->type_name("N");
}

std::array<int, 2> parse_pair(const std::string& text, const std::string& option) {
  std::array<int, 2> pair{};
  int length = 0;
  if (std::sscanf(text.c_str(), "%6dx%6d%n", &pair[0], &pair[1], &length) != 2 ||
      static_cast<size_t>(length) != text.size() || pair[0] < 1 || pair[1] < 1) {
    throw CLI::ValidationError(option, "'" + text + "' is not two numbers such as 4x3");
  }
  return pair;
}

}  // namespace pilesim

// Options that several subcommands share, so that one name means one thing everywhere.
#pragma once

#include <CLI/CLI.hpp>
#include <array>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/error.h"
#include "core/progress.h"
#include "report/quality_gate.h"

namespace pilesim {

// A check for options that take a path: refuses an empty one.
std::function<std::string(const std::string&)> named();

// `name` is one long option whose value is one of `words`; `take` gets its index. `description`
// explains them. Numbers are no words.
CLI::Option* add_word(CLI::App& command, const std::string& name, std::vector<std::string> words,
                      std::function<void(size_t)> take, const std::string& description);

// The same where each word stands for a value, which `value` gets.
template <class Value, class Place>
CLI::Option* add_choice(CLI::App& command, const std::string& name,
                        std::vector<std::pair<std::string, Value>> choices, Place& value,
                        const std::string& description) {
  std::vector<std::string> words;
  for (const auto& choice : choices) words.push_back(choice.first);
  const auto take = [choices = std::move(choices), &value](size_t i) { value = choices[i].second; };
  return add_word(command, name, std::move(words), take, description);
}

// Values of a scene that the command line sets.
struct Overrides {
  std::vector<std::string> texts;               // "/POINTER=VALUE"
  std::map<std::string, std::string> given_as;  // text -> "--size 64x48", where it was no --set

  // `option` with `value` is short for --set `text`.
  void add(const std::string& text, const std::string& option, const std::string& value);
};

// --set, whose form is checked while parsing.
void add_override_option(CLI::App& command, Overrides& overrides, const std::string& description);

// Does `work`. Its errors name the option instead of the --set that the option stands for.
void with_options_named(const Overrides& overrides, const std::function<void()>& work);

// Throws CLI::ValidationError for values of --set other than those of the camera or of render: the
// simulation has used the others.
void check_picture_overrides(const std::vector<std::string>& overrides);

struct SceneOptions {
  std::string file;
  Overrides overrides;
};
void add_scene_options(CLI::App& command, SceneOptions& options);

struct RunOptions {
  ProgressMode progress = ProgressMode::automatic;
  bool quiet = false;
  bool force = false;
};
// --progress, --quiet, --force and --threads, which takes effect while parsing.
void add_run_options(CLI::App& command, RunOptions& options);

// Work that may be interrupted and gone on with.
struct ResumeOptions {
  bool resume = false;
  double checkpoint_period_s = 5;
};
// --resume, which excludes --force, and --checkpoint. After add_run_options().
CLI::Option* add_resume_options(CLI::App& command, ResumeOptions& options);

// How a pile is judged and shown at the end.
struct ReportOptions {
  std::optional<std::string> fail_on;
  uint64_t inspect_every = 0;
  bool no_picture = false;

  std::vector<QualityGate> gates() const;  // throws as parse_quality_gates()
};
// --fail-on, --inspect-every and --no-picture, for commands that end with a pile.
void add_report_options(CLI::App& command, ReportOptions& options);

// One function a subcommand: it adds itself to `app` with a callback that does the work.
void add_schema_command(CLI::App& app);
void add_validate_command(CLI::App& app);
void add_simulate_command(CLI::App& app);
void add_direct_pile_command(CLI::App& app);
void add_render_command(CLI::App& app);
void add_export_command(CLI::App& app);
void add_view_command(CLI::App& app);
void add_presets_command(CLI::App& app);
// Not for users: the help of the options of `app`, for man, shells and the docs.
void add_reference_command(CLI::App& app);
void add_sample_signature_command(CLI::App& app);
void add_fit_bspline_command(CLI::App& app);
void add_inspect_command(CLI::App& app);
void add_compare_command(CLI::App& app);
void add_finish_command(CLI::App& app);
void add_batch_command(CLI::App& app);
void add_new_command(CLI::App& app);
void add_reproduce_command(CLI::App& app);

// "4x3" as two numbers from 1 to 999,999. Throws CLI::ValidationError, which shows the example.
std::array<int, 2> parse_pair(const std::string& text, const std::string& option,
                              const std::string& example);

}  // namespace pilesim

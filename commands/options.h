// Options that several subcommands share, so that one name means one thing everywhere.
#pragma once

#include <CLI/CLI.hpp>
#include <array>
#include <functional>
#include <string>
#include <vector>

#include "core/progress.h"

namespace pilesim {

// A check for options that take a path: refuses an empty one.
std::function<std::string(const std::string&)> named();

// --set, whose form is checked while parsing.
void add_override_option(CLI::App& command, std::vector<std::string>& overrides,
                         const std::string& description);

// Of --set: throws CLI::ValidationError for all but values of the camera or of render; what else a
// scene says was used up by the simulation.
void check_picture_overrides(const std::vector<std::string>& overrides);

struct SceneOptions {
  std::string file;
  std::vector<std::string> overrides;  // --set, and --seed as one more
};
void add_scene_options(CLI::App& command, SceneOptions& options);

struct RunOptions {
  ProgressMode progress = ProgressMode::automatic;
  bool quiet = false;
  bool force = false;
};
// --progress, --quiet, --force and --threads, which takes effect while parsing.
void add_run_options(CLI::App& command, RunOptions& options);

// One function a subcommand: it adds itself to `app` with a callback that does the work.
void add_schema_command(CLI::App& app);
void add_validate_command(CLI::App& app);
void add_simulate_command(CLI::App& app);
void add_direct_pile_command(CLI::App& app);
void add_render_command(CLI::App& app);
void add_sample_signature_command(CLI::App& app);
void add_fit_bspline_command(CLI::App& app);
void add_inspect_command(CLI::App& app);
void add_compare_command(CLI::App& app);

// "4x3" as two numbers from 1 to 999,999. Throws CLI::ValidationError.
std::array<int, 2> parse_pair(const std::string& text, const std::string& option);

}  // namespace pilesim

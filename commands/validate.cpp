#include <memory>
#include <string>

#include "core/counted.h"
#include "core/naming.h"
#include "model/model.h"
#include "options.h"
#include "print.h"
#include "scene/scene_loader.h"
#include "simulate/modes/make_simulator.h"
#include "simulate/simulator.h"

namespace pilesim {

void add_validate_command(CLI::App& app) {
  struct Options {
    SceneOptions scene;
    bool print_config = false;
  };
  auto options = std::make_shared<Options>();
  CLI::App* command = app.add_subcommand(
      "validate", "Check a scene and its meshes, reporting all problems of the scene at once");
  add_scene_options(*command, options->scene);
  command->add_flag("--print-config", options->print_config,
                    "Print the scene with every default written out and every --set applied");
  command->footer(R"(
Examples:
  pilesim validate scene.json
  pilesim validate scene.json --set /duration_s=10 --print-config > resolved.json)");
  const auto validate = [options] {
    const LoadedScene loaded = load_scene(options->scene.file, options->scene.overrides.texts);
    if (options->print_config) {
      print("%s\n", loaded.resolved.c_str());
      return;
    }
    const Model model = naming(options->scene.file, [&] { return build_model(loaded.scene); });
    // What only the mode can tell: signatures that are missing or of another body, hinges.
    const auto simulator =
        naming(options->scene.file, [&] { return make_simulator(loaded.scene, model); });
    size_t dynamic = 0;
    for (const ModelBody& body : model.bodies) dynamic += body.role == Role::dynamic ? 1 : 0;
    // How many a guide takes only its filling tells.
    print_line(options->scene.file + ": valid; " + (model.guide_fill ? "at most " : "") +
               counted(model.bodies.size(), "body", "bodies") + " (" + std::to_string(dynamic) +
               " dynamic), " + counted(static_cast<uint64_t>(loaded.scene.frame_count()), "frame"));
    for (const ModelShape& shape : model.shapes) {
      if (!shape.collision_report.empty()) {
        print_line("  " + shape.name + ": " + shape.collision_report);
      }
    }
    for (const std::string& line : simulator->signatures()) print_line("  " + line);
  };
  command->callback(
      [options, validate] { with_options_named(options->scene.overrides, validate); });
}

}  // namespace pilesim

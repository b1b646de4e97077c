#include <cstdio>
#include <memory>
#include <string>

#include "model/model.h"
#include "options.h"
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
  command->callback([options] {
    const LoadedScene loaded = load_scene(options->scene.file, options->scene.overrides);
    if (options->print_config) {
      std::puts(loaded.resolved.c_str());
      return;
    }
    const Model model = build_model(loaded.scene);
    // What only the mode can tell: signatures that are missing or of another body, hinges.
    const auto simulator = make_simulator(loaded.scene, model);
    size_t dynamic = 0;
    for (const ModelBody& body : model.bodies) dynamic += body.role == Role::dynamic ? 1 : 0;
    // How many a guide takes only its filling tells.
    std::printf("%s: valid; %s%zu bodies (%zu dynamic), %d frames\n", options->scene.file.c_str(),
                model.guide_fill ? "at most " : "", model.bodies.size(), dynamic,
                loaded.scene.frame_count());
    for (const ModelShape& shape : model.shapes) {
      if (!shape.collision_report.empty()) {
        std::printf("  %s: %s\n", shape.name.c_str(), shape.collision_report.c_str());
      }
    }
    for (const std::string& line : simulator->signatures()) std::printf("  %s\n", line.c_str());
  });
}

}  // namespace pilesim

#include <cstdio>

#include "options.h"
#include "scene/scene_loader.h"

namespace pilesim {

void add_schema_command(CLI::App& app) {
  CLI::App* command = app.add_subcommand("schema", "Print the JSON Schema of scene files");
  command->footer(R"(
Example, to let an editor check and complete a scene while it is written:
  pilesim schema > scene.schema.json      and in the scene: "$schema": "scene.schema.json")");
  command->callback([] { std::puts(scene_schema().c_str()); });
}

}  // namespace pilesim

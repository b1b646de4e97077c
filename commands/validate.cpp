#include <algorithm>
#include <limits>
#include <memory>
#include <string>

#include "core/counted.h"
#include "core/naming.h"
#include "core/text.h"
#include "job/measured_signatures.h"
#include "model/clear_starts.h"
#include "model/mesh_hints.h"
#include "model/model.h"
#include "options.h"
#include "pile/guide/empty_parts.h"
#include "print.h"
#include "scene/scene_hints.h"
#include "scene/scene_loader.h"
#include "simulate/modes/make_simulator.h"
#include "simulate/simulator.h"

namespace pilesim {

namespace {

// "0.4 x 0.3 x 0.2 m, 120 bodies of 5.6 kg, 1 static; ": of the shape with this index.
std::string measures(const Model& model, size_t index) {
  const ModelShape& shape = model.shapes[index];
  if (shape.is_plane) return "";
  const Vec3 sides = shape.mesh.bounds().sizes();
  std::string text = with_digits(sides.x(), 3) + " x " + with_digits(sides.y(), 3) + " x " +
                     with_digits(sides.z(), 3) + " m";
  size_t moving = 0, standing = 0, kinematic = 0;
  double least_kg = std::numeric_limits<double>::infinity(), most_kg = 0;
  for (const ModelBody& body : model.bodies) {
    if (body.shape != index) continue;
    if (body.role != Role::dynamic) {
      ++(body.role == Role::fixed ? standing : kinematic);
      continue;
    }
    ++moving;
    least_kg = std::min(least_kg, body.mass_kg);
    most_kg = std::max(most_kg, body.mass_kg);
  }
  if (moving > 0) {
    text += ", " + counted(moving, "body", "bodies") + " of " +
            (least_kg < most_kg ? with_digits(least_kg, 3) + " to " : std::string()) +
            with_digits(most_kg, 3) + " kg";
  }
  if (standing > 0) text += ", " + std::to_string(standing) + " static";
  if (kinematic > 0) text += ", " + std::to_string(kinematic) + " kinematic";
  return text + "; ";
}

}  // namespace

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
    Model model = naming(options->scene.file, [&] { return build_model(loaded.scene); });
    // Checks of the mode: signatures that are missing or of another body, hinges.
    const auto simulator = naming(options->scene.file, [&] {
      find_signatures(loaded.scene, model);
      return make_simulator(loaded.scene, model);
    });
    const auto count_of = [&](Role role) {
      return static_cast<uint64_t>(std::ranges::count(model.bodies, role, &ModelBody::role));
    };
    // Only the run tells how many a guide takes, and when emitters stop.
    print_line(
        options->scene.file + ": valid; " +
        (model.guide_fill || !model.stops.empty() ? "at most " : "") +
        counted_bodies(count_of(Role::dynamic), count_of(Role::fixed), count_of(Role::kinematic)) +
        ", " + counted(static_cast<uint64_t>(loaded.scene.frame_count()), "frame"));
    for (size_t i = 0; i < model.shapes.size(); ++i) {
      const ModelShape& shape = model.shapes[i];
      if (shape.collision_report.empty()) continue;
      print_line("  " + shape.name + ": " + measures(model, i) + shape.collision_report);
    }
    if (!model.guide_report.empty()) {
      print_line("  " + model.guide_report +
                 (model.guide_fill && model.guide_fill->is_mould ? "; filled as a mould" : ""));
    }
    for (const std::string& line : simulator->signatures()) print_line("  " + line);
    for (const std::string& line : describe_moved_starts(model)) print_line("  " + line);
    for (const std::string& line : describe_unlikely_meshes(loaded.scene, model)) warn(line);
    for (const std::string& line : scene_hints(loaded.scene)) warn(line);
    for (const std::string& line : describe_start_overlaps(model)) warn(line);
    for (const EmptyPart& part : too_narrow_parts(loaded.scene, model).parts) {
      warn("guide: " + describe(part));
    }
  };
  command->callback(
      [options, validate] { with_options_named(options->scene.overrides, validate); });
}

}  // namespace pilesim

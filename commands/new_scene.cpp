#include "job/new_scene.h"

#include <memory>
#include <string>

#include "core/printable.h"
#include "numbers.h"
#include "options.h"
#include "print.h"

namespace pilesim {

void add_new_command(CLI::App& app) {
  struct Options {
    NewSceneJob job;
    std::string kind, mesh, output = "scene.json";
    bool quiet = false;
  };
  static const std::vector<std::pair<std::string, NewSceneKind>> kKinds = {
      {"pile", NewSceneKind::pile},
      {"bin", NewSceneKind::bin},
      {"guide", NewSceneKind::guide},
      {"dataset", NewSceneKind::dataset}};
  auto options = std::make_shared<Options>();
  CLI::App* command =
      app.add_subcommand("new", "Write a scene to start from, sized to a mesh, that runs as it is");
  command
      ->add_option("kind", options->kind,
                   "pile: poured in a heap; bin: poured into a bin; guide: a cone that keeps its "
                   "shape, for direct-pile; dataset: a bin that differs with each seed")
      ->required()
      ->type_name("pile|bin|guide|dataset");
  command->add_option("mesh", options->mesh, "The mesh of a body (obj, stl, ply, glb, ...)")
      ->required()
      ->type_name("MESH")
      ->check(named(), "");
  command->add_option("-o,--output", options->output, "The scene file (default: scene.json)")
      ->type_name("FILE")
      ->check(named(), "");
  add_whole_number(
      *command, "--count", {1, 100'000},
      [options](uint64_t count) { options->job.count = static_cast<int>(count); },
      "Number of bodies (default: 120 of a pile, else 60); in a guide about this number, and "
      "enough to make it three bodies wide");
  add_real_number(
      *command, "--scale", {.least = 0, .excludes_least = true},
      [options](double scale) { options->job.scale = scale; },
      "Metres per unit of the mesh: 0.01 for centimetres (default: 1)");
  add_choice<bool>(*command, "--up", {{"y", false}, {"z", true}}, options->job.is_z_up,
                   "The mesh's axis that points up: y (default), or z, as in most STL files");
  command->add_flag("--quiet,-q", options->quiet, "Print nothing but errors");
  command->add_flag("--force", options->job.force, "Replace a scene that exists");
  command->footer(R"(
Examples:
  pilesim new pile mug.obj && pilesim simulate scene.json -o out
  pilesim new bin bolt.stl --scale 0.001 --up z --count 300 -o bolts.json
  pilesim new guide brick.obj -o tower.json && pilesim direct-pile tower.json -o out
  pilesim new dataset part.glb -o part.json && pilesim simulate part.json -o out/7 --seed 7)");
  command->callback([options] {
    const auto found =
        std::ranges::find(kKinds, options->kind, &std::pair<std::string, NewSceneKind>::first);
    if (found == kKinds.end()) {
      throw CLI::ValidationError("kind",
                                 "'" + options->kind + "' is not one of pile, bin, guide, dataset");
    }
    options->job.kind = found->second;
    options->job.mesh = options->mesh;
    options->job.output = options->output;
    const NewSceneSummary summary = write_new_scene(options->job);
    if (options->quiet) return;
    print("%s: a body is %.3g m across%s\n", options->output.c_str(), summary.diameter_m,
          summary.questions.empty() ? "; if it should not be, say --scale" : "");
    for (const std::string& question : summary.questions) print_line(question);
    if (summary.guided > 0) print("about %d of them fill the guide\n", summary.guided);
    const bool directed = options->job.kind == NewSceneKind::guide;
    print("next: pilesim %s %s -o out && pilesim render out\n",
          directed ? "direct-pile" : "simulate", shell_word(options->output).c_str());
  });
}

}  // namespace pilesim

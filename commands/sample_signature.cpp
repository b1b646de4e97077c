#include <filesystem>
#include <functional>
#include <memory>

#include "core/clock.h"
#include "core/output_directory.h"
#include "core/temporary_file.h"
#include "core/text.h"
#include "job/rest_drops.h"
#include "job/signature_source.h"
#include "numbers.h"
#include "options.h"
#include "packing/packing_measurement.h"
#include "print.h"
#include "signature/signature_file.h"
#include "signature/signature_sampling.h"
#include "signature/signature_summary.h"
#include "signature_warnings.h"

namespace pilesim {
namespace {

struct SampleSignatureArguments {
  SignatureOptions sampling;
  RunOptions run;
  std::string mesh;
  std::string scene, shape;  // in place of the mesh
  std::string output;
  std::string collisions;        // to read
  std::string write_collisions;  // to write
  bool micro = false;
  bool no_accuracy = false;
  int trials = 0;      // 0: the layout's own
  int exemplars = -1;  // -1: the layout's own
  uint32_t rest_drops = 0;
  uint32_t pours = PackingSettings{}.pours;
};

// "60, or 30 in the dissertation's layout".
std::string defaults(uint32_t TableSampling::*number) {
  return std::to_string(default_sampling(TableLayout::scale_free).*number) + ", or " +
         std::to_string(default_sampling(TableLayout::dissertation).*number) +
         " in the dissertation's layout";
}

std::vector<ObservedRest> drop(const SampleSignatureArguments& options, const TriangleMesh& mesh) {
  const SignatureOptions& s = options.sampling;
  RestDrops drops = drop_to_rest(mesh, {.drops = options.rest_drops,
                                        .material = s.material,
                                        .seed = s.seed,
                                        .progress = s.progress});
  if (drops.unsettled > 0) {
    warn(std::to_string(drops.unsettled) + " of " + std::to_string(options.rest_drops) +
         " drops did not come to rest and do not count");
  }
  return std::move(drops.rests);
}

// Errors of meshes that enclose nothing name keys of a scene: without one they are options.
SignatureRun with_solid_options_named(const std::function<SignatureRun()>& work) {
  try {
    return work();
  } catch (const Error& error) {
    std::vector<Problem> problems = error.problems();
    for (Problem& problem : problems) {
      const auto replace = [&](const std::string& key, const std::string& option) {
        const size_t at = problem.remedy.find(key);
        if (at != std::string::npos) problem.remedy.replace(at, key.size(), option);
      };
      replace("(\"thickness_m\")", "(--thickness)");
      replace("\"solid\": \"hull\"", "--solid hull");
      replace("\"solid\": \"wrap\"", "--solid wrap");
      replace("leave \"solid\" at \"auto\"", "leave --solid at auto");
    }
    throw Error(error.kind(), std::move(problems));
  }
}

void sample(SampleSignatureArguments& options) {
  if (std::filesystem::path(options.mesh).extension() == ".json") {
    refuse_scene_as_mesh(options.mesh, options.output);
  }
  const std::filesystem::path output = options.output;
  claim_output_file(output, options.run.force);
  if (!options.write_collisions.empty()) {
    claim_output_file(options.write_collisions, options.run.force);
  }
  SignatureOptions& s = options.sampling;
  const double target_error = s.sampling.target_error;
  if (options.scene.empty()) {
    s.mesh = options.mesh;
  } else {
    take_from_scene(options.scene, options.shape, s);
  }
  s.kind = options.micro ? TrialKind::micro : TrialKind::macro;
  s.sampling = default_sampling(s.layout);
  s.sampling.target_error = target_error;
  if (options.trials > 0) s.sampling.trials_per_cell = static_cast<uint32_t>(options.trials);
  if (options.exemplars >= 0) s.sampling.exemplars = static_cast<uint32_t>(options.exemplars);
  if (options.no_accuracy) s.accuracy.reset();
  s.collisions = options.collisions;
  s.keep_collisions = !options.write_collisions.empty();
  s.partial_file = options.output + ".partial";
  s.discard_partial = options.run.force;
  s.progress = options.run.quiet ? ProgressMode::none : options.run.progress;
  if (options.rest_drops > 0) {
    s.drop_to_rest = [&](const TriangleMesh& mesh) { return drop(options, mesh); };
  }
  const auto work = [&] { return sample_signature(s); };
  SignatureRun run = options.scene.empty() ? with_solid_options_named(work) : work();
  const Stopwatch watch;
  if (options.pours > 0) {
    run.signature.packing =
        measure_packing(poured_object(s, run.signature), run.signature,
                        {.pours = options.pours, .seed = s.seed, .progress = s.progress});
  }
  const double pours_s = watch.seconds();
  if (s.keep_collisions) write_collisions(run.collisions, options.write_collisions);
  write_signature(run.signature, output);
  remove_in_one_go(s.partial_file);
  warn_of_signature(run);
  if (options.run.quiet) return;
  print(
      "%s: %.2f MB; sampled in %.2f s, accuracy measured in %.2f s, dropped in %.2f s, "
      "poured in %.2f s\n",
      options.output.c_str(), static_cast<double>(std::filesystem::file_size(output)) / 1e6,
      run.sampling_s, run.accuracy_s, run.drops_s, pours_s);
  if (!run.solid.empty()) print("solid: %s\n", run.solid.c_str());
  print("%s", summary_text(run.signature).c_str());
}

}  // namespace

void add_sample_signature_command(CLI::App& app) {
  auto options = std::make_shared<SampleSignatureArguments>();
  SignatureOptions& s = options->sampling;
  CLI::App* command = app.add_subcommand(
      "sample-signature", "Measure how an object collides, for statistical simulation");
  CLI::Option* mesh =
      command
          ->add_option("mesh", options->mesh,
                       "The object: a mesh (obj, stl, ply, glb, ...); made solid where it is open")
          ->type_name("MESH")
          ->check(named(), "");
  CLI::Option* scene =
      command
          ->add_option("--scene", options->scene,
                       "Take the mesh, its scale, its upward axis, how it becomes solid, and its "
                       "material from this scene")
          ->type_name("SCENE")
          ->check(named(), "")
          ->excludes(mesh);
  command
      ->add_option("--shape", options->shape,
                   "With --scene: the name of the shape; needed where several meshes move there")
      ->type_name("NAME")
      ->check(named(), "")
      ->needs(scene);
  command->add_option("-o,--output", options->output, "The signature to write, NAME.sig")
      ->required()
      ->type_name("FILE.sig");
  add_choice<TableLayout>(
      *command, "--layout",
      {{"scale-free", TableLayout::scale_free}, {"dissertation", TableLayout::dissertation}},
      s.layout, "scale-free (default) or dissertation");
  command->add_flag("--micro", options->micro,
                    "One impact a trial, instead of all impacts until the body leaves the plane");
  add_real_number(
      *command, "--restitution", {0, 1}, [&s](double e) { s.material.restitution = e; },
      "Restitution of the object against the plane; default " +
          with_digits(s.material.restitution, 6));
  add_real_number(
      *command, "--friction", {}, [&s](double mu) { s.material.friction = mu; },
      "Friction of the object against the plane; default " + with_digits(s.material.friction, 6));
  add_real_number(
      *command, "--restitution-threshold", {},
      [&s](double speed) { s.material.restitution_threshold_m_s = speed; },
      "Contacts slower than this, m/s, do not bounce; dissertation layout only; default 0");
  add_real_number(
      *command, "--scale", {.excludes_least = true}, [&s](double scale) { s.scale = scale; },
      "Metres per unit of the mesh file; default 1");
  add_choice<bool>(*command, "--up", {{"y", false}, {"z", true}}, s.is_z_up,
                   "The mesh's axis that points up: y (default), or z, as in most STL files");
  add_choice<SolidRule>(*command, "--solid",
                        {{"auto", SolidRule::automatic},
                         {"exact", SolidRule::exact},
                         {"wrap", SolidRule::wrap},
                         {"hull", SolidRule::hull}},
                        s.solid.rule,
                        "How a mesh that is no solid becomes one: auto (default), exact, wrap or "
                        "hull, as in a scene");
  add_real_number(
      *command, "--thickness", {.excludes_least = true},
      [&s](double thickness_m) { s.solid.thickness_m = thickness_m; },
      "Metres, of parts of the mesh that are sheets");
  for (const char* name :
       {"--scale", "--up", "--solid", "--thickness", "--restitution", "--friction"}) {
    command->get_option(name)->excludes(scene);
  }
  CLI::Option* collisions =
      command
          ->add_option("--collisions", options->collisions,
                       "Take the responses from these collisions, FILE.csv, measured or simulated, "
                       "instead of sampling them")
          ->type_name("FILE.csv")
          ->check(named(), "");
  command
      ->add_option("--write-collisions", options->write_collisions,
                   "Write the sampled collisions as such a file, too; scale-free layout only")
      ->type_name("FILE.csv")
      ->check(named(), "")
      ->excludes(collisions);
  CLI::Option* per_cell = add_whole_number(
      *command, "--trials", {2, 1'000'000},
      [options](uint64_t trials) { options->trials = static_cast<int>(trials); },
      "Trials a cell of the table; default " + defaults(&TableSampling::trials_per_cell));
  CLI::Option* target = add_real_number(
      *command, "--target-error", {.excludes_least = true},
      [&s](double error) { s.sampling.target_error = error; },
      "Sample until no cell's mean has a larger standard error, in units of the speed before the "
      "collision");
  for (CLI::Option* option : {per_cell, target}) option->excludes(collisions);
  add_whole_number(
      *command, "--exemplars", {0, 1000},
      [options](uint64_t kept) { options->exemplars = static_cast<int>(kept); },
      "Whole responses that each cell keeps, best for long bodies; default " +
          defaults(&TableSampling::exemplars));
  add_whole_number(
      *command, "--rest-drops", {0, 1'000'000},
      [options](uint64_t drops) { options->rest_drops = static_cast<uint32_t>(drops); },
      "Drops of the object in a simulation, to find its rest poses; the dissertation has 100");
  add_whole_number(
      *command, "--pours", {0, 1000},
      [options](uint64_t pours) { options->pours = static_cast<uint32_t>(pours); },
      "Pour the object so often in a simulation to find how it packs; default " +
          std::to_string(options->pours) + "; with 0 no simulation takes the signature");
  command->add_flag("--no-accuracy", options->no_accuracy, "Omit the accuracy report");
  add_whole_number(
      *command, "--seed", {}, [&s](uint64_t seed) { s.seed = seed; },
      "Seed of every random choice; default " + std::to_string(s.seed));
  add_run_options(*command, options->run);
  command->footer(R"(
Examples:
  pilesim sample-signature assets/ring.obj -o ring.sig
  pilesim sample-signature rabbit.obj -o rabbit.sig --restitution 0.5 --target-error 0.01
  pilesim sample-signature ring.obj --collisions drops.csv -o measured.sig
  pilesim sample-signature --scene presets/statistical/rabbits_100.json --shape rabbit -o rabbit.sig
  pilesim inspect ring.sig --plot ring-pictures

Ctrl-C keeps the trials so far in NAME.sig.partial; the same command goes on from there, and
repeats drops and pours.)");
  command->callback([options] {
    if (options->mesh.empty() && options->scene.empty()) {
      throw CLI::RequiredError("mesh, or --scene with --shape");
    }
    sample(*options);
  });
}

}  // namespace pilesim

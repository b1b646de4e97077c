#include "signature/signature_sampling.h"

#include <cmath>

#include "core/clock.h"
#include "core/error.h"
#include "core/hash.h"
#include "core/interrupt.h"
#include "core/naming.h"
#include "geometry/mass_properties.h"
#include "geometry/mesh_import.h"
#include "signature/measured_collisions.h"
#include "signature/rest/known_rest_poses.h"
#include "signature/sampled_mesh.h"
#include "signature/signature_file.h"

namespace pilesim {
namespace {

// A killed run loses at most this much work.
constexpr double kCheckpoint_s = 10;

void check_options(const SignatureOptions& options) {
  const auto refuse = [](const std::string& found, const std::string& expected,
                         const std::string& remedy = {}) {
    throw Error(ErrorKind::usage, {.found = found, .expected = expected, .remedy = remedy});
  };
  check_material(options.material);
  if (!(options.scale > 0) || !std::isfinite(options.scale)) {
    refuse("scale is " + std::to_string(options.scale), "a number above 0");
  }
  const TableSampling& sampling = options.sampling;
  if (sampling.trials_per_cell < 2 || sampling.trials_per_cell > 1000000) {
    refuse(std::to_string(sampling.trials_per_cell) + " trials a cell", "2 to 1000000");
  }
  if (!(sampling.target_error >= 0)) {
    refuse("target error is " + std::to_string(sampling.target_error), "a number of at least 0");
  }
  if (options.layout == TableLayout::scale_free && !options.material.scale_free()) {
    refuse("the scale-free layout with a restitution that depends on speed",
           "a restitution threshold of 0",
           "Use --layout dissertation, which has the speed among its keys.");
  }
  if (options.layout == TableLayout::dissertation && options.keep_collisions) {
    refuse("collisions to write of the dissertation's layout",
           "the scale-free layout: the other keeps no azimuth of the spin");
  }
  if (options.layout == TableLayout::dissertation && sampling.exemplars > 0) {
    refuse("exemplars in the dissertation's layout", "none: it has means and deviations only");
  }
}

SignatureBody describe(const std::string& name, double scale, double volume_m3,
                       const ContactBody& body) {
  return {.mesh = name,
          .mesh_hash = body.mesh_hash,
          .scale = scale,
          .hull_vertices = static_cast<uint32_t>(body.vertex_count()),
          .volume_m3 = volume_m3,
          .centre_of_mass = body.centre_of_mass,
          .inertia_m2 = body.inertia_m2,
          .principal_axes = body.principal_axes,
          .gyration_m = body.gyration_m,
          .outer_radius_m = body.outer_radius_m};
}

// Identifies everything that the cells' values depend on.
std::string fingerprint(const SignatureOptions& options, const ContactBody& body,
                        const ResponseTable& table) {
  Hasher hasher;
  const std::string words = body.mesh_hash + layout_name(options.layout);
  hasher.add(std::as_bytes(std::span(words)));
  const ContactMaterial& m = options.material;
  const std::array numbers = {m.restitution, m.friction, m.restitution_threshold_m_s,
                              options.sampling.target_error, options.solid.thickness_m};
  hasher.add_values(std::span<const double>(numbers));
  const std::array<uint64_t, 7> counts = {static_cast<uint64_t>(kSignatureVersion),
                                          static_cast<uint64_t>(options.kind),
                                          options.seed,
                                          options.sampling.trials_per_cell,
                                          options.sampling.exemplars,
                                          static_cast<uint64_t>(options.solid.rule),
                                          static_cast<uint64_t>(options.solid.hull_max_vertices)};
  hasher.add_values(std::span<const uint64_t>(counts));
  for (const Axis& axis : table.axes) hasher.add_values(std::span<const float>(axis.nodes));
  return hasher.digest();
}

void take_up(const SignatureOptions& options, const std::string& print, TableSampler& sampler) {
  const std::filesystem::path& file = options.partial_file;
  if (options.discard_partial || file.empty() || !std::filesystem::exists(file)) return;
  PartialSampling partial = read_partial_sampling(file);
  if (partial.fingerprint != print ||
      partial.state.launched.size() != sampler.state().launched.size()) {
    throw Error(ErrorKind::usage,
                {.file = file.string(),
                 .found = "an interrupted run with other settings or another mesh",
                 .expected = "one to go on with",
                 .remedy = "Repeat its settings, remove the file, or start again with --force"});
  }
  sampler.restore(std::move(partial.state));
}

ResponseTable sample_responses(const SignatureOptions& options, const TrialSetup& setup,
                               SignatureRun& run) {
  const ResponseTable axes = make_table(options.layout, setup.body->gyration_m);
  TableSampler sampler(setup, axes, options.sampling);
  const std::string print = fingerprint(options, *setup.body, axes);
  take_up(options, print, sampler);

  // In per cent: the number of trials for a target error is unknown until it is reached.
  Progress progress(options.progress, options.stage, 100, "%");
  Stopwatch since_saved;
  const bool complete = sampler.run([&](uint64_t done, uint64_t expected) {
    progress.update(100 * done / std::max<uint64_t>(1, expected));
    const bool go_on = !interrupted();
    const bool save = !go_on || since_saved.seconds() > kCheckpoint_s;
    if (save && !options.partial_file.empty()) {
      write_partial_sampling({print, sampler.state()}, options.partial_file);
      since_saved.restart();
    }
    return go_on;
  });
  if (!complete) {
    throw Error(ErrorKind::interrupted,
                {.file = options.partial_file.string(),
                 .found = "interrupted; the measurements so far are kept there",
                 .remedy = "The same command goes on from it"});
  }
  // Drops, pours and accuracy take about as long again.
  if (!options.partial_file.empty()) {
    write_partial_sampling({print, sampler.state()}, options.partial_file);
  }
  if (options.keep_collisions) {
    run.collisions = collisions_of(sampler.state().responses, setup.body->gyration_m, axes);
  }
  return sampler.table();
}

ResponseTable measured_responses(const SignatureOptions& options, const TrialSetup& setup,
                                 const std::vector<PlaneCollision>& collisions) {
  const double k = setup.body->gyration_m;
  return naming(options.collisions.string(), [&] {
    return table_of(collisions, options.material, k, make_table(options.layout, k),
                    options.sampling.exemplars);
  });
}

AccuracyReport sample_accuracy(const SignatureOptions& options, const TrialSetup& setup,
                               const Signature& signature) {
  const ResponseTable& table = signature.responses;
  std::vector<ModelUnderTest> models = {{"particle", table, DrawModel::particle}};
  if (table.layout == TableLayout::dissertation) {
    models.push_back({"dissertation", table, DrawModel::diagonal});
  } else {
    models.push_back({"4 keys, diagonal", table, DrawModel::diagonal});
    models.push_back({"4 keys, full covariance", table, DrawModel::full});
  }
  if (table.exemplar_count > 0) {
    models.push_back({"4 keys, exemplars", table, DrawModel::exemplars});
  }
  return measure_accuracy(setup, signature.heights, models, *options.accuracy);
}

// `mesh` lies in the frame of body.principal_axes and body.centre_of_mass.
SignatureRun sample_body(const SignatureOptions& options, const TriangleMesh& mesh,
                         const ContactBody& body, SignatureBody described) {
  const TrialSetup setup{&body, options.material, options.kind, options.seed,
                         spin_measure(options.layout)};
  const uint32_t height_trials =
      options.layout == TableLayout::dissertation ? kDissertationHeightTrials : kHeightTrials;

  SignatureRun run;
  CollisionFile measured;
  std::optional<ResponseTable> responses;
  std::optional<CollisionSource> source;
  if (!options.collisions.empty()) {
    measured = read_collisions(options.collisions);
    responses = measured_responses(options, setup, measured.collisions);
    source = {.file = options.collisions.filename().string(), .count = measured.collisions.size()};
    run.ignored_columns = std::move(measured.ignored);
  }

  // From here on an interrupted run can save its work; before, Ctrl-C may simply kill it.
  install_interrupt_handler();
  Stopwatch watch;
  std::vector<ObservedRest> drops;
  if (options.drop_to_rest) drops = options.drop_to_rest(mesh);
  run.drops_s = watch.seconds();
  watch.restart();
  run.signature = {
      .body = std::move(described),
      .material = options.material,
      .kind = options.kind,
      .seed = options.seed,
      .sampling = options.sampling,
      .collisions = std::move(source),
      .heights = sample_collision_heights(setup, options.layout, height_trials),
      .responses = responses ? std::move(*responses) : sample_responses(options, setup, run),
      .rest_poses = known_rest_poses(mesh_rest_poses(mesh, body.centre_of_mass), drops),
      .rest_drops = static_cast<uint32_t>(drops.size())};
  run.sampling_s = watch.seconds();
  watch.restart();
  if (options.accuracy) run.signature.accuracy = sample_accuracy(options, setup, run.signature);
  run.accuracy_s = watch.seconds();
  return run;
}

}  // namespace

TableSampling default_sampling(TableLayout layout) {
  if (layout == TableLayout::dissertation) return {.trials_per_cell = 30};
  return {.trials_per_cell = 60, .exemplars = 60};
}

SignatureRun sample_signature(const SignatureOptions& options) {
  check_options(options);
  const std::string name = options.mesh.string();
  TriangleMesh given = import_mesh(options.mesh, options.scale);
  if (options.is_z_up) turn_z_up_to_y_up(given);
  std::string note;
  const TriangleMesh mesh =
      naming(name, [&] { return solid_to_sample(given, options.solid, &note); });
  ContactBody body = make_contact_body(mesh, name);
  body.mesh_hash = mesh_hash(given);  // scenes refer to the mesh by this hash
  SignatureRun run = sample_body(options, mesh, body,
                                 describe(options.mesh.filename().string(), options.scale,
                                          mass_properties(mesh).volume_m3, body));
  run.signature.body.solid = options.solid;
  run.solid = std::move(note);
  return run;
}

SignatureRun sample_signature(const SignatureOptions& options, const SampledObject& object) {
  check_options(options);
  const ContactBody body =
      make_contact_body(object.hull, object.mass.inertia_m5 / object.mass.volume_m3);
  return sample_body(options, object.hull, body,
                     describe(object.name, 1, object.mass.volume_m3, body));
}

}  // namespace pilesim

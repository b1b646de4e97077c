// Samples the signature of a mesh.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>

#include "core/progress.h"
#include "geometry/mass_properties.h"
#include "geometry/mesh.h"
#include "geometry/solid.h"
#include "signature/collision_file.h"
#include "signature/rest/known_rest_poses.h"
#include "signature/signature.h"

namespace pilesim {

struct SignatureOptions {
  std::filesystem::path mesh;
  double scale = 1;      // metres per unit of the mesh file
  bool is_z_up = false;  // up axis of the mesh file
  SolidOptions solid;    // how to turn a mesh that is not a solid into one
  ContactMaterial material;
  TableLayout layout = TableLayout::scale_free;
  TrialKind kind = TrialKind::macro;  // or micro
  uint64_t seed = 1;
  TableSampling sampling;
  // Take responses from this file (collision_file.h) instead of sampling them; everything else
  // still comes from the mesh. Empty: sample.
  std::filesystem::path collisions;
  bool keep_collisions = false;  // the sampled ones, in the scale-free layout
  std::optional<AccuracySettings> accuracy = AccuracySettings{};
  // Drops the checked mesh in a simulation (job/rest_drops.h; simulators lie above this folder).
  // Empty: rest poses are by geometry only.
  std::function<std::vector<ObservedRest>(const TriangleMesh&)> drop_to_rest;
  // Saved during sampling, and resumed if it belongs to the same measurement. The caller removes it
  // when the result is safe. Empty: nothing is saved.
  std::filesystem::path partial_file;
  bool discard_partial = false;  // start again even if it exists
  ProgressMode progress = ProgressMode::automatic;
  std::string stage = "sampling";  // label of the progress line
};

struct SignatureRun {
  Signature signature;
  std::vector<PlaneCollision> collisions;    // with keep_collisions
  std::vector<std::string> ignored_columns;  // of the CSV file of collisions
  std::string solid;      // how the mesh became a solid (geometry/solid.h); empty: unchanged
  double sampling_s = 0;  // wall time of the tables
  double accuracy_s = 0;  // of the accuracy report
  double drops_s = 0;     // of the drops
};

// An object without a mesh file of its own.
struct SampledObject {
  std::string name;     // for errors, and in the signature
  TriangleMesh hull;    // convex, m, about the centre of mass
  MassProperties mass;  // of unit density, about the centre of mass
};

// A layout's defaults: trials per cell (the dissertation's 30) and exemplars.
TableSampling default_sampling(TableLayout layout);

// Checks all options, then installs handlers for SIGINT, SIGTERM and SIGHUP and measures. Throws
// Error(usage) for settings that are out of range or contradict each other, Error(input) for a mesh
// that is not a solid, and Error(interrupted) after Ctrl-C, once the measurements are safe in
// `partial_file`.
SignatureRun sample_signature(const SignatureOptions& options);
// The same for an object; the options' mesh, scale, axis and solid are ignored.
SignatureRun sample_signature(const SignatureOptions& options, const SampledObject& object);

}  // namespace pilesim

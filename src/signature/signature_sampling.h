// From a mesh to its signature.
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
  bool is_z_up = false;  // the mesh file
  SolidOptions solid;    // how a mesh that is none becomes a solid
  ContactMaterial material;
  TableLayout layout = TableLayout::scale_free;
  TrialKind kind = TrialKind::macro;  // or micro
  uint64_t seed = 1;
  TableSampling sampling;
  // Instead of sampled ones, responses come from these (collision_file.h); the rest is of the mesh
  // as ever. Empty: none.
  std::filesystem::path collisions;
  bool keep_collisions = false;  // those that are sampled, in the scale-free layout
  std::optional<AccuracySettings> accuracy = AccuracySettings{};
  // Drops the checked mesh in a simulation (job/rest_drops.h: simulators lie above this folder).
  // Empty: rest poses are by geometry only.
  std::function<std::vector<ObservedRest>(const TriangleMesh&)> drop_to_rest;
  // Kept while sampling goes on and taken up again if it is there and belongs to the same
  // measurement; to be removed by the caller when the result is safe. Empty: nothing is kept.
  std::filesystem::path partial_file;
  bool discard_partial = false;  // start again even so
  ProgressMode progress = ProgressMode::automatic;
  std::string stage = "sampling";  // of the progress line
};

struct SignatureRun {
  Signature signature;
  std::vector<PlaneCollision> collisions;    // with keep_collisions
  std::vector<std::string> ignored_columns;  // of the file of collisions
  std::string solid;      // how the mesh became one (geometry/solid.h); empty: as it is
  double sampling_s = 0;  // wall time of the tables
  double accuracy_s = 0;  // of the accuracy report
  double drops_s = 0;     // of the drops
};

// An object that is sampled without a file of its own.
struct SampledObject {
  std::string name;     // for errors, and in the signature
  TriangleMesh hull;    // convex, m, about the centre of mass
  MassProperties mass;  // of unit density, about the centre of mass
};

// The defaults of a layout: trials a cell (the dissertation's 30) and exemplars.
TableSampling default_sampling(TableLayout layout);

// Checks everything, then takes over SIGINT, SIGTERM and SIGHUP and measures.
// Throws Error(usage) for settings out of range or that contradict each other, Error(input) for a
// mesh that is no solid, Error(interrupted) after Ctrl-C, when what was measured is safe in
// `partial_file`.
SignatureRun sample_signature(const SignatureOptions& options);
// The same for an object; the options' mesh, scale, axis and solid are not used.
SignatureRun sample_signature(const SignatureOptions& options, const SampledObject& object);

}  // namespace pilesim

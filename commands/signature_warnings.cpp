#include "signature_warnings.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>

#include "core/text.h"
#include "print.h"
#include "signature/measured_collisions.h"
#include "signature/rest/known_rest_poses.h"

namespace pilesim {
namespace {

void warn_of_disagreement(const Signature& signature) {
  for (const RestPoseComparison& pose :
       compare_rest_poses(signature.rest_poses, signature.rest_drops)) {
    if (pose.agrees) continue;
    char text[200];
    std::snprintf(text, sizeof text,
                  "the rest pose with up (%.3f, %.3f, %.3f) has %.1f%% by geometry, but %.1f%% "
                  "(%.1f to %.1f) by simulation",
                  pose.up.x(), pose.up.y(), pose.up.z(), 100 * pose.by_geometry,
                  100 * pose.by_simulation, 100 * pose.simulation_low, 100 * pose.simulation_high);
    warn(text);
  }
}

// Limits above which a warning says that one ellipsoid does not suit this object.
constexpr double kPilesAlike = 0.15;

void warn_of_packing(const Signature& signature) {
  if (!signature.packing) return;
  const Packing& packing = *signature.packing;
  const auto say = [](const char* pile, double measured, double spheres) {
    if (!(measured > 0) || std::abs(spheres / measured - 1) <= kPilesAlike) return;
    warn(std::string("in the statistical mode ") + pile + " of it will lie " +
         std::to_string(std::lround(100 * std::abs(spheres / measured - 1))) + "% " +
         (spheres > measured ? "higher" : "lower") +
         " than they do; simulate it in the impulse mode, or finish the pile");
  };
  say("heaps", packing.measured.heap_height, packing.spheres.heap_height);
  say("fills", packing.measured.column_height, packing.spheres.column_height);
}

void warn_of_collisions(const SignatureRun& run) {
  if (!run.signature.collisions) return;
  if (!run.ignored_columns.empty()) {
    std::string names;
    for (const std::string& name : run.ignored_columns) {
      names += (names.empty() ? "" : ", ") + name;
    }
    warn("columns that say nothing of a collision: " + names);
  }
  const ResponseTable& table = run.signature.responses;
  const auto empty = std::ranges::count(table.trials, 0.0F);
  if (empty > 0) {
    warn(std::to_string(empty) + " of " + std::to_string(table.cell_count()) +
         " cells have fewer than " + with_digits(kFewestCollisions, 3) +
         " collisions and take the response of the nearest that has; pilesim inspect says which");
  }
}

}  // namespace

void warn_of_signature(const SignatureRun& run) {
  warn_of_disagreement(run.signature);
  warn_of_packing(run.signature);
  warn_of_collisions(run);
}

}  // namespace pilesim

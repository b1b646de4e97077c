// Measures the packing of an object by pouring it, and fits spheres that pack alike.
#pragma once

#include <memory>
#include <string>

#include "core/progress.h"
#include "packing/pour_trial.h"
#include "signature/packing.h"
#include "signature/signature.h"
#include "signature/signature_sampling.h"

namespace pilesim {

struct PackingSettings {
  uint32_t pours = 3;  // of each kind, by the exact engine
  // Number of each kind per iteration of the search, and twice as many at its end.
  uint32_t sphere_pours = 3;
  uint64_t seed = 1;
  ProgressMode progress = ProgressMode::automatic;
  std::string stage = "pouring";  // label of the progress line
};

// The object of a signature sampled with `sampling`, with a decomposition as its collision shape.
// Throws as build_model() does.
PouredObject poured_object(const SignatureOptions& sampling, const Signature& signature);

// Pours the object onto a plane and into a column with the exact engine, then spheres that collide
// by its signature. The spheres' radius, rolling resistance, turning, leaning and rebound are
// fitted until heaps and column match the object's heights, spreads, reaches and solid share. The
// result does not depend on the number of threads. Throws Error(interrupted) after Ctrl-C.
Packing measure_packing(const PouredObject& object, const Signature& signature,
                        const PackingSettings& settings);

}  // namespace pilesim

// How an object packs, measured by pouring it, and spheres that come to lie as it does.
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
  uint32_t pours = 3;         // of each kind, by the exact engine
  uint32_t sphere_pours = 3;  // of each kind in a round of the search, and twice as many at its end
  uint64_t seed = 1;
  ProgressMode progress = ProgressMode::automatic;
  std::string stage = "pouring";  // of the progress line
};

// The object of a signature that was sampled so, which collides by a decomposition. Throws as
// build_model() does.
PouredObject poured_object(const SignatureOptions& sampling, const Signature& signature);

// Pours the object onto a plane and into a column by the exact engine, then spheres that collide by
// its signature. Their radius, resistance to rolling, turning, leaning and rebound are changed until
// heaps and column have the object's heights, spreads, reaches and solid share. The same for any number of threads. Throws Error(interrupted) after Ctrl-C.
Packing measure_packing(const PouredObject& object, const Signature& signature,
                        const PackingSettings& settings);

}  // namespace pilesim

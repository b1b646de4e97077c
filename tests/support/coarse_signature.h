// Signatures from few trials, for tests that do not depend on their accuracy.
#pragma once

#include <cstdint>

#include "signature/signature_sampling.h"
#include "support/plain_packing.h"

namespace pilesim::test {

// `trials` and `exemplars` per cell; without an accuracy report and progress line.
inline SignatureOptions coarse_options(const ContactMaterial& material, uint32_t trials,
                                       uint32_t exemplars) {
  SignatureOptions options{.material = material};
  options.sampling = {.trials_per_cell = trials, .exemplars = exemplars};
  options.accuracy.reset();
  options.progress = ProgressMode::none;
  return options;
}

// The coarsest signature of an object, with a packing by geometry.
inline Signature coarse_signature(const SampledObject& object, const ContactMaterial& material) {
  Signature signature = sample_signature(coarse_options(material, 2, 2), object).signature;
  signature.packing = plain_packing(signature, object.hull);
  return signature;
}

}  // namespace pilesim::test

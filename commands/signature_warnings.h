// Warnings about a signature that was sampled.
#pragma once

#include "signature/signature_sampling.h"

namespace pilesim {

// Warns where drops and geometry disagree about rest poses, where the statistical mode will pile
// the object otherwise than it piles, and of collisions that were too few.
void warn_of_signature(const SignatureRun& run);

}  // namespace pilesim

// The contents of a signature file, as a document (docs/files.md describes it).
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "signature/signature.h"

namespace pilesim {

nlohmann::json signature_document(const Signature& signature);

// Reads what signature_document() wrote. Throws Error(input), without a file's name, or
// json::exception where something is missing, is of another kind or out of its range: what it gives
// can be summed up, plotted and drawn from.
Signature signature_of(const nlohmann::json& document);

}  // namespace pilesim

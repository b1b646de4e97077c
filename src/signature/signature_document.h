// The contents of a signature file, as a document (docs/files.md describes it).
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "signature/signature.h"

namespace pilesim {

nlohmann::json signature_document(const Signature& signature);

// Reads the output of signature_document(). Throws Error(input), without a file name, or
// json::exception where a field is missing, has another type or is out of range. The result is safe
// to summarise, plot and sample from.
Signature signature_of(const nlohmann::json& document);

}  // namespace pilesim

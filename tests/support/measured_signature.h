// Signatures for benchmarks: measured with the defaults, without an accuracy report.
#pragma once

#include <filesystem>

#include "packing/packing_measurement.h"
#include "signature/signature_file.h"
#include "signature/signature_sampling.h"

namespace pilesim {

// `options`: mesh, material and drops; all other members are set here.
inline void measure_signature(SignatureOptions options, const std::filesystem::path& file) {
  options.sampling = default_sampling(options.layout);
  options.accuracy.reset();
  options.progress = ProgressMode::none;
  Signature signature = sample_signature(options).signature;
  signature.packing = measure_packing(poured_object(options, signature), signature,
                                      {.progress = ProgressMode::none});
  write_signature(signature, file);
}

}  // namespace pilesim

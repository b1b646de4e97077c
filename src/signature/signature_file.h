// Signatures as files: CBOR (RFC 8949) with typed arrays (RFC 8746), little-endian, and a checksum
// that reveals any changed byte.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "signature/signature.h"

namespace pilesim {

inline constexpr int kSignatureVersion = 12;

// Writes to a temporary file in the same folder and renames it. Throws Error(io).
void write_signature(const Signature& signature, const std::filesystem::path& file);

// The bytes of the file that write_signature() writes.
std::vector<uint8_t> encode_signature(const Signature& signature);

// Throws Error(io) if the file cannot be read, Error(input) if it is no signature, is damaged, or
// has another format version.
Signature read_signature(const std::filesystem::path& file);

// An interrupted run: the trials so far, and a text that identifies the measurement.
struct PartialSampling {
  std::string fingerprint;
  SamplingState state;
};
void write_partial_sampling(const PartialSampling& partial, const std::filesystem::path& file);
PartialSampling read_partial_sampling(const std::filesystem::path& file);

}  // namespace pilesim

// Signatures as files: CBOR (RFC 8949) with typed arrays (RFC 8746), little-endian, and a checksum
// of it all: no byte can be other than it was written without being noticed.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "signature/signature.h"

namespace pilesim {

inline constexpr int kSignatureVersion = 12;

// Written beside its place and renamed. Throws Error(io).
void write_signature(const Signature& signature, const std::filesystem::path& file);

// The bytes that write_signature() writes.
std::vector<uint8_t> encode_signature(const Signature& signature);

// Throws Error(io) if it cannot be read, Error(input) if it is no signature, is damaged, or has
// another format version.
Signature read_signature(const std::filesystem::path& file);

// An interrupted run: the trials so far, and the text that names what was being measured.
struct PartialSampling {
  std::string fingerprint;
  SamplingState state;
};
void write_partial_sampling(const PartialSampling& partial, const std::filesystem::path& file);
PartialSampling read_partial_sampling(const std::filesystem::path& file);

}  // namespace pilesim

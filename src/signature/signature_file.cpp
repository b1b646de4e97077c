#include "signature/signature_file.h"

#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <string_view>

#include "core/atomic_file.h"
#include "core/hash.h"
#include "core/naming.h"
#include "json/cbor.h"
#include "signature/signature_document.h"
#include "signature/typed_array.h"

namespace pilesim {
namespace {

using nlohmann::json;

constexpr const char* kFormat = "pilesim signature";
constexpr const char* kPartialFormat = "pilesim partial signature";

// A file is a CBOR sequence (RFC 8742) of two items: the document, and the checksum of its bytes as
// a string.
constexpr uint8_t kChecksumHead = 0x40 + sizeof(Checksum);  // a string of this many bytes
constexpr size_t kSealBytes = 1 + sizeof(Checksum);

std::vector<uint8_t> sealed(json document, const char* format) {
  document["format"] = format;
  document["version"] = kSignatureVersion;
  std::vector<uint8_t> bytes = json::to_cbor(document);
  const Checksum checksum = checksum_of(std::as_bytes(std::span(bytes)));
  bytes.push_back(kChecksumHead);
  bytes.insert(bytes.end(), checksum.begin(), checksum.end());
  return bytes;
}

// True where a checksum follows the document, right or wrong.
bool has_seal(std::string_view bytes) {
  return bytes.size() > kSealBytes &&
         static_cast<uint8_t>(bytes[bytes.size() - kSealBytes]) == kChecksumHead;
}

// The document's bytes, if they match the checksum.
std::optional<std::string_view> unsealed(std::string_view bytes) {
  if (!has_seal(bytes)) return std::nullopt;
  const std::string_view content = bytes.substr(0, bytes.size() - kSealBytes);
  const std::string_view seal = bytes.substr(content.size());
  const Checksum checksum = checksum_of(std::as_bytes(std::span(content)));
  const bool whole = std::memcmp(seal.data() + 1, checksum.data(), checksum.size()) == 0;
  return whole ? std::optional(content) : std::nullopt;
}

void write_sealed(json document, const char* format, const std::filesystem::path& file) {
  const std::vector<uint8_t> bytes = sealed(std::move(document), format);
  write_file_atomically(file, std::as_bytes(std::span(bytes)));
}

void check_format(const json& document, const char* format) {
  if (!document.is_object() || document.value("format", json()) != format) {
    damaged("another kind of file", std::string("a ") + format);
  }
  const json version = document.value("version", json());
  if (version != kSignatureVersion) {
    damaged("format version " + version.dump(), "version " + std::to_string(kSignatureVersion));
  }
}

Error damaged_file(const std::filesystem::path& file, const std::string& found,
                   const std::string& expected) {
  return {ErrorKind::input,
          {.file = file.string(),
           .found = found,
           .expected = expected,
           .remedy = "Measure it again with pilesim sample-signature"}};
}

// Checks that `file` is a whole `format` and passes its document to `parse`. Any fault becomes an
// Error(input) that names the file.
template <typename Parse>
auto read_sealed(const std::filesystem::path& file, const char* format, const Parse& parse) {
  const std::string bytes =
      advising(file, "Measure one with pilesim sample-signature MESH -o NAME.sig",
               [&] { return read_file(file); });
  // Every file begins with a CBOR map; text, meshes and pictures do not.
  const bool is_map = bytes.empty() || (static_cast<uint8_t>(bytes[0]) & 0xe0) == 0xa0;
  if (!is_map) {
    throw Error(ErrorKind::input,
                {.file = file.string(),
                 .found = "is no signature",
                 .expected = "a file that pilesim sample-signature or fit-bspline wrote",
                 .remedy = "Measure one with pilesim sample-signature MESH -o NAME.sig"});
  }
  try {
    const auto content = unsealed(bytes);
    if (!content && has_seal(bytes)) {
      damaged("its checksum is not that of its content", "the file as it was written");
    }
    // Versions up to 3 had no checksum; their version tells them from damaged files.
    const json document = parse_cbor(content.value_or(bytes));
    check_format(document, format);
    if (!content) damaged("its checksum is not there", "the file as it was written");
    return parse(document);
  } catch (const json::exception& error) {
    throw damaged_file(file, std::string("a damaged signature: ") + error.what(), "a complete one");
  } catch (const Error& error) {
    throw damaged_file(file, error.problems().front().found, error.problems().front().expected);
  }
}

}  // namespace

std::vector<uint8_t> encode_signature(const Signature& signature) {
  return sealed(signature_document(signature), kFormat);
}

void write_signature(const Signature& signature, const std::filesystem::path& file) {
  write_sealed(signature_document(signature), kFormat, file);
}

Signature read_signature(const std::filesystem::path& file) {
  return read_sealed(file, kFormat, signature_of);
}

void write_partial_sampling(const PartialSampling& partial, const std::filesystem::path& file) {
  const SamplingState& state = partial.state;
  write_sealed({{"fingerprint", partial.fingerprint},
                {"cells", state.launched.size()},
                {"trials", state.responses.first.size()},
                {"launched", to_array(state.launched)},
                {"wanted", to_array(state.wanted)},
                {"first_node", to_array(state.responses.first)},
                {"keys", to_array(state.responses.keys)},
                {"responses", to_array(state.responses.values)}},
               kPartialFormat, file);
}

PartialSampling read_partial_sampling(const std::filesystem::path& file) {
  return read_sealed(file, kPartialFormat, [](const json& document) {
    const auto cells = whole_number_of<uint32_t>(document, "cells");
    const auto trials = whole_number_of<uint32_t>(document, "trials");
    PartialSampling partial{.fingerprint = document.at("fingerprint")};
    SamplingState& state = partial.state;
    state.launched = from_array<uint32_t>(document, "launched", cells);
    state.wanted = from_array<uint32_t>(document, "wanted", cells);
    state.responses.first = from_array<uint32_t>(document, "first_node", trials);
    state.responses.keys = from_array<float>(document, "keys", size_t{3} * trials);
    state.responses.values = from_array<float>(document, "responses", size_t{6} * trials);
    return partial;
  });
}

}  // namespace pilesim

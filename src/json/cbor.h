// CBOR (RFC 8949) from files: nothing in it is believed before it is held against the bytes there.
#pragma once

#include <nlohmann/json.hpp>
#include <span>
#include <string_view>

namespace pilesim {

// Arrays, maps and tags within one another.
inline constexpr int kMostCborDepth = 64;

// One item, binary strings with their tags as subtypes. Throws Error(input), without a file's name,
// where it is no complete item of definite lengths, is followed by other bytes or nested deeper
// than kMostCborDepth. Memory is proportional to `bytes`.
nlohmann::json parse_cbor(std::string_view bytes);

}  // namespace pilesim

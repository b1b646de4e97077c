// CBOR (RFC 8949) from files: sizes in it are checked against the bytes present.
#pragma once

#include <nlohmann/json.hpp>
#include <span>
#include <string_view>

namespace pilesim {

// Arrays, maps and tags within one another.
inline constexpr int kMostCborDepth = 64;

// Parses one item; binary strings keep their tags as subtypes. Throws Error(input), without a file
// name, unless `bytes` is exactly one complete item of definite lengths, nested at most
// kMostCborDepth deep. Memory is proportional to `bytes`.
nlohmann::json parse_cbor(std::string_view bytes);

}  // namespace pilesim

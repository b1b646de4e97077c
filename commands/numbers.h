// Numbers on the command line: one strict reading of them for every option. A number is decimal
// digits, real ones with point and exponent too, and nothing else beside them; values out of range
// are refused and never wrapped or rounded. --help and the refusal state the range.
#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

namespace pilesim {

struct WholeRange {
  uint64_t least = 0, most = UINT64_MAX;
};
struct RealRange {
  double least = 0, most = 1e9;
  bool excludes_least = false;
};

// Takes decimal digits off the front of `text`; nullopt where there are none or the number is above
// 2^64 - 1.
std::optional<uint64_t> take_whole_number(std::string_view& text);

// Throw CLI::ValidationError naming `option`, `text` and the range.
uint64_t parse_whole_number(std::string_view text, WholeRange range, const std::string& option);
double parse_real_number(std::string_view text, RealRange range, const std::string& option);

// `name` is one long option. `description` gets the range added.
CLI::Option* add_whole_number(CLI::App& command, const std::string& name, WholeRange range,
                              std::function<void(uint64_t)> take, const std::string& description);
CLI::Option* add_real_number(CLI::App& command, const std::string& name, RealRange range,
                             std::function<void(double)> take, const std::string& description);

}  // namespace pilesim

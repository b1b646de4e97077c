// JSON text and the positions of its values: parsing with comments, and line and column of every
// key and value.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

namespace pilesim {

using Json = nlohmann::ordered_json;

struct TextPosition {
  int line = 0;    // from 1
  int column = 0;  // from 1, in characters (UTF-8 code points)
};

// Finds positions in one text.
class LineIndex {
 public:
  explicit LineIndex(std::string_view text);
  TextPosition position(size_t offset) const;  // 0 <= offset <= size of the text

 private:
  std::vector<size_t> line_starts_;    // offsets
  std::vector<size_t> continuations_;  // offsets of bytes that continue a UTF-8 character
};

// Throws Error(input) naming `file`, line and column if `text` is not JSON, is nested deeper than
// kMaxJsonDepth, has too many keys (one object may have 30,000), or a number beyond the range of
// double. The last value of a repeated key counts: find repetitions with walk_json().
inline constexpr int kMaxJsonDepth = 64;
Json parse_json(const std::string& text, const std::string& file);

// parse_json() of a whole file; all JSON files are read by it. Also throws Error(input) for more
// than kMostJsonBytes (values take up to 30 times their text), and Error(io).
inline constexpr uint64_t kMostJsonBytes = uint64_t{256} << 20;
Json read_json_file(const std::filesystem::path& file);

struct JsonPlace {
  const std::string& pointer;  // RFC 6901; valid during the visit
  size_t key_offset;           // of the key's opening quote, or of the value if there is no key
  size_t value_offset;
  bool repeats_key;  // the key occurred earlier in the object
};

// Visits every value of `text`, which has passed parse_json(), in order.
void walk_json(std::string_view text, const std::function<void(const JsonPlace&)>& visit);

// A token of a JSON pointer with ~ and / escaped.
std::string escape_pointer_token(std::string_view token);

}  // namespace pilesim

#include "json/json_text.h"

#include <algorithm>
#include <array>
#include <set>
#include <sstream>
#include <utility>

#include "core/atomic_file.h"
#include "core/error.h"

namespace pilesim {

namespace {

// A Json compares each key with the earlier ones in its object: 2 s, or one object of 31,000 keys.
constexpr size_t kMostKeyComparisons = 500'000'000;
// The pointers of all values below a key contain it.
constexpr size_t kLongestKey = 1000;  // bytes of text
constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";

// First offset at or after `offset` that is neither white space, comment, comma nor colon.
size_t skip_insignificant(std::string_view text, size_t offset) {
  while (offset < text.size()) {
    if (text.substr(offset, 2) == "//") {
      offset = std::min(text.find_first_of("\r\n", offset), text.size());
    } else if (text.substr(offset, 2) == "/*") {
      const size_t end = text.find("*/", offset + 2);
      offset = end == text.npos ? text.size() : end + 2;
    } else if (std::string_view(" \t\r\n,:").find(text[offset]) != text.npos) {
      ++offset;
    } else {
      break;
    }
  }
  return offset;
}

// The offset after the string that opens at `offset`.
size_t string_end(std::string_view text, size_t offset) {
  for (++offset; offset < text.size() && text[offset] != '"'; ++offset) {
    if (text[offset] == '\\') ++offset;
  }
  return std::min(offset + 1, text.size());
}

std::string decode_string(std::string_view token) {
  if (token.find('\\') == token.npos) return std::string(token.substr(1, token.size() - 2));
  return Json::parse(token).get<std::string>();
}

class Walker {
 public:
  Walker(std::string_view text, const std::function<void(const JsonPlace&)>& visit)
      : text_(text), visit_(visit) {}

  void walk() {
    const size_t start = text_.starts_with(kByteOrderMark) ? kByteOrderMark.size() : 0;
    offset_ = skip_insignificant(text_, start);
    value(offset_, false);
  }

 private:
  void value(size_t key_offset, bool repeats_key) {
    visit_({pointer_, key_offset, offset_, repeats_key});
    switch (text_[offset_]) {
      case '{':
        return object();
      case '[':
        return array();
      case '"':
        offset_ = string_end(text_, offset_);
        break;
      default:
        offset_ = std::min(text_.find_first_of(" \t\r\n,:/]}", offset_), text_.size());
    }
  }

  void object() {
    std::set<std::string> keys;
    for (next(); text_[offset_] != '}'; offset_ = skip_insignificant(text_, offset_)) {
      const size_t key_offset = offset_;
      const size_t end = string_end(text_, offset_);
      const std::string key = decode_string(text_.substr(offset_, end - offset_));
      offset_ = skip_insignificant(text_, end);
      const bool is_new = keys.insert(key).second;
      child(escape_pointer_token(key), key_offset, !is_new);
    }
    ++offset_;
  }

  void array() {
    size_t index = 0;
    for (next(); text_[offset_] != ']'; offset_ = skip_insignificant(text_, offset_)) {
      child(std::to_string(index++), offset_, false);
    }
    ++offset_;
  }

  void next() { offset_ = skip_insignificant(text_, offset_ + 1); }

  void child(const std::string& token, size_t key_offset, bool repeats_key) {
    const size_t length = pointer_.size();
    pointer_ += '/' + token;
    value(key_offset, repeats_key);
    pointer_.resize(length);
  }

  std::string_view text_;
  const std::function<void(const JsonPlace&)>& visit_;
  size_t offset_ = 0;
  std::string pointer_;
};

Error syntax_error(const std::string& text, const std::string& file, size_t offset,
                   std::string found, std::string expected, std::string remedy) {
  const TextPosition position = LineIndex(text).position(offset);
  return {ErrorKind::input, Problem{.file = file,
                                    .line = position.line,
                                    .column = position.column,
                                    .found = std::move(found),
                                    .expected = std::move(expected),
                                    .remedy = std::move(remedy)}};
}

// The library says "[...] parse error at line 1, column 2: syntax error while parsing value -
// unexpected '}'; expected ...". The user gets the part after the dash.
Error translate(const Json::exception& error, const std::string& text, const std::string& file,
                size_t offset) {
  std::string found = error.what();
  const size_t dash = found.find(" - ");
  const size_t bracket = found.find("] ");
  if (dash != found.npos) {
    found.erase(0, dash + 3);
  } else if (bracket != found.npos) {
    found.erase(0, bracket + 2);
  }
  std::string expected;
  const std::string_view separator = "; expected ";
  if (const size_t at = found.find(separator); at != found.npos) {
    expected = found.substr(at + separator.size());
    found.erase(at);
  }
  std::string remedy;
  const size_t before = text.find_last_not_of(" \t\r\n", offset == 0 ? 0 : offset - 1);
  if (offset < text.size() && (text[offset] == '}' || text[offset] == ']') && before != text.npos &&
      text[before] == ',') {
    remedy = "Remove the comma after the last entry";
  }
  return syntax_error(text, file, offset, "is no valid JSON: " + found, expected, remedy);
}

// Rejects text that would cost the parser too much stack or time, and bytes 0, at which it ends a
// comment and the whole text.
void check_text(const std::string& text, const std::string& file) {
  if (const size_t at = text.find('\0'); at != text.npos) {
    throw syntax_error(text, file, at, "has a byte 0", "text in UTF-8", "Save the file as UTF-8");
  }
  int depth = 0;
  std::array<size_t, kMaxJsonDepth + 1> keys{};  // in the open object at each depth
  size_t comparisons = 0;
  size_t string_begin = 0, string_size = 0;  // of the last string
  for (size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '"') {
      string_begin = i;
      i = string_end(text, i) - 1;
      string_size = i - string_begin;
    } else if (text[i] == '/') {
      i = std::max(skip_insignificant(text, i), i + 1) - 1;
    } else if (text[i] == '{' || text[i] == '[') {
      if (++depth > kMaxJsonDepth) {
        throw syntax_error(text, file, i, "is nested too deeply",
                           "at most " + std::to_string(kMaxJsonDepth) + " levels", "");
      }
      keys[depth] = 0;
    } else if (text[i] == ':') {
      if (string_size > kLongestKey) {
        throw syntax_error(text, file, string_begin,
                           "is a key of " + std::to_string(string_size) + " bytes",
                           "at most " + std::to_string(kLongestKey), "");
      }
      comparisons += keys[depth]++;
      if (comparisons > kMostKeyComparisons) {
        throw syntax_error(text, file, i, "follows one key too many",
                           "objects of fewer keys; one alone may have 30000", "");
      }
    } else if ((text[i] == '}' || text[i] == ']') && depth > 0) {
      --depth;
    }
  }
}

}  // namespace

LineIndex::LineIndex(std::string_view text) : line_starts_{0} {
  for (size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '\n') line_starts_.push_back(i + 1);
    if ((static_cast<unsigned char>(text[i]) >> 6) == 2) continuations_.push_back(i);
  }
}

TextPosition LineIndex::position(size_t offset) const {
  const auto next_line = std::upper_bound(line_starts_.begin(), line_starts_.end(), offset);
  const size_t start = *(next_line - 1);
  const auto continuations_before = [&](size_t end) {
    return std::lower_bound(continuations_.begin(), continuations_.end(), end);
  };
  const auto continuations = continuations_before(offset) - continuations_before(start);
  return {static_cast<int>(next_line - line_starts_.begin()),
          1 + static_cast<int>(offset - start) - static_cast<int>(continuations)};
}

Json parse_json(const std::string& text, const std::string& file) {
  check_text(text, file);
  // A stream, because its read position shows where the parser stopped, whatever it threw.
  std::istringstream stream(text);
  try {
    return Json::parse(stream, nullptr, true, true);
  } catch (const Json::exception& error) {
    const auto read = stream.rdbuf()->pubseekoff(0, std::ios::cur, std::ios::in);
    const size_t consumed = read < 0 ? text.size() : static_cast<size_t>(read);
    const bool at_end =
        std::string_view(error.what()).find("unexpected end of input") != std::string::npos;
    throw translate(error, text, file, at_end || consumed == 0 ? text.size() : consumed - 1);
  }
}

Json read_json_file(const std::filesystem::path& file) {
  return parse_json(read_file(file, kMostJsonBytes), file.string());
}

void walk_json(std::string_view text, const std::function<void(const JsonPlace&)>& visit) {
  Walker(text, visit).walk();
}

std::string escape_pointer_token(std::string_view token) {
  std::string escaped;
  for (const char c : token) {
    if (c == '~') {
      escaped += "~0";
    } else if (c == '/') {
      escaped += "~1";
    } else {
      escaped += c;
    }
  }
  return escaped;
}

}  // namespace pilesim

#include "json/cbor.h"

#include <cstdint>
#include <string>
#include <vector>

#include "core/error.h"

namespace pilesim {
namespace {

[[noreturn]] void refuse(size_t offset, const std::string& found, const std::string& expected) {
  throw Error(ErrorKind::input,
              {.found = "is cut short or of another kind (no complete CBOR): byte " +
                        std::to_string(offset) + ' ' + found,
               .expected = expected});
}

// Scans the heads of all items without recursion, whatever they claim.
class Scanner {
 public:
  explicit Scanner(std::string_view bytes) : bytes_(bytes) {}

  void scan() {
    std::vector<uint64_t> open = {1};  // items still expected, by level
    while (!open.empty()) {
      if (open.back() == 0) {
        open.pop_back();
        continue;
      }
      --open.back();
      const uint64_t inside = item();
      if (inside == 0) continue;
      if (open.size() > kMostCborDepth) {
        refuse(offset_, "is nested too deeply",
               "at most " + std::to_string(kMostCborDepth) + " levels");
      }
      open.push_back(inside);
    }
    if (offset_ < bytes_.size()) {
      refuse(offset_, "begins something else",
             "the end of the " + std::to_string(bytes_.size()) + " bytes");
    }
  }

 private:
  // Moves past an item's head and its own bytes; gives the number of items it contains.
  uint64_t item() {
    const size_t start = offset_;
    require(start, 1, 1);
    const auto head = static_cast<uint8_t>(bytes_[offset_++]);
    const unsigned kind = head >> 5, info = head & 31;
    if (info > 27) refuse(start, "opens an item of no definite length", "one");
    uint64_t value = info;
    if (info >= 24) {
      const size_t width = size_t{1} << (info - 24);
      require(start, width, 1);
      value = 0;
      for (size_t i = 0; i < width; ++i) {
        value = value << 8 | static_cast<uint8_t>(bytes_[offset_++]);
      }
    }
    switch (kind) {
      case 2:  // byte and text strings
      case 3:
        require(start, value, 1);
        offset_ += value;
        return 0;
      case 4:  // arrays and maps; an item takes at least one byte
        require(start, value, 1);
        return value;
      case 5:
        require(start, value, 2);
        return 2 * value;
      case 6:  // a tag
        return 1;
      default:  // numbers and simple values
        return 0;
    }
  }

  void require(size_t start, uint64_t count, uint64_t bytes_each) const {
    const uint64_t left = bytes_.size() - offset_;
    if (count <= left / bytes_each) return;
    refuse(start, "asks for " + std::to_string(count) + (bytes_each == 1 ? " more" : " more pairs"),
           "at most the " + std::to_string(left) + " bytes that are left");
  }

  std::string_view bytes_;
  size_t offset_ = 0;
};

}  // namespace

nlohmann::json parse_cbor(std::string_view bytes) {
  Scanner(bytes).scan();
  try {
    return nlohmann::json::from_cbor(bytes, true, true, nlohmann::json::cbor_tag_handler_t::store);
  } catch (const nlohmann::json::exception& error) {
    throw Error(ErrorKind::input,
                {.found = std::string("is of another kind (no complete CBOR): ") + error.what(),
                 .expected = "what pilesim writes"});
  }
}

}  // namespace pilesim

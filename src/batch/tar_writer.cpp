#include "batch/tar_writer.h"

#include <array>
#include <cassert>
#include <cstdio>
#include <cstring>
#include <numeric>

#include "core/error.h"

namespace pilesim {
namespace {

constexpr size_t kBlock = 512;
constexpr size_t kLongestName = 100;

// POSIX.1-1988, "ustar Interchange Format": numbers are octal text.
std::array<char, kBlock> header_of(const std::string& name, uint64_t size) {
  assert(name.size() <= kLongestName && size < (uint64_t{1} << 33));
  std::array<char, kBlock> header{};
  const auto put = [&](size_t at, std::string_view text) {
    std::memcpy(header.data() + at, text.data(), text.size());
  };
  put(0, name);
  put(100, "0000644");  // rw-r--r--
  put(108, "0000000");  // owner, group
  put(116, "0000000");
  std::snprintf(header.data() + 124, 12, "%011llo", static_cast<unsigned long long>(size));
  put(136, "00000000000");  // 1 January 1970
  put(148, "        ");     // the checksum is summed over blanks in its place
  put(156, "0");            // a regular file
  put(257, std::string_view("ustar\00000", 8));
  const unsigned sum =
      std::accumulate(header.begin(), header.end(), 0U,
                      [](unsigned total, char c) { return total + static_cast<unsigned char>(c); });
  std::snprintf(header.data() + 148, 8, "%06o", sum);
  return header;
}

}  // namespace

TarWriter::TarWriter(std::filesystem::path path) : path_(std::move(path)), file_(path_) {}

void TarWriter::add(const std::string& name, std::string_view content) {
  if (name.size() > kLongestName) {
    throw Error(ErrorKind::input, Problem{.file = path_.string(),
                                          .found = "would have an entry of " +
                                                   std::to_string(name.size()) + " bytes, " + name,
                                          .expected = "at most " + std::to_string(kLongestName),
                                          .remedy = "Give cameras and directories shorter names"});
  }
  const std::array<char, kBlock> header = header_of(name, content.size());
  file_.add({header.data(), header.size()});
  file_.add(content);
  file_.add(std::string((kBlock - content.size() % kBlock) % kBlock, '\0'));
}

void TarWriter::take_place() {
  file_.add(std::string(2 * kBlock, '\0'));
  file_.take_place();
}

}  // namespace pilesim

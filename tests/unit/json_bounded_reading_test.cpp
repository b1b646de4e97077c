// Files, CBOR and third-party readers that request more than is present.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>
#include <new>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/hash.h"
#include "core/isolated.h"
#include "json/cbor.h"
#include "json/json_text.h"
#include "support/thrown_error.h"

namespace pilesim {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::StartsWith;

TEST(ReadFile, RefusesWhatIsNoRegularFile) {
  const auto text = [](const std::string& file) {
    return test::error_text([&] { read_file(file); }, ErrorKind::io);
  };
  EXPECT_EQ(text("/dev/zero"),
            "/dev/zero: is a device, a pipe or a socket; expected a regular file. Save what it "
            "gives in a file");
  const std::string pipe = testing::TempDir() + "a_pipe";
  std::filesystem::remove(pipe);
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);  // without a writer
  EXPECT_THAT(text(pipe), HasSubstr("is a device, a pipe or a socket"));
  std::filesystem::remove(pipe);
  EXPECT_THAT(text("/tmp"), HasSubstr("cannot be read: Is a directory"));
  EXPECT_THAT(text("/no/where"), HasSubstr("cannot be read: No such file"));
}

TEST(ReadFile, HoldsToItsLimit) {
  const std::string file = testing::TempDir() + "limited";
  write_file_atomically(file, "0123456789");
  EXPECT_EQ(read_file(file, 10), "0123456789");
  EXPECT_EQ(test::error_text([&] { read_file(file, 9); }, ErrorKind::input),
            file + ": has 10 bytes or more; expected at most 9");
  std::filesystem::resize_file(file, uint64_t{1} << 40);  // sparse: it takes no room
  EXPECT_THAT(test::error_text([&] { read_file(file); }, ErrorKind::input),
              HasSubstr("1099511627776"));
  EXPECT_THAT(test::error_text([&] { read_json_file(file); }, ErrorKind::input),
              HasSubstr("at most"));
  std::filesystem::remove(file);
  EXPECT_FALSE(read_file("/proc/self/status").empty());  // its reported size is 0
}

std::string cbor_error(const std::string& bytes) {
  return test::error_text([&] { parse_cbor(bytes); }, ErrorKind::input);
}

TEST(ParseCbor, ReadsWhatIsWritten) {
  using nlohmann::json;
  const json document = {{"a", {1, -2, 3.5, nullptr, true}},
                         {"b", json::binary({1, 2, 3}, 64)},
                         {"c", {{"text", "\u00e9"}, {"empty", json::array()}}}};
  const std::vector<uint8_t> bytes = json::to_cbor(document);
  EXPECT_EQ(parse_cbor(std::string(bytes.begin(), bytes.end())), document);
  // Whatever is cut off or appended.
  for (size_t size = 0; size < bytes.size(); ++size) {
    cbor_error(std::string(bytes.begin(), bytes.begin() + static_cast<ptrdiff_t>(size)));
  }
  cbor_error(std::string(bytes.begin(), bytes.end()) + '\0');
}

TEST(ParseCbor, RefusesDepthAndLengthsThatAreNotThere) {
  EXPECT_THAT(cbor_error(std::string(200'000, '\x81')),
              HasSubstr("is nested too deeply; expected at most 64 levels"));
  EXPECT_THAT(cbor_error(std::string(200'000, '\xc1')), HasSubstr("is nested too deeply"));  // tags
  for (const std::string head : {"\x5b", "\x7b", "\x9b", "\xbb"}) {
    const std::string bytes = head + std::string("\x00\x00\x00\xff\xff\xff\xff\xff", 8);
    EXPECT_THAT(cbor_error(bytes), AllOf(HasSubstr("byte 0 asks for 1099511627775 more"),
                                         HasSubstr("at most the 0 bytes that are left")));
    EXPECT_THAT(cbor_error(head + std::string(8, '\xff')), HasSubstr("asks for"));
  }
  EXPECT_THAT(cbor_error("\x9f\x01\xff"), HasSubstr("no definite length"));
}

TEST(Isolated, GivesWhatTheWorkGivesOrWhyNot) {
  const IsolationLimits limits{.memory_bytes = 64 << 20, .cpu_s = 5};
  const std::string large(5 << 20, 'x');
  EXPECT_EQ(run_isolated([&] { return large; }, limits).bytes, large);
  const auto fault = [&](const std::function<void()>& work) {
    const IsolatedResult result = run_isolated(
        [&] {
          work();
          return std::string("bytes");
        },
        limits);
    EXPECT_EQ(result.bytes, "");
    return result.fault;
  };
  EXPECT_THAT(fault([] { raise(SIGSEGV); }), AnyOf(StartsWith("crashes ("), "fails"));
  EXPECT_THAT(fault([] { throw std::bad_alloc(); }), "needs more than 64 MB of memory");
  EXPECT_THAT(fault([] { throw 1; }), "fails");
  EXPECT_THAT(fault([] { _exit(7); }), "fails");
}

TEST(Isolated, HoldsItsMemory) {
  const IsolationLimits limits{.memory_bytes = 64 << 20, .cpu_s = 5};
  const auto take = [](size_t bytes) { return std::string(bytes, 'x').substr(0, 1); };
  EXPECT_EQ(run_isolated([&] { return take(16 << 20); }, limits).bytes, "x");
  EXPECT_EQ(run_isolated([&] { return take(1 << 30); }, limits).fault,
            isolation_counts_memory() ? "needs more than 64 MB of memory" : "fails");
  EXPECT_EQ(run_isolated(
                [&] {
                  allow_isolated_memory(uint64_t{1} << 30);
                  return take(100 << 20);
                },
                limits)
                .bytes,
            "x");
}

}  // namespace
}  // namespace pilesim

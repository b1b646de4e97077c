#include "core/checkpoint_file.h"

#include <array>
#include <cstring>
#include <string_view>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/hash.h"

namespace pilesim {
namespace {

// A line of text, so that a reader of the file recognises it.
constexpr std::string_view kMagic = "pilesim checkpoint\n";
// Version of the frame, the key, and the parts that RunCheckpoint also reads of runs of other
// builds: whether it is done, its scene file and its bodies. Raise it with every change of those.
// The program's hash in the key guards all that a program saves for itself alone.
constexpr uint32_t kVersion = 14;

[[noreturn]] void refuse(const std::filesystem::path& file, std::string found, std::string expected,
                         std::string remedy) {
  throw Error(ErrorKind::input, Problem{.file = file.string(),
                                        .found = std::move(found),
                                        .expected = std::move(expected),
                                        .remedy = std::move(remedy)});
}

constexpr char kStartAgain[] = "Start the run again, with --force and without --resume";

}  // namespace

std::string program_hash() { return content_hash(read_file("/proc/self/exe")); }

void write_checkpoint(const std::filesystem::path& file, const CheckpointKey& key,
                      std::span<const std::byte> state) {
  StateWriter head;
  head(kVersion, key, uint64_t{state.size()});
  // States are large: no copy of theirs.
  const std::array parts = {std::as_bytes(std::span(kMagic)), head.bytes(), state};
  Hasher hasher;
  for (const auto& part : parts) hasher.add(part);
  const Checksum checksum = hasher.checksum();
  write_parts_atomically(file, {parts[0], parts[1], parts[2], std::as_bytes(std::span(checksum))});
}

Checkpoint::Checkpoint(const std::filesystem::path& file) : file_(file), bytes_(read_file(file)) {
  const std::span<const std::byte> all = std::as_bytes(std::span(bytes_));
  if (!std::string_view(bytes_).starts_with(kMagic)) {
    refuse(file, "is no checkpoint", "a file that pilesim wrote", kStartAgain);
  }
  StateReader reader(all.subspan(kMagic.size()));
  try {
    uint32_t version = 0;
    reader(version);
    if (version != kVersion) {
      refuse(file, "is of version " + std::to_string(version),
             "version " + std::to_string(kVersion), kStartAgain);
    }
    uint64_t size = 0;
    reader(key_, size);
    StateReader::require(reader.left() == size + sizeof(Checksum), "a whole file");
    const std::span<const std::byte> checked = all.first(all.size() - sizeof(Checksum));
    const Checksum checksum = checksum_of(checked);
    StateReader::require(
        std::memcmp(all.last(sizeof(Checksum)).data(), checksum.data(), sizeof(Checksum)) == 0,
        "bytes with their checksum");
    state_ = checked.last(size);
  } catch (const Error& error) {
    if (!error.problems().front().file.empty()) throw;
    refuse(file, "is damaged", error.problems().front().expected, kStartAgain);
  }
}

void Checkpoint::require(const CheckpointKey& wanted) const {
  if (key_.command != wanted.command) {
    refuse(file_, "is of pilesim " + key_.command, "one of pilesim " + wanted.command,
           "Resume with the command that the run began with");
  }
  if (key_.scene != wanted.scene) {
    refuse(file_, "is of another scene or of other options",
           "one of this scene, its files and these options",
           "Resume with all as it was when the work began, or start again with --force");
  }
  if (key_.start != wanted.start) {
    refuse(file_, "is of a run that began from another state", "the same --from, or none as then",
           "Resume with the --from that the run began with, or start again with --force");
  }
  if (key_.program != wanted.program) {
    refuse(file_, "was written by another build of pilesim", "one by this program",
           "Resume with the program that the run began with, or start again with --force");
  }
}

}  // namespace pilesim

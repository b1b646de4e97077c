// The frame of a file that long work is resumed from: a magic word, a version, the kind of work,
// the state, a checksum over all. It is written beside its place and renamed, so that a process
// that is killed leaves the one before.
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/state_stream.h"

namespace pilesim {

// Identifies the run that a state belongs to. A refusal names the difference.
struct CheckpointKey {
  std::string command;  // "simulate"
  std::string program;  // hash of the executable: states are laid out as it lays them out
  std::string scene;    // hash of the scene, its files and all else that the work depends on
  std::string start;    // hash of the state that it began from; empty: of the scene alone

  static void fields(auto& self, auto& stream) {
    stream(self.command, self.program, self.scene, self.start);
  }
};

// Hash of the running executable.
std::string program_hash();

// Throws Error(io); the file before is still there then.
void write_checkpoint(const std::filesystem::path& file, const CheckpointKey& key,
                      std::span<const std::byte> state);

class Checkpoint {
 public:
  // Throws Error(io), or Error(input) for a file of another format or version, and for one that is
  // damaged.
  explicit Checkpoint(const std::filesystem::path& file);

  const std::filesystem::path& path() const { return file_; }
  const CheckpointKey& key() const { return key_; }
  // Throws Error(input), with the reason, where the state is not one of `wanted`.
  void require(const CheckpointKey& wanted) const;
  std::span<const std::byte> state() const { return state_; }

 private:
  std::filesystem::path file_;
  std::string bytes_;
  CheckpointKey key_;
  std::span<const std::byte> state_;  // in bytes_
};

}  // namespace pilesim

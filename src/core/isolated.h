// Work that may crash, hang or take all memory, such as other people's readers of other people's
// files, in a process of its own.
#pragma once

#include <cstdint>
#include <functional>
#include <string>

namespace pilesim {

struct IsolationLimits {
  uint64_t memory_bytes = 0;  // beyond the memory of this process
  int cpu_s = 0;              // processor time, > 0; against endless work, far above all other work
};

struct IsolatedResult {
  std::string bytes;  // the result of the work
  // Empty, or why there are no bytes: "needs more than 256 MB of memory", "crashes (Segmentation
  // fault)", ...
  std::string fault;
};

// Runs `work` in a forked copy of this process, quietly, and gives its result. It sees all memory
// of the caller as it is now and changes none of it; it may use this thread only. Throws Error(io)
// where no process can be started.
IsolatedResult run_isolated(const std::function<std::string()>& work,
                            const IsolationLimits& limits);

// Within the work: lets it take so many bytes more.
void allow_isolated_memory(uint64_t bytes);

// False in programs with sanitizers, whose address space is their own: there the limit on memory
// holds for single allocations, such as an array of a length that a file claims, and work that goes
// beyond it "fails".
bool isolation_counts_memory();

}  // namespace pilesim

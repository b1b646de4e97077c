// Progress of long work, on stderr.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>

namespace pilesim {

// automatic: a bar where stderr is a terminal, nothing elsewhere. json: one object a line.
enum class ProgressMode { automatic, bar, json, none };

class Progress {
 public:
  // `total` > 0 units of work, called `unit` ("frames").
  Progress(ProgressMode mode, std::string label, uint64_t total, std::string unit);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  // `done` units of `total` are complete. Cheap: draws at most ten times a second.
  void update(uint64_t done);
  // Ends the line. Called by the destructor if not before.
  void finish();

 private:
  void draw(uint64_t done);

  ProgressMode mode_;
  std::string label_;
  uint64_t total_;
  std::string unit_;
  uint64_t done_ = 0;
  bool drawn_ = false;
  std::chrono::steady_clock::time_point start_;
  std::chrono::steady_clock::time_point last_draw_;
};

}  // namespace pilesim

// Where results go: a directory that may hold the user's own files beside those of pilesim. Only
// entries with the names below are ever replaced or removed.
#pragma once

#include <filesystem>
#include <span>
#include <string_view>
#include <vector>

namespace pilesim {

// Paths below an output directory; in the last part a '*' stands for digits.
inline constexpr std::string_view kSheetFile = "sheet.png";
inline constexpr std::string_view kVideoFile = "video.mp4";
inline constexpr std::string_view kViewFile = "view.html";
inline constexpr std::string_view kFrameFiles = "frames/frame.*.png";
inline constexpr std::string_view kFilmFiles = "films/frame.*.film";
inline constexpr std::string_view kRenderCheckpointFile = "render_checkpoint.bin";
inline constexpr std::string_view kCamerasFile = "cameras.json";
inline constexpr std::string_view kCocoFile = "coco.json";
// All that `pilesim simulate` replaces: its own files, and pictures, which show another run then.
inline constexpr std::string_view kSimulationEntries[] = {"trajectory.zarr",
                                                          "timing.csv",
                                                          "checkpoint.bin",
                                                          "report.json",
                                                          "report.html",
                                                          "piles.json",
                                                          "guide.json",
                                                          "finishing.bin",
                                                          "finishing.zarr",
                                                          "simulated.zarr",
                                                          kFrameFiles,
                                                          kFilmFiles,
                                                          kVideoFile,
                                                          kSheetFile,
                                                          kRenderCheckpointFile,
                                                          kViewFile,
                                                          kCamerasFile,
                                                          kCocoFile,
                                                          "passes",
                                                          "bop",
                                                          "cameras"};

// The entries of `directory` with a name of `own`, ordered. Touches nothing. Throws Error(usage)
// where `directory` is empty text or "-", or where there is such an entry and `force` is false (the
// message names --force), and Error(io) where it is no directory, has a name that is too long or
// cannot be written to.
std::vector<std::filesystem::path> claim_output(const std::filesystem::path& directory,
                                                std::span<const std::string_view> own, bool force);

// For a single file of results: throws Error(usage) for a name that is empty or "-", a path that is
// no regular file and, without `force`, a file that exists. Throws Error(io) for a directory, a
// name that is too long and a place where nothing can be written. Touches nothing.
void claim_output_file(const std::filesystem::path& file, bool force);

// Removes `entries`, which claim_output() gave, each in one go: temporary_file.h. Throws Error(io).
void remove_output(std::span<const std::filesystem::path> entries);

// Makes `directory` and its parents where they are missing. Throws Error(io).
void make_output_directory(const std::filesystem::path& directory);

// Held while a run is written: two that write into one directory would make neither.
class OutputLock {
 public:
  // Takes the lock, unless there is no such directory yet. Throws Error(usage) where another one
  // has it. File systems that know no locks give everyone one.
  explicit OutputLock(std::filesystem::path directory);
  ~OutputLock();
  OutputLock(const OutputLock&) = delete;
  OutputLock& operator=(const OutputLock&) = delete;

  // Makes the directory where it is missing and takes the lock if it is not held yet. Throws as
  // make_output_directory() and the constructor.
  void make_directory();

 private:
  void take();

  std::filesystem::path directory_;
  int descriptor_ = -1;
};

}  // namespace pilesim

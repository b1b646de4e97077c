// Passes of a frame as files.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <string_view>
#include <vector>

#include "render/dataset/annotations.h"
#include "render/pass_images.h"
#include "trajectory/trajectory.h"

namespace pilesim {

enum class Pass : uint8_t { depth, ids, shapes, normals, motion, visibility };

struct PassName {
  Pass pass;
  std::string_view name;
};
inline constexpr std::array<PassName, 6> kPassNames = {{{Pass::depth, "depth"},
                                                        {Pass::ids, "ids"},
                                                        {Pass::shapes, "shapes"},
                                                        {Pass::normals, "normals"},
                                                        {Pass::motion, "motion"},
                                                        {Pass::visibility, "visibility"}}};

// The files of a run below its output directory: patterns of core/output_directory.h.
inline constexpr std::array<std::string_view, 7> kPassEntries = {
    "passes/passes.json",  "passes/frame.*.exr",   "passes/depth.*.png",     "passes/ids.*.png",
    "passes/shapes.*.png", "passes/normals.*.png", "passes/visibility.*.csv"};

// Conventions and names, for all frames: passes.json. Throws Error(io).
void write_pass_conventions(const TrajectoryHeader& header, const std::vector<Pass>& passes,
                            const std::filesystem::path& directory);

// frame.####.exr with a layer a pass, and beside it PNG files of those that fit into 16 bits, and
// visibility.####.csv. Throws Error(io).
void write_passes(const TrajectoryHeader& header, const std::vector<Pass>& passes, uint64_t frame,
                  const PassImages& images, const DepthImage& depth,
                  const std::filesystem::path& directory);

}  // namespace pilesim

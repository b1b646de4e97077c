// A trajectory as a file of another program: the whole of `pilesim export`.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "export/export_source.h"

namespace pilesim {

// objects: each body an object of its own. instances: few objects that stand for many bodies.
enum class ExportForm { objects, instances };

// The format of an export, by the ending of its name.
enum class ExportFormat { usda, gltf, glb, blender, csv, npz, vat };

struct ExportJob {
  std::filesystem::path output;
  ExportChoice choice;
  std::optional<ExportForm> form;  // none: what suits the format and the number of bodies
  double aspect = 16.0 / 9;        // width of the camera's picture over its height
  // Motion that takes more bytes than about this goes into several files; none: as the format
  // suggests. Only for usda and gltf.
  std::optional<uint64_t> part_bytes;
  bool force = false;  // replace files that are there
};

struct ExportSummary {
  std::vector<std::pair<std::filesystem::path, uint64_t>> files;  // with their bytes
  size_t bodies = 0, moving = 0, frames = 0;
  ExportForm form = ExportForm::objects;
  double wall_s = 0;
};

// By the ending of its name. Throws Error(usage) for any other.
ExportFormat format_of(const std::filesystem::path& output);
// The files that are written in any case: `output`, and those beside it. Throws Error(usage) or
// Error(io) where these cannot be written, or are there and `force` is false. Touches nothing.
std::vector<std::filesystem::path> claim_export(const std::filesystem::path& output, bool force);

// Writes each file beside its place and renames it. Throws as claim_export() and ExportSource do,
// Error(usage) for what the format cannot hold, and Error(io).
ExportSummary run_export(TrajectoryReader& trajectory, const ExportJob& job);

}  // namespace pilesim

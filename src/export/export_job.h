// Exports a trajectory to a file of another program: the whole of `pilesim export`.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "export/export_source.h"

namespace pilesim {

// objects: one object per body. instances: few objects, each for many bodies.
enum class ExportForm { objects, instances };

// The format of an export, from the file name's extension.
enum class ExportFormat { usda, gltf, glb, blender, csv, npz, vat };

struct ExportJob {
  std::filesystem::path output;
  ExportChoice choice;
  std::optional<ExportForm> form;  // none: chosen by the format and the number of bodies
  double aspect = 16.0 / 9;        // aspect ratio of the camera's picture
  // Motion of more than about this many bytes is split into several files; none: the format's own
  // limit. Only for usda and gltf.
  std::optional<uint64_t> part_bytes;
  bool force = false;  // replace existing files
};

struct ExportSummary {
  std::vector<std::pair<std::filesystem::path, uint64_t>> files;  // with their sizes in bytes
  size_t bodies = 0, moving = 0, frames = 0;
  ExportForm form = ExportForm::objects;
  double wall_s = 0;
};

// From the file name's extension. Throws Error(usage) for an unknown one.
ExportFormat format_of(const std::filesystem::path& output);
// All files that are certainly written: `output` and those beside it. Throws Error(usage) or
// Error(io) if they cannot be written, or exist and `force` is false. Changes nothing.
std::vector<std::filesystem::path> claim_export(const std::filesystem::path& output, bool force);

// Writes each file beside its place and renames it. Throws as claim_export() and ExportSource do,
// Error(usage) if the format cannot hold the content, and Error(io).
ExportSummary run_export(TrajectoryReader& trajectory, const ExportJob& job);

}  // namespace pilesim

// Annotations in the format of the BOP benchmark (6D poses of objects): OpenCV's axes, millimetres.
#pragma once

#include <array>
#include <filesystem>
#include <memory>
#include <string_view>

#include "render/dataset/annotations.h"

namespace pilesim {

// The files of a run below `root`: patterns of core/output_directory.h.
inline constexpr std::array<std::string_view, 2> kBopEntries = {"models", "train_pbr/*"};

// models/obj_000001.ply ... and models_info.json below `root`: each annotated shape once, in its
// body frame, in millimetres. Objects are numbered as shapes are in the passes: from 1. Throws
// Error(io).
void write_bop_models(const TrajectoryHeader& header, const std::filesystem::path& root);

// The pictures of one camera are one scene of the dataset, train_pbr/<scene>/ below `root`.
std::unique_ptr<AnnotationWriter> make_bop_writer(const TrajectoryHeader& header,
                                                  const std::filesystem::path& root, int scene);

}  // namespace pilesim

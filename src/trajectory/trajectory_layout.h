// Names and shapes in a trajectory store, shared by writer and reader.
#pragma once

#include <cstdint>
#include <filesystem>

#include "trajectory/zarr_array.h"

namespace pilesim::trajectory_layout {

inline constexpr char kFormat[] = "pilesim-trajectory";
// Readers accept only this version. Raise it with every change that old readers would misread.
inline constexpr int kVersion = 3;

// Frames per chunk of the position, orientation and state arrays.
uint64_t frames_per_chunk(uint64_t body_count);

ZarrLayout position(uint64_t body_count);
ZarrLayout orientation(uint64_t body_count);
ZarrLayout state(uint64_t body_count);
ZarrLayout body_shape();
ZarrLayout body_material();
ZarrLayout body_colour();
ZarrLayout body_painted();
ZarrLayout body_gloss();
ZarrLayout body_substance();
ZarrLayout body_pattern();
ZarrLayout body_moves();
ZarrLayout vertices();
ZarrLayout triangles();
ZarrLayout colours();
ZarrLayout texture_of();
ZarrLayout texture_corners();
ZarrLayout texture(uint64_t columns);

std::filesystem::path shape_directory(const std::filesystem::path& store, size_t index);
std::filesystem::path texture_directory(const std::filesystem::path& store, size_t index);

}  // namespace pilesim::trajectory_layout

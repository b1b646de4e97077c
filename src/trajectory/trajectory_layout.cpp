#include "trajectory/trajectory_layout.h"

#include <algorithm>

namespace pilesim::trajectory_layout {

// 2 MiB of orientations: bodies at rest repeat within zstd's window, a jump to a frame decodes
// little, and rewriting an incomplete chunk takes milliseconds. At most 256 frames, so that readers
// of a few bodies need not decode hours of zeros.
uint64_t frames_per_chunk(uint64_t body_count) {
  constexpr uint64_t kChunkBytes = 2 << 20;
  constexpr uint64_t kMostFrames = 256;
  const uint64_t frame_bytes = std::max<uint64_t>(1, orientation(body_count).row_bytes());
  return std::clamp<uint64_t>(kChunkBytes / frame_bytes, 1, kMostFrames);
}

ZarrLayout position(uint64_t body_count) { return {"<f8", {body_count, 3}}; }
ZarrLayout orientation(uint64_t body_count) { return {"<f4", {body_count, 4}}; }
ZarrLayout state(uint64_t body_count) { return {"|u1", {body_count}}; }
ZarrLayout body_shape() { return {"<u4", {}}; }
ZarrLayout body_material() { return {"<u4", {}}; }
ZarrLayout body_colour() { return {"|u1", {3}}; }
ZarrLayout body_painted() { return {"|u1", {}}; }
ZarrLayout body_gloss() { return {"<f4", {2}}; }
ZarrLayout body_substance() { return {"<f4", {3}}; }
ZarrLayout body_pattern() { return {"<f4", {2}}; }
ZarrLayout body_moves() { return {"|u1", {}}; }
ZarrLayout vertices() { return {"<f4", {3}}; }
ZarrLayout triangles() { return {"<u4", {3}}; }
ZarrLayout colours() { return {"|u1", {3}}; }
ZarrLayout texture_of() { return {"<u4", {}}; }
ZarrLayout texture_corners() { return {"<f4", {3, 2}}; }
ZarrLayout texture(uint64_t columns) { return {"|u1", {columns, 3}}; }

std::filesystem::path shape_directory(const std::filesystem::path& store, size_t index) {
  return store / "shapes" / std::to_string(index);
}

std::filesystem::path texture_directory(const std::filesystem::path& store, size_t index) {
  return store / "textures" / std::to_string(index);
}

}  // namespace pilesim::trajectory_layout

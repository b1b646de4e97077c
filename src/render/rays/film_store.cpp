#include "render/rays/film_store.h"

#include <zstd.h>

#include <cassert>
#include <cstring>
#include <span>
#include <utility>
#include <vector>

#include "core/error.h"
#include "core/hash.h"
#include "core/naming.h"
#include "render/render_job.h"
#include "scene/scene_loader.h"

namespace pilesim {
namespace {

namespace fs = std::filesystem;

// Only exponents repeat in sums of samples: higher levels gain a percent.
constexpr int kZstdLevel = 1;

// The first bytes of all numbers, then all second ones, and so on: like stands by like.
template <class T>
std::vector<std::byte> packed(const std::vector<T>& plane) {
  static_assert(sizeof(T) == 4);
  const size_t count = plane.size();
  const auto* bytes = reinterpret_cast<const std::byte*>(plane.data());
  std::vector<std::byte> sorted(4 * count);
  for (size_t i = 0; i < count; ++i) {
    for (size_t k = 0; k < 4; ++k) sorted[k * count + i] = bytes[4 * i + k];
  }
  std::vector<std::byte> result(ZSTD_compressBound(sorted.size()));
  const size_t size =
      ZSTD_compress(result.data(), result.size(), sorted.data(), sorted.size(), kZstdLevel);
  assert(!ZSTD_isError(size));  // the room is enough by ZSTD_compressBound
  result.resize(size);
  return result;
}

// `plane` has its size.
template <class T>
void unpack(std::span<const std::byte> from, std::vector<T>& plane) {
  const size_t count = plane.size();
  std::vector<std::byte> sorted(4 * count);
  const size_t size = ZSTD_decompress(sorted.data(), sorted.size(), from.data(), from.size());
  StateReader::require(size == sorted.size(), "a number for each pixel");  // errors are huge
  auto* bytes = reinterpret_cast<std::byte*>(plane.data());
  for (size_t i = 0; i < count; ++i) {
    for (size_t k = 0; k < 4; ++k) bytes[4 * i + k] = sorted[k * count + i];
  }
}

void add(StateWriter& work, const TrajectoryFrame* frame, const CameraKey& camera) {
  work(frame != nullptr);
  if (frame == nullptr) return;
  work(frame->position, frame->orientation, frame->state);
  work(camera.position, camera.target, camera.field_of_view, camera.roll, camera.lens_shift);
}

}  // namespace

FilmStore::FilmStore(FilmPlace place, const TrajectoryHeader& header,
                     const RenderSettings& settings, BodyColours colours)
    : place_(std::move(place)), program_(program_hash()) {
  RenderSettings light = settings;
  light.rays.samples.reset();
  StateWriter work;
  work(header.scene_hash, header.resolved_scene, settings_text(light), static_cast<int>(colours));
  work_ = content_hash(work.bytes());
}

fs::path FilmStore::file_of(const DrawnFrame& drawn) const {
  return film_file(place_.output, drawn.index);
}

CheckpointKey FilmStore::key_of(const DrawnFrame& drawn) const {
  StateWriter work;
  work(work_, drawn.index);
  add(work, drawn.before, drawn.camera_before);
  add(work, drawn.frame, drawn.camera);
  add(work, drawn.after, drawn.camera_after);
  return {
      .command = "render", .program = program_, .scene = content_hash(work.bytes()), .start = ""};
}

void FilmStore::load(const DrawnFrame& drawn, uint32_t samples, Film& film) const {
  const fs::path file = file_of(drawn);
  if (!place_.go_on || !fs::exists(file)) return;
  const Checkpoint checkpoint(file);
  checkpoint.require(key_of(drawn));
  naming(file.string(), [&] {
    StateReader reader(checkpoint.state());
    std::vector<std::byte> plane;
    reader(film.samples);
    for (std::vector<float>* sums : film.planes()) {
      reader(plane);
      unpack(plane, *sums);
    }
    reader(plane);
    unpack(plane, film.body);
    StateReader::require(reader.left() == 0, "no more bytes");
  });
  if (film.samples <= samples) return;
  throw Error(ErrorKind::input,
              Problem{.file = file.string(),
                      .found = "holds " + std::to_string(film.samples) + " samples a pixel",
                      .expected = "at most " + std::to_string(samples) + ", as was asked for",
                      .remedy = "Ask for --samples " + std::to_string(film.samples) +
                                " or more, or begin again with --force in place of --resume"});
}

void FilmStore::save(const DrawnFrame& drawn, const Film& film) const {
  StateWriter writer;
  writer(film.samples);
  for (const std::vector<float>* sums : film.planes()) writer(packed(*sums));
  writer(packed(film.body));
  write_checkpoint(file_of(drawn), key_of(drawn), writer.bytes());
}

}  // namespace pilesim

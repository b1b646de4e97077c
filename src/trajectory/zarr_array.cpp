#include "trajectory/zarr_array.h"

#include <zstd.h>

#include <cassert>
#include <memory>
#include <nlohmann/json.hpp>

#include "core/atomic_file.h"
#include "core/error.h"
#include "json/json_text.h"

namespace pilesim {
namespace fs = std::filesystem;
using nlohmann::ordered_json;

namespace {

// docs/files.md compares level 1 with others.
constexpr int kZstdLevel = 1;
// Varying rows, such as a mesh's, do not compress by more than this factor.
constexpr uint64_t kMostExpansion = 1000;
constexpr char kRemedy[] = "Run the simulation again; a trajectory is not mended by hand";

[[noreturn]] void reject(const fs::path& file, std::string found, std::string expected) {
  throw Error(ErrorKind::input, Problem{.file = file.string(),
                                        .found = std::move(found),
                                        .expected = std::move(expected),
                                        .remedy = kRemedy});
}

[[noreturn]] void reject_missing(const fs::path& file) {
  throw Error(ErrorKind::input, Problem{.file = file.string(),
                                        .found = "is missing from the trajectory",
                                        .remedy = "Copy the whole directory again, or run the "
                                                  "simulation again"});
}

uint64_t dtype_bytes(const std::string& dtype) { return dtype.back() - '0'; }

ordered_json dimensions(uint64_t rows, const ZarrLayout& layout) {
  ordered_json all = ordered_json::array({rows});
  for (const uint64_t extent : layout.row_shape) all.push_back(extent);
  return all;
}

// Zarr forbids empty chunks, even in empty arrays.
ordered_json chunk_dimensions(const ZarrArray& array) {
  ordered_json all = dimensions(array.rows_per_chunk, array.layout);
  for (ordered_json& extent : all) extent = std::max<uint64_t>(1, extent);
  return all;
}

ordered_json metadata(const ZarrArray& array) {
  ordered_json json;
  json["zarr_format"] = 2;
  json["shape"] = dimensions(array.rows, array.layout);
  json["chunks"] = chunk_dimensions(array);
  json["dtype"] = array.layout.dtype;
  json["order"] = "C";
  json["fill_value"] = 0;
  json["compressor"] = {{"id", "zstd"}, {"level", kZstdLevel}};
  json["filters"] = nullptr;
  return json;
}

// The parent must exist: a store removed in the meantime must not reappear without its other
// content.
void make_directory(const fs::path& directory) {
  std::error_code fault;
  fs::create_directory(directory, fault);
  if (fault) throw io_error(directory.string(), "cannot be created", fault.value());
}

std::vector<std::byte> compress(std::span<const std::byte> bytes) {
  const std::unique_ptr<ZSTD_CCtx, size_t (*)(ZSTD_CCtx*)> context(ZSTD_createCCtx(),
                                                                   ZSTD_freeCCtx);
  ZSTD_CCtx_setParameter(context.get(), ZSTD_c_compressionLevel, kZstdLevel);
  ZSTD_CCtx_setParameter(context.get(), ZSTD_c_checksumFlag, 1);
  std::vector<std::byte> packed(ZSTD_compressBound(bytes.size()));
  const size_t size =
      ZSTD_compress2(context.get(), packed.data(), packed.size(), bytes.data(), bytes.size());
  assert(!ZSTD_isError(size));  // ZSTD_compressBound guarantees the room
  packed.resize(size);
  return packed;
}

void require_file(const fs::path& file) {
  std::error_code fault;
  if (!fs::exists(file, fault)) reject_missing(file);
}

// Bound on a number of rows or an extent, so that products of them do not overflow.
constexpr uint64_t kMostExtent = uint64_t{1} << 32;
uint64_t extent_of(const ordered_json& value) {
  return value.is_number_unsigned() ? std::min(value.get<uint64_t>(), kMostExtent) : kMostExtent;
}

}  // namespace

uint64_t ZarrLayout::row_bytes() const {
  uint64_t bytes = dtype_bytes(dtype);
  for (const uint64_t extent : row_shape) bytes *= extent;
  return bytes;
}

fs::path ZarrArray::chunk_file(uint64_t index) const {
  std::string name = std::to_string(index);
  for (size_t axis = 0; axis < layout.row_shape.size(); ++axis) name += ".0";
  return directory / name;
}

void write_zarr_json(const fs::path& file, const ordered_json& json) {
  write_file_atomically(file, json.dump(1, ' ', /*ensure_ascii=*/true) + "\n");
}

void create_zarr_group(const fs::path& directory) {
  make_directory(directory);
  write_zarr_json(directory / ".zgroup", {{"zarr_format", 2}});
}

void create_zarr_array(const ZarrArray& array, const std::vector<std::string>& names,
                       const std::string& meaning) {
  assert(array.rows_per_chunk >= 1);
  assert(names.size() == array.layout.row_shape.size() + 1);
  make_directory(array.directory);
  ordered_json attributes;
  attributes["_ARRAY_DIMENSIONS"] = names;
  attributes["meaning"] = meaning;
  write_zarr_json(array.directory / ".zattrs", attributes);
  write_zarr_shape(array);
}

void write_zarr_chunk(const ZarrArray& array, uint64_t index, std::span<const std::byte> rows) {
  assert(rows.size() <= array.chunk_bytes());
  if (array.chunk_bytes() == 0) return;  // no numbers, no chunks
  if (rows.size() == array.chunk_bytes()) {
    write_file_atomically(array.chunk_file(index), compress(rows));
    return;
  }
  std::vector<std::byte> padded(rows.begin(), rows.end());
  padded.resize(array.chunk_bytes());
  write_file_atomically(array.chunk_file(index), compress(padded));
}

void write_zarr_shape(const ZarrArray& array) {
  write_zarr_json(array.directory / ".zarray", metadata(array));
}

ordered_json read_zarr_json(const fs::path& file) {
  require_file(file);
  ordered_json json = read_json_file(file);
  if (!json.is_object()) reject(file, "is not a JSON object", "one");
  return json;
}

ZarrArray open_zarr_array(const fs::path& directory, const ZarrLayout& expected,
                          uint64_t most_rows_per_chunk) {
  const fs::path file = directory / ".zarray";
  const ordered_json found = read_zarr_json(file);
  const auto list = [&](const char* key) {
    ordered_json value = found.value(key, ordered_json());
    if (!value.is_array() || value.size() != expected.row_shape.size() + 1) {
      reject(file, std::string(key) + " is " + value.dump(),
             std::to_string(expected.row_shape.size() + 1) + " numbers");
    }
    return value;
  };
  ZarrArray array{.directory = directory, .layout = expected};
  array.rows = extent_of(list("shape")[0]);
  array.rows_per_chunk = std::max<uint64_t>(1, extent_of(list("chunks")[0]));
  if (array.rows_per_chunk > most_rows_per_chunk) {
    reject(file, "has chunks of " + std::to_string(array.rows_per_chunk) + " rows",
           "at most " + std::to_string(most_rows_per_chunk));
  }
  // All other members have only one valid form.
  const ordered_json written = metadata(array);
  for (const auto& [key, value] : written.items()) {
    if (key == "compressor") {
      const ordered_json compressor = found.value(key, ordered_json());
      if (!compressor.is_object() || compressor.value("id", ordered_json()) != "zstd") {
        reject(file, "compressor is " + compressor.dump(), "zstd");
      }
    } else if (found.value(key, ordered_json("missing")) != value) {
      reject(file, key + " is " + found.value(key, ordered_json("missing")).dump(), value.dump());
    }
  }
  return array;
}

void read_zarr_chunk(const ZarrArray& array, uint64_t index, std::vector<std::byte>& bytes) {
  if (array.chunk_bytes() == 0) {
    bytes.clear();
    return;
  }
  const fs::path file = array.chunk_file(index);
  require_file(file);
  const std::string packed = read_file(file);
  const std::string expected = "a zstd frame of " + std::to_string(array.chunk_bytes()) + " bytes";
  // Check before allocating memory for it.
  const unsigned long long size = ZSTD_getFrameContentSize(packed.data(), packed.size());
  if (size == ZSTD_CONTENTSIZE_ERROR || size == ZSTD_CONTENTSIZE_UNKNOWN) {
    reject(file, "is corrupt: not a zstd frame", expected);
  }
  if (size != array.chunk_bytes()) {
    reject(file, "holds " + std::to_string(size) + " bytes", expected);
  }
  bytes.resize(size);
  const size_t result = ZSTD_decompress(bytes.data(), bytes.size(), packed.data(), packed.size());
  if (ZSTD_isError(result)) {
    reject(file, std::string("is corrupt: ") + ZSTD_getErrorName(result), expected);
  }
}

ZarrArray open_whole_zarr_array(const fs::path& directory, const ZarrLayout& expected) {
  ZarrArray array = open_zarr_array(directory, expected, kMostExtent);
  if (array.rows_per_chunk != std::max<uint64_t>(1, array.rows)) {
    reject(directory / ".zarray",
           "cuts " + std::to_string(array.rows) + " rows into chunks of " +
               std::to_string(array.rows_per_chunk),
           "a single chunk");
  }
  return array;
}

std::vector<std::byte> read_zarr_rows(const ZarrArray& array, bool known_rows) {
  std::vector<std::byte> bytes;
  if (array.rows == 0) return bytes;
  if (!known_rows) {
    std::error_code fault;  // read_zarr_chunk() reports a missing file
    const uint64_t packed = fs::file_size(array.chunk_file(0), fault);
    if (!fault && array.chunk_bytes() / kMostExpansion > packed) {
      reject(array.chunk_file(0), "holds " + std::to_string(packed) + " bytes",
             "the " + std::to_string(array.rows) + " rows that .zarray tells of");
    }
  }
  read_zarr_chunk(array, 0, bytes);
  return bytes;
}

}  // namespace pilesim

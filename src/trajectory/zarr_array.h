// The part of Zarr v2 (https://zarr-specs.readthedocs.io, "Zarr storage specification version 2")
// that trajectories use: arrays in a directory store, C order, little-endian, chunked along their
// first axis only ("rows"). Each chunk is one zstd frame with a checksum.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>
#include <vector>

namespace pilesim {

struct ZarrLayout {
  std::string dtype;                // "<f4", "<u4" or "|u1"
  std::vector<uint64_t> row_shape;  // axes after the first; empty: a row is one number

  uint64_t row_bytes() const;
};

struct ZarrArray {
  std::filesystem::path directory;
  ZarrLayout layout;
  uint64_t rows_per_chunk = 1;  // >= 1
  uint64_t rows = 0;

  uint64_t chunk_bytes() const { return rows_per_chunk * layout.row_bytes(); }
  // The file of rows [index * rows_per_chunk, (index + 1) * rows_per_chunk).
  std::filesystem::path chunk_file(uint64_t index) const;
};

// Writing. All functions throw Error(io).

// Writes a JSON file of the store in ASCII, since Debian's python3-zarr reads nothing else.
void write_zarr_json(const std::filesystem::path& file, const nlohmann::ordered_json& json);
// Creates a group at `directory`, whose parent must exist.
void create_zarr_group(const std::filesystem::path& directory);
// Creates the directory of `array`, whose parent must exist, with its metadata. `dimensions` are
// the names of its axes, which xarray reads from the attributes; `meaning` is for people.
void create_zarr_array(const ZarrArray& array, const std::vector<std::string>& dimensions,
                       const std::string& meaning);
// `rows`: at most one chunk of rows; zeros fill the rest.
void write_zarr_chunk(const ZarrArray& array, uint64_t index, std::span<const std::byte> rows);
// Publishes array.rows atomically: readers see either the old number or the new one.
void write_zarr_shape(const ZarrArray& array);

// Reading. Functions throw Error(io) if a file cannot be read, and Error(input) that names the file
// if it is missing or not as expected.

// Reads a JSON file of the store.
nlohmann::ordered_json read_zarr_json(const std::filesystem::path& file);
// `most_rows_per_chunk`: the writer's limit, which bounds the memory for a chunk.
ZarrArray open_zarr_array(const std::filesystem::path& directory, const ZarrLayout& expected,
                          uint64_t most_rows_per_chunk);
// Reads chunk_bytes() bytes.
void read_zarr_chunk(const ZarrArray& array, uint64_t index, std::vector<std::byte>& bytes);

// Opens an array that is a single chunk.
ZarrArray open_whole_zarr_array(const std::filesystem::path& directory, const ZarrLayout& expected);
// All rows of an array, as bytes. `known_rows`: their number is known from elsewhere; otherwise it
// is limited to what varying numbers can take when compressed.
std::vector<std::byte> read_zarr_rows(const ZarrArray& array, bool known_rows);

// The same as values of T: numbers, or a std::array of them per row.
template <typename T>
std::vector<T> read_zarr_values(const ZarrArray& array, bool known_rows) {
  const std::vector<std::byte> bytes = read_zarr_rows(array, known_rows);
  std::vector<T> values(bytes.size() / sizeof(T));
  if (!values.empty()) std::memcpy(static_cast<void*>(values.data()), bytes.data(), bytes.size());
  return values;
}

}  // namespace pilesim

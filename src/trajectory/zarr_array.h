// The part of Zarr v2 (https://zarr-specs.readthedocs.io, "Zarr storage specification version 2")
// that a trajectory uses: arrays in a directory store, C order, little-endian, cut into chunks
// along their first axis only ("rows"), each chunk one zstd frame with a checksum.
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

// Writing. All of it throws Error(io).

// A JSON file of the store. In ASCII, which is all that Debian's python3-zarr reads.
void write_zarr_json(const std::filesystem::path& file, const nlohmann::ordered_json& json);
// Makes `directory`, whose parent is there, a group.
void create_zarr_group(const std::filesystem::path& directory);
// Makes the directory of `array`, whose parent is there, and describes it: `dimensions` are the
// names of its axes, which xarray takes from the attributes; `meaning` is for people.
void create_zarr_array(const ZarrArray& array, const std::vector<std::string>& dimensions,
                       const std::string& meaning);
// `rows`: at most a chunk of them, the rest is filled with zeros.
void write_zarr_chunk(const ZarrArray& array, uint64_t index, std::span<const std::byte> rows);
// Makes array.rows known to readers. In one go: readers see the old number or the new one.
void write_zarr_shape(const ZarrArray& array);

// Reading. Throws Error(io) where a file cannot be read and Error(input), naming the file, where it
// is missing or not as expected.

// A JSON file of the store.
nlohmann::ordered_json read_zarr_json(const std::filesystem::path& file);
// `most_rows_per_chunk`: what writers keep to, which bounds the memory that a chunk takes.
ZarrArray open_zarr_array(const std::filesystem::path& directory, const ZarrLayout& expected,
                          uint64_t most_rows_per_chunk);
// chunk_bytes() of them.
void read_zarr_chunk(const ZarrArray& array, uint64_t index, std::vector<std::byte>& bytes);

// An array that is a single chunk.
ZarrArray open_whole_zarr_array(const std::filesystem::path& directory, const ZarrLayout& expected);
// All rows of one, as they lie. `known_rows`: that their number is known from elsewhere; else it is
// held to what numbers that differ can take when compressed.
std::vector<std::byte> read_zarr_rows(const ZarrArray& array, bool known_rows);

// The same as values of T: numbers, or a std::array of them for a row.
template <typename T>
std::vector<T> read_zarr_values(const ZarrArray& array, bool known_rows) {
  const std::vector<std::byte> bytes = read_zarr_rows(array, known_rows);
  std::vector<T> values(bytes.size() / sizeof(T));
  if (!values.empty()) std::memcpy(static_cast<void*>(values.data()), bytes.data(), bytes.size());
  return values;
}

}  // namespace pilesim

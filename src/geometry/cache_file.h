// Results computed from a mesh, kept from one run to the next, one file each.
#pragma once

#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "core/hash.h"
#include "geometry/mesh.h"

namespace pilesim {

// Where all of them are: $XDG_CACHE_HOME/pilesim, else ~/.cache/pilesim; none if neither is known
// or writable.
std::optional<std::filesystem::path> user_cache_directory();

class CacheFile {
 public:
  // Called `kind`-`key`.cbor; the key is the hash of all that the content follows from. `directory`
  // is made when something is stored.
  CacheFile(const std::filesystem::path& directory, const std::string& kind,
            const std::string& key);

  // Hands the content to `take`. False: there is no such file, it is not whole, or `take` found
  // something else in it (threw Error or json::exception).
  bool load(const std::function<void(const nlohmann::json&)>& take) const;
  // Written beside its place and renamed: safe with other processes that do the same. Throws
  // Error(io).
  void store(const nlohmann::json& content) const;
  const std::filesystem::path& path() const { return file_; }

 private:
  std::filesystem::path file_;
};

// Held by one process at a time: what is missing is computed once. Ends with the process, however
// that ends; where the file system has no locks, all hold it.
class CacheLock {
 public:
  // Waits for the other that holds it, after a call of `before_waiting`. Throws Error(interrupted).
  CacheLock(const CacheFile& file, const std::function<void()>& before_waiting);
  ~CacheLock();
  CacheLock(const CacheLock&) = delete;
  CacheLock& operator=(const CacheLock&) = delete;

 private:
  std::filesystem::path path_;
  int descriptor_ = -1;
};

// The vertices, triangles and groups of a mesh, for a key.
void add_mesh(Hasher& key, const TriangleMesh& mesh);

// Vertices and triangles, bit by bit.
nlohmann::json to_cached(const TriangleMesh& mesh);
// Throws Error(input) or json::exception where it is no result of to_cached().
TriangleMesh mesh_from_cached(const nlohmann::json& value);

}  // namespace pilesim

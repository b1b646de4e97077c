// Solids that took time to make, kept from one run to the next.
#pragma once

#include <filesystem>
#include <optional>

#include "geometry/cache_file.h"
#include "geometry/solid.h"

namespace pilesim {

class SolidCache {
 public:
  // Named by the hash of the mesh, its groups and rounding, the options and the version of the
  // algorithm.
  SolidCache(const std::filesystem::path& directory, const TriangleMesh& mesh,
             const SolidOptions& options);

  // As those of CacheFile; of solids that are mended or wrapped.
  std::optional<Solid> load() const;
  void store(const Solid& solid) const;
  const std::filesystem::path& file() const { return file_.path(); }

 private:
  CacheFile file_;
};

}  // namespace pilesim

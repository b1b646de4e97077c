// Decompositions kept from one run to the next.
#pragma once

#include <filesystem>
#include <optional>

#include "geometry/cache_file.h"
#include "geometry/convex_decomposition.h"

namespace pilesim {

class DecompositionCache {
 public:
  // Named by the hash of the mesh, its groups, the options and the version of the algorithm.
  DecompositionCache(const std::filesystem::path& directory, const TriangleMesh& mesh,
                     const DecompositionOptions& options);

  // As those of CacheFile.
  std::optional<Decomposition> load() const;
  void store(const Decomposition& decomposition) const;
  const std::filesystem::path& file() const { return file_.path(); }

 private:
  CacheFile file_;
};

}  // namespace pilesim

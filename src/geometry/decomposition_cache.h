// Decompositions kept from one run to the next, one file each.
#pragma once

#include <filesystem>
#include <optional>

#include "geometry/convex_decomposition.h"

namespace pilesim {

class DecompositionCache {
 public:
  // `directory` is made when something is stored.
  DecompositionCache(const std::filesystem::path& directory, const TriangleMesh& mesh,
                     const DecompositionOptions& options);

  // Named by the hash of the mesh, its groups, the options and the version of the algorithm.
  const std::filesystem::path& file() const { return file_; }
  // No value: there is no such file, or it is not whole.
  std::optional<Decomposition> load() const;
  // Written beside its place and renamed: safe with other processes that do the same. Throws
  // Error(io).
  void store(const Decomposition& decomposition) const;

 private:
  std::filesystem::path file_;
};

}  // namespace pilesim

#include <gtest/gtest.h>

#include "support/geometry_concave_shapes.h"
#include "core/parallel_for.h"
#include "geometry/convex_decomposition.h"

namespace pilesim {
namespace {

std::string fingerprint(const Decomposition& decomposition) {
  std::string text;
  for (const TriangleMesh& piece : decomposition.pieces) text += mesh_hash(piece);
  for (const double value : {decomposition.union_volume_m3, decomposition.excess_volume_m3,
                             decomposition.missing_volume_m3, decomposition.surface_error_m,
                             decomposition.mean_surface_error_m}) {
    text.append(reinterpret_cast<const char*>(&value), sizeof value);
  }
  return text;
}

TEST(DecompositionDeterminism, SameBytesForAnyNumberOfThreads) {
  const TriangleMesh blob = test::blob_mesh(2);
  const DecompositionOptions options{.max_pieces = 6, .max_volume_error = 0.01};
  std::string first;
  for (const int threads : {1, 2, 5, 2}) {
    set_thread_count(threads);
    const std::string result = fingerprint(decompose(blob, options, std::nullopt));
    if (first.empty()) first = result;
    EXPECT_EQ(result, first) << threads << " threads";
  }
}

}  // namespace
}  // namespace pilesim

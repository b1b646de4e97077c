// A solid for any mesh: it has mass, collides and is sampled. The mesh itself is drawn.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/solid_rule.h"
#include "geometry/mesh.h"
#include "geometry/mesh_check.h"

namespace pilesim {

enum class SolidWay { as_it_is, repaired, wrapped, hull };

struct Solid {
  TriangleMesh mesh;  // a proper solid: find_mesh_defects() is empty (as_it_is: or its groups are)
  SolidWay way = SolidWay::as_it_is;
  // For reports, the method and the distance from the mesh: "wrap at 0.8 mm, ..."; empty where it
  // is as it is.
  std::string note;
  bool from_cache = false;
};

struct SolidOptions {
  SolidRule rule = SolidRule::automatic;
  double thickness_m = 0;  // of parts that are sheets; 0: there are to be none
  int hull_max_vertices = 96;
  int cells = 128;  // of a wrap, along its longest side

  bool operator==(const SolidOptions&) const = default;
};

// Throws Error(input) with the defects and how to go on where the rule gives no solid: `exact` of a
// mesh that is none; `automatic` of one that is open so wide, or so thin, that its inside would be
// a guess; `wrap` where nothing is enclosed. A solid that was mended or wrapped is kept in a file
// under `cache_directory`, named by a hash of the mesh and the options, and read from there the
// next time; a damaged file is replaced. No value: no cache. Throws Error(io) if it cannot be
// written.
Solid make_solid(const TriangleMesh& mesh, const SolidOptions& options,
                 const std::optional<std::filesystem::path>& cache_directory = std::nullopt);

}  // namespace pilesim

// Is a mesh the boundary of a solid? Mass, collision and rest poses are only defined for one.
#pragma once

#include <string>
#include <vector>

#include "geometry/mesh.h"

namespace pilesim {

enum class MeshDefectKind {
  empty,          // no triangles or no extent
  degenerate,     // a triangle without area (relative to the mesh's size)
  open_edge,      // an edge with one triangle only
  non_manifold,   // an edge with three triangles or more
  inconsistent,   // two neighbours with opposite orientation
  inside_out,     // closed, but the signed volume is negative
  self_touching,  // triangles that are not neighbours cross or touch
};

struct MeshDefect {
  MeshDefectKind kind;
  size_t count;      // how many edges, triangles, or pairs of triangles show it
  std::string text;  // defect and place: "edge (12, 31) at (0.1, 0.2, 0.3) has one triangle ..."
};

// Every kind of defect the mesh has, each with its first place; empty for a proper solid. Several
// closed pieces beside one another are proper. Self-touching is looked for only when nothing else
// is wrong (it needs a spatial search over triangles, O(T log T)).
std::vector<MeshDefect> find_mesh_defects(const TriangleMesh& mesh);

// The same for those who need but hull and mass: that triangles cross or touch is no defect and is
// hardly ever looked for, which takes most of the time. A piece within another one, which counts
// twice, is one, where nothing touches.
std::vector<MeshDefect> find_volume_defects(const TriangleMesh& mesh);

}  // namespace pilesim

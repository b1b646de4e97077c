#pragma once

namespace pilesim {

// How a mesh becomes a solid: geometry/solid.h.
enum class SolidRule {
  automatic,  // the mesh if it is a solid or can be mended, else a wrap; refused where that guesses
  exact,      // the mesh or nothing
  wrap,       // the space that its generalised winding numbers enclose
  hull,       // its convex hull
};

}  // namespace pilesim

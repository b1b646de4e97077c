// Response tables from collisions that were measured elsewhere: of the real object, or simulated.
#pragma once

#include <span>
#include <vector>

#include "signature/collision_file.h"
#include "signature/table/response_table.h"
#include "signature/table/table_fit.h"
#include "signature/trial/contact_body.h"

namespace pilesim {

// A cell that fewer (effective) collisions reached has no spread of its own, nor one that they only
// grazed: where their weights in it are less than that of one in its middle.
inline constexpr float kFewestCollisions = 4;

// The table of `collisions` over the axes of `empty`. Collisions lie anywhere between its nodes and
// count for the cells around them. Without spin phi and psi mean nothing, and psi nothing where the
// spin is along the velocity: such cells are one, and have the same. A cell with fewer than
// kFewestCollisions has what the nearest other one has, 0 trials, and as the error of its mean the
// deviation of one response. Throws Error(input) without a file where that is true of all.
ResponseTable table_of(const std::vector<PlaneCollision>& collisions,
                       const ContactMaterial& material, double gyration_m,
                       const ResponseTable& empty, uint32_t exemplars);

// The trials of a table in the scale-free layout as collisions with sqrt(v^2 + k^2 w^2) = 1 m/s.
std::vector<PlaneCollision> collisions_of(const Measurements& trials, double gyration_m,
                                          const ResponseTable& table);

}  // namespace pilesim

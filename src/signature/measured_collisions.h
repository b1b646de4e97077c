// Response tables from external collisions: measured on the real object, or simulated.
#pragma once

#include <span>
#include <vector>

#include "signature/collision_file.h"
#include "signature/table/response_table.h"
#include "signature/table/table_fit.h"
#include "signature/trial/contact_body.h"

namespace pilesim {

// A cell has a spread of its own only if at least this many (effective) collisions reached it, and
// their weights sum to at least one collision in its middle.
inline constexpr float kFewestCollisions = 4;

// The table of `collisions` over the axes of `empty`. Collisions lie anywhere between its nodes and
// count for the cells around them. Without spin, phi and psi are undefined; psi is undefined where
// the spin is parallel to the velocity. Such cells are treated as one and share their values. A
// cell with fewer than kFewestCollisions takes the values of the nearest one that has more; it has
// 0 trials, and the deviation of one response as the error of its mean. Throws Error(input) without
// a file name where no cell has enough.
ResponseTable table_of(const std::vector<PlaneCollision>& collisions,
                       const ContactMaterial& material, double gyration_m,
                       const ResponseTable& empty, uint32_t exemplars);

// The trials of a scale-free table as collisions with sqrt(v^2 + k^2 w^2) = 1 m/s.
std::vector<PlaneCollision> collisions_of(const Measurements& trials, double gyration_m,
                                          const ResponseTable& table);

}  // namespace pilesim

// Drops a body with the impulse simulator to find its rest poses (dissertation 3.2.3.3).
#pragma once

#include <cstdint>
#include <vector>

#include "core/progress.h"
#include "geometry/mesh.h"
#include "signature/rest/known_rest_poses.h"
#include "signature/trial/contact_body.h"

namespace pilesim {

struct RestDropSettings {
  uint32_t drops = 100;
  ContactMaterial material;  // of body and plane; its restitution threshold is ignored
  uint64_t seed = 1;
  ProgressMode progress = ProgressMode::automatic;
};

struct RestDrops {
  std::vector<ObservedRest> rests;
  uint32_t unsettled = 0;  // drops that did not come to rest in time; not counted otherwise
};

// Drops the hull of `mesh` (a solid, m) from rest, with its lowest point two bounding radii above a
// plane, in uniformly random orientations. Each drop is its own simulation, so the result depends
// only on mesh and settings. Steps and times scale with the body. Throws Error(interrupted) after
// Ctrl-C.
RestDrops drop_to_rest(const TriangleMesh& mesh, const RestDropSettings& settings);

}  // namespace pilesim

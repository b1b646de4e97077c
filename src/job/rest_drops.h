// How a body comes to rest when it is dropped, by the impulse simulator (dissertation 3.2.3.3).
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
  ContactMaterial material;  // of the body and of the plane; its restitution threshold has no part
  uint64_t seed = 1;
  ProgressMode progress = ProgressMode::automatic;
};

struct RestDrops {
  std::vector<ObservedRest> rests;
  uint32_t unsettled = 0;  // drops that did not come to rest in time, left out
};

// Drops the hull of `mesh` (a solid, m) from rest, its lowest point two of its outer radii over
// a plane, in uniformly random orientations. Each drop is a world of its own, so that the
// result depends on nothing but mesh and settings. Steps and times scale with the body, as its
// motion does. Throws Error(interrupted) after Ctrl-C.
RestDrops drop_to_rest(const TriangleMesh& mesh, const RestDropSettings& settings);

}  // namespace pilesim

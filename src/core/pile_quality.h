// Whether a pile is sound: figures that simulators measure at the end and reports judge.
#pragma once

#include <cstdint>

namespace pilesim {

// Quality of the dynamic bodies that are present. Lengths in metres.
struct PileQuality {
  uint64_t bodies = 0;
  // Over pairs of bodies, at least one of them dynamic, whose collision shapes overlap.
  uint64_t overlapping_pairs = 0;
  double deepest_penetration_m = 0;
  double mean_penetration_m = 0;  // 0 without pairs
  // Gaps from bodies at rest to the nearest other body; negative ones count as 0, those wider than
  // a tenth of the mean diameter as a tenth.
  double largest_gap_m = 0;
  double mean_gap_m = 0;
  uint64_t unsettled = 0;      // still moving; none without gravity, where nothing settles
  uint64_t escaped = 0;        // behind a plane, or below all that is fixed where there is no plane
  uint64_t floating = 0;       // at rest, held up by nothing; none without gravity
  double body_diameter_m = 0;  // mean over dynamic bodies, of the ball about the centre of mass
};

// Quality of a pile in a guide.
struct GuideQuality {
  double outside_share = 0;  // of the bodies
  double empty_share = 0;    // of the guide's volume; gaps between bodies do not count
};

}  // namespace pilesim

// Lets piles grow to their angles of repose (dissertation chapter 5): keeps the stacking
// structures, puts to sleep what lies in them, wakes what exceeds them. docs/direct_pile.md has the
// method.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "pile/height_field.h"
#include "pile/pile_bodies.h"
#include "pile/pile_shape.h"
#include "pile/pile_support.h"
#include "pile/stacking_structure.h"
#include "scene/model.h"
#include "simulate/impulse_control.h"

namespace pilesim {

struct PileState {
  Pile settings;
  std::optional<PileShape> shape;  // none: nothing has landed yet
  std::optional<StackingStructure> structure;
  // The ideal pile that bodies are held inside of. Its angle differs from the one asked for by as
  // much as brings the measured one there.
  std::optional<PileShape> guide;
  double guide_angle = 0;    // rad
  double guide_reach_m = 0;  // so that it has as much bulk as there is
  SlopeFit slope;            // of the surface as it was last measured
  uint32_t avalanches = 0;
};

struct ReposeFrame {
  uint32_t asleep = 0;  // put to sleep in piles
  double seconds = 0;   // wall, of the director, since the start
};

class ReposeDirector final : public StepDirector {
 public:
  // Throws Error(input) with the place in the scene where a boundary is smaller than a body or
  // nothing moves. Both arguments must outlive it.
  ReposeDirector(const Scene& scene, const Model& model);

  void direct(ImpulseControl& control) override;

  const std::vector<PileState>& piles() const { return piles_; }
  // Measures the slopes of all piles and what hangs or overlaps, as of the last step.
  void measure(ImpulseControl& control);
  const PlausibilityCounts& plausibility() const { return plausibility_; }
  uint32_t wakes_by_momentum() const { return wakes_by_momentum_; }

 private:
  enum class Drive : uint8_t { hold, spill, settle };
  struct Steered {
    uint32_t body;
    Drive drive;
    GroundPoint outward;  // unit
    double slope;         // tan
    double grip;          // of the pile
  };
  // Where a body is in the piles.
  struct Place {
    const PileState* pile = nullptr;  // the one whose ideal surface is highest over the body
    double distance_m = 0;            // to its core
    double excess_m = 0;              // of the body's centre over that surface
  };

  void decide(ImpulseControl& control);
  void read_bodies(ImpulseControl& control);
  void place_piles();
  static void place(PileState& pile, const GroundPoint& centre);
  void correct_guide(PileState& pile);
  void count_bodies();
  void update_surfaces();
  void grow_structures();
  void drift(PileState& pile);
  void merge_piles();
  void wake_by_momentum(ImpulseControl& control);
  void wake_sleepers(ImpulseControl& control);
  void judge_awake(ImpulseControl& control);
  static double grip_of(const PileState& pile);
  bool ripe_for_sleep(uint32_t body, const Place& place);
  void wake(ImpulseControl& control, uint32_t body, double grace_s);
  Place place_of(const Vec3& position) const;
  double core_score(const PileState& pile, const Vec3& position, double speed) const;
  Territory territory(const PileState& pile) const;
  void steer(ImpulseControl& control);

  const Scene& scene_;
  const Model& model_;
  PileBodies bodies_;
  double speed_unit_;   // m/s, sqrt(g L)
  double time_unit_s_;  // sqrt(L / g)
  uint64_t steps_ = 0;
  uint64_t decisions_ = 0;
  double now_s_ = 0;
  double bulk_share_ = 1;  // bulk volume of a body over its box's

  std::vector<PileState> piles_;
  std::vector<BodyContact> contacts_;
  std::vector<BodyMotion> motion_;      // (B) of bodies in the world
  std::vector<uint8_t> present_;        // (B)
  std::vector<uint8_t> asleep_;         // (B)
  std::vector<uint8_t> calm_;           // (B) decisions in a row in which it was slow
  std::vector<double> grace_until_s_;   // (B) before which it may not be put to sleep
  std::vector<double> touched_s_;       // (B) when it last touched anything
  std::vector<double> shaken_until_s_;  // (B) before which nothing steers it
  PileSupport support_;
  std::vector<Steered> steered_;
  PlausibilityCounts plausibility_;
  uint32_t wakes_by_momentum_ = 0;
};

}  // namespace pilesim

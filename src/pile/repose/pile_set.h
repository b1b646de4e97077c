// The piles of a scene: where they stand, how far they have grown, and their bodies (dissertation
// 5.2.1, 5.2.2, 5.2.5).
#pragma once

#include <optional>
#include <vector>

#include "model/model.h"
#include "pile/repose/body_columns.h"
#include "pile/repose/height_field.h"
#include "pile/repose/ideal_surface.h"
#include "pile/repose/pile_bodies.h"
#include "pile/repose/pile_shape.h"
#include "pile/repose/stacking_structure.h"

namespace pilesim {

struct PileState {
  uint32_t index = 0;              // of the scene's piles, of the first that became this one
  Pile settings;                   // those of the scene
  std::optional<PileShape> shape;  // none: nothing has landed yet
  std::optional<StackingStructure> structure;
  IdealSurface ideal;
  SlopeFit slope;  // as it was last measured; one for all cones that have run together

  // Density of a layer of the structure, against the pile as it is: the structure has up to four
  // times its volume. 0 for no layer.
  double density(size_t layer) const;
  // As PileShape::way_round(), in the middle of the slopes.
  double round(const GroundPoint& point) const;
  // Eq. 5.2 and the score of section 5.2.3, with the ideal surface for the cone. `speed` in sqrt(g
  // L).
  double sleep_score(const Vec3& position, double speed) const;
};

// Where a body is in the piles.
struct PilePlace {
  const PileState* pile = nullptr;  // whose ideal surface is highest over it; null: in none
  double distance_m = 0;            // to the pile's core
  double round = 0;                 // on the way round the core, as PileState::round()
  double over_m = 0;                // of its centre over the ideal surface
};

class PileSet {
 public:
  // Throws Error(input) with the place in the scene where a boundary is smaller than a body or
  // nothing moves. All must outlive it.
  PileSet(const Scene& scene, const Model& model, const PileBodies& bodies);

  const std::vector<PileState>& piles() const { return piles_; }

  // Piles without a place stand where the first of `on_fixed` (B) lies apart from others.
  void place_new(const PileMotion& motion, const std::vector<uint8_t>& on_fixed);
  // Brings the ideal surfaces up to date, and merges piles that have come together.
  void look_at_surfaces(const PileMotion& motion);
  void measure_slopes(const PileMotion& motion);
  // Counts the bodies in the layers; structures grow, centres drift.
  void count(const PileMotion& motion);
  // Piles of one kind whose middles are near are one.
  void merge();

  PilePlace place_of(const Vec3& position) const;

  // The piles that are left, and what was learned of the bodies.
  void save(StateWriter& writer) const;
  void load(StateReader& reader);  // of a set of the same scene

 private:
  // Piles over one part of the ground.
  struct Window {
    GroundBox area;
    std::vector<size_t> piles;
  };
  std::vector<Window> windows(const PileMotion& motion) const;
  size_t owner_of(const GroundPoint& point) const;
  bool is_of_surface(uint32_t body, const PileMotion& motion) const;
  HeightField surface_of(const GroundBox& area, double base_m, const PileMotion& motion);
  static bool run_together(const PileState& a, const PileState& b);
  std::optional<PileShape> row_of(const std::vector<size_t>& cones) const;

  void drift(PileState& pile, const PileMotion& motion) const;

  const Scene& scene_;
  const Model& model_;
  const PileBodies& bodies_;
  double time_unit_s_;     // sqrt(L / g)
  double fastest_m_s_;     // of what belongs to a surface
  double bulk_share_ = 1;  // bulk volume of a body over its box's
  std::vector<PileState> piles_;
  BodyColumns columns_;
};

}  // namespace pilesim

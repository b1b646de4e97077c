// The piles of a scene: their positions, growth and bodies (dissertation 5.2.1, 5.2.2, 5.2.5).
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
  uint32_t index = 0;              // index in the scene; after a merge, of the first pile
  Pile settings;                   // from the scene
  std::optional<PileShape> shape;  // none until a body has landed
  std::optional<StackingStructure> structure;
  IdealSurface ideal;
  SlopeFit slope;  // as last measured; shared by all merged cones

  // Density of a layer of the structure, relative to the present pile: the structure has up to four
  // times its volume. 0 outside all layers.
  double density(size_t layer) const;
  // As PileShape::way_round(), at half the slope.
  double round(const GroundPoint& point) const;
  // Eq. 5.2 and the score of section 5.2.3, with the ideal surface in place of the cone. `speed` in
  // sqrt(g L).
  double sleep_score(const Vec3& position, double speed) const;
};

// The position of a body in the piles.
struct PilePlace {
  // The one with the highest ideal surface over the body; null: in none.
  const PileState* pile = nullptr;
  double distance_m = 0;  // to the pile's core
  double round = 0;       // position round the core, as PileState::round()
  double over_m = 0;      // height of its centre over the ideal surface
};

class PileSet {
 public:
  // Throws Error(input) with the place in the scene if a boundary is smaller than a body or nothing
  // moves. All arguments must outlive it.
  PileSet(const Scene& scene, const Model& model, const PileBodies& bodies);

  const std::vector<PileState>& piles() const { return piles_; }

  // Places piles without a position where the first of `on_fixed` (B) rests apart from others.
  void place_new(const PileMotion& motion, const std::vector<uint8_t>& on_fixed);
  // Updates the ideal surfaces, and merges piles that have grown together.
  void look_at_surfaces(const PileMotion& motion);
  void measure_slopes(const PileMotion& motion);
  // Counts the bodies in the layers, grows structures and moves centres.
  void count(const PileMotion& motion);
  // Merges piles of one kind whose centres are close.
  void merge();

  PilePlace place_of(const Vec3& position) const;

  // The remaining piles, and the measured properties of the bodies.
  void save(StateWriter& writer) const;
  void load(StateReader& reader);  // for a set of the same scene

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
  double fastest_m_s_;     // highest speed of bodies that belong to a surface
  double bulk_share_ = 1;  // volume that a body takes in the pile, over that of its box
  std::vector<PileState> piles_;
  BodyColumns columns_;
};

}  // namespace pilesim

// The ideal surface of a pile that has as much bulk as lies there, and how the surface that is
// there differs from it.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "pile/repose/height_field.h"
#include "pile/repose/pile_shape.h"

namespace pilesim {

// Bulk on its way outwards.
struct MovingBulk {
  double distance_m = 0;  // from the core
  double volume_m3 = 0;
  double ahead_m = 0;  // how far outwards it still goes before it can be stopped; < 0: inwards
  double round = 0;    // where on the way round the core, as PileShape::way_round()
};

// All zero until the first update. Distances are from the core of the pile's shape, m. Each section
// of the way round (`round` in [0, 1), as PileShape::way_round()) has a surface of its own, with
// the bulk that lies there, as bulk moves away from the core and hardly around it.
class IdealSurface {
 public:
  // From the surface of landed bodies, as cells of the pile's territory `cell_m` wide, and what
  // moves of it. `size_m` is L, the size of a body.
  void update(const PileShape& shape, const std::vector<SurfaceCell>& cells, double cell_m,
              double size_m, const std::vector<MovingBulk>& moving = {});

  double reach_m() const { return reach_m_; }  // of the whole
  double reach_m(double round) const;
  // Height of the ideal surface over the base; negative beyond its foot.
  double height_m(double distance_m, double round = 0) const {
    return (reach_m(round) - distance_m) * slope_;
  }
  // Mean height of the surface that is there over the ideal one; 0 beyond the foot.
  double surplus_m(double distance_m, double round = 0) const;
  // How much must still pass outwards at that distance, besides what passes it anyway before it
  // can be stopped, for both surfaces to hold as much inside of it: in L^3 for each L of the line
  // around the core. Below 0 the inside wants filling. 0 beyond the foot, and while the pile is too
  // small to have slopes.
  double outflow(double distance_m, double round = 0) const;

  static void fields(auto& self, auto& stream) {
    stream(self.slope_, self.reach_m_, self.sections_);
  }
  bool has_sections() const { return !sections_.empty(); }  // false: loaded of nonsense

 private:
  static constexpr size_t kRings = 10;  // of equal width from the core to the foot
  using Profile = std::array<double, kRings>;

  struct Section {
    double reach_m = 0;
    Profile surplus_m{};  // in the middles of the rings
    Profile outflow{};    // at their outer edges

    static void fields(auto& self, auto& stream) {
      stream(self.reach_m, self.surplus_m, self.outflow);
    }

    void update(const std::vector<SurfaceCell>& cells, double cell_m, double size_m, double slope,
                const std::vector<MovingBulk>& moving);
    // A profile at a distance, given where its first value lies, in widths of a ring.
    double at(const Profile& profile, double distance_m, double first) const;
  };
  // Interpolates use(section) between the middles of the two nearest sections.
  template <class Use>
  double between(double round, const Use& use) const;

  double slope_ = 0, reach_m_ = 0;
  std::vector<Section> sections_{1};
};

}  // namespace pilesim

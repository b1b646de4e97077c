// The ideal surface of a pile of the present volume, and the difference between it and the present
// surface.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "pile/repose/height_field.h"
#include "pile/repose/pile_shape.h"

namespace pilesim {

// Volume that moves outwards.
struct MovingBulk {
  double distance_m = 0;  // from the core
  double volume_m3 = 0;
  double ahead_m = 0;  // distance that it still travels before it can stop; < 0: inwards
  double round = 0;    // position round the core, as PileShape::way_round()
};

// All zero until the first update. Distances are from the core of the pile's shape, m. Each section
// of the circumference (`round` in [0, 1), as PileShape::way_round()) has its own surface and
// volume, since bodies move away from the core and hardly around it.
class IdealSurface {
 public:
  // From the surface of landed bodies (cells of the pile's territory, `cell_m` wide) and its moving
  // bodies. `size_m` is L, the size of a body.
  void update(const PileShape& shape, const std::vector<SurfaceCell>& cells, double cell_m,
              double size_m, const std::vector<MovingBulk>& moving = {});

  double reach_m() const { return reach_m_; }  // of the whole pile
  double reach_m(double round) const;
  // Height of the ideal surface over the base; negative beyond its foot.
  double height_m(double distance_m, double round = 0) const {
    return (reach_m(round) - distance_m) * slope_;
  }
  // Mean height of the present surface over the ideal one; 0 beyond the foot.
  double surplus_m(double distance_m, double round = 0) const;
  // Volume that must still pass outwards at that distance until both surfaces enclose the same
  // volume, besides the volume already moving: in L^3 per L of the line around the core. Negative
  // if the inside needs filling. 0 beyond the foot, and while the pile is too small for slopes.
  double outflow(double distance_m, double round = 0) const;

  static void fields(auto& self, auto& stream) {
    stream(self.slope_, self.reach_m_, self.sections_);
  }
  bool has_sections() const { return !sections_.empty(); }  // false: the loaded state is invalid

 private:
  static constexpr size_t kRings = 10;  // of equal width from the core to the foot
  using Profile = std::array<double, kRings>;

  struct Section {
    double reach_m = 0;
    Profile surplus_m{};  // at the middles of the rings
    Profile outflow{};    // at their outer edges

    static void fields(auto& self, auto& stream) {
      stream(self.reach_m, self.surplus_m, self.outflow);
    }

    void update(const std::vector<SurfaceCell>& cells, double cell_m, double size_m, double slope,
                const std::vector<MovingBulk>& moving);
    // The value of a profile at a distance. `first` is the position of its first value, in ring
    // widths.
    double at(const Profile& profile, double distance_m, double first) const;
  };
  // Interpolates use(section) between the middles of the two nearest sections.
  template <class Use>
  double between(double round, const Use& use) const;

  double slope_ = 0, reach_m_ = 0;
  std::vector<Section> sections_{1};
};

}  // namespace pilesim

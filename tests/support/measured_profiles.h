// Measured radial profiles of packed beds, read from printed figures (to 0.005 across, 0.01 up).
#pragma once

#include <algorithm>
#include <cmath>
#include <string_view>
#include <vector>

namespace pilesim {

struct MeasuredProfile {
  struct Point {
    double from_wall;  // in `unit`
    double filled;     // solid share of the ring
  };
  double unit = 0;  // diameters of the body
  double tube = 0;  // its diameter, in diameters of the body; 0: unknown
  std::vector<Point> points;
};

// Ceramic cylinders, 3.42 mm across and 3.46 mm high, in a tube of 44.5 mm, by X-ray tomography:
// Caulkin, Jia and Xu, Ind. Eng. Chem. Res. (2008), as plotted by Farsi et al., Proc. 7th Int.
// Conf. on Discrete Element Methods, G010111 (2016), figure 6, whose axis is in diameters of balls
// of the cylinder's volume (3.90 mm).
inline MeasuredProfile measured_cylinders() {
  return {3.90 / 3.42,
          44.5 / 3.42,
          {{0.1, 0.208}, {0.2, 0.385}, {0.3, 0.505}, {0.4, 0.592}, {0.5, 0.646}, {0.6, 0.675},
           {0.7, 0.675}, {0.8, 0.633}, {0.9, 0.549}, {1.0, 0.497}, {1.1, 0.507}, {1.2, 0.550},
           {1.3, 0.591}, {1.4, 0.613}, {1.5, 0.618}, {1.6, 0.611}, {1.7, 0.588}, {1.8, 0.562},
           {1.9, 0.551}, {2.0, 0.556}, {2.1, 0.573}, {2.2, 0.584}, {2.3, 0.594}, {2.4, 0.589},
           {2.5, 0.583}, {2.6, 0.576}, {2.7, 0.570}, {2.8, 0.570}, {2.9, 0.575}, {3.0, 0.577},
           {3.1, 0.581}, {3.2, 0.581}, {3.3, 0.580}, {3.4, 0.581}, {3.5, 0.581}, {3.6, 0.575},
           {3.7, 0.566}, {3.8, 0.565}, {3.9, 0.570}, {4.0, 0.579}, {4.1, 0.586}, {4.2, 0.586},
           {4.3, 0.586}, {4.4, 0.586}, {4.5, 0.581}, {4.6, 0.571}, {4.7, 0.568}}};
}

// Balls, by magnetic resonance: Nguyen et al., Chem. Eng. Sci. 60, 6289 (2005), as plotted by
// Latham et al., Comput. Part. Mech. 7, 975 (2020), figure 3. The tube is wider than 8.7 balls.
inline MeasuredProfile measured_spheres() {
  return {1, 0, {{0.122, 0.278}, {0.171, 0.372}, {0.208, 0.460}, {0.245, 0.530}, {0.291, 0.597},
                 {0.376, 0.672}, {0.417, 0.713}, {0.580, 0.785}, {0.774, 0.661}, {0.814, 0.619},
                 {0.848, 0.578}, {0.916, 0.514}, {1.020, 0.455}, {1.074, 0.487}, {1.126, 0.559},
                 {1.186, 0.623}, {1.216, 0.649}, {1.430, 0.745}, {1.583, 0.690}, {1.672, 0.629},
                 {1.755, 0.546}, {1.850, 0.513}, {1.969, 0.564}, {2.043, 0.629}, {2.103, 0.667},
                 {2.280, 0.725}, {2.485, 0.657}, {2.566, 0.607}, {2.626, 0.575}, {2.720, 0.535},
                 {2.868, 0.587}, {2.968, 0.646}, {3.100, 0.687}, {3.216, 0.678}, {3.345, 0.637},
                 {3.418, 0.606}, {3.490, 0.585}, {3.579, 0.584}, {3.666, 0.606}, {3.756, 0.637},
                 {3.869, 0.662}, {3.991, 0.663}, {4.144, 0.632}, {4.347, 0.608}}};
}

// Empty if none is available.
inline MeasuredProfile measured_profile(std::string_view shape) {
  if (shape == "cylinder") return measured_cylinders();
  if (shape == "sphere") return measured_spheres();
  return {};
}

struct ProfileDifference {
  double mean = 0, size = 0;  // simulated minus measured: the mean, and the mean absolute value
  double reach = 0;           // from the wall, diameters of the body
  int points = 0;
};

// Compares a profile of porosities in rings of equal width (diameters of the body) from the wall
// inwards, up to `reach`, interpolated between the rings' middles.
inline ProfileDifference difference(const MeasuredProfile& measured,
                                    const std::vector<double>& porosity, double ring,
                                    double reach) {
  ProfileDifference got;
  for (const auto& [from_wall, filled] : measured.points) {
    const double place = from_wall * measured.unit;
    const double middle = place / ring - 0.5;
    const double below = std::floor(middle);
    if (place > reach || below < 0 || below + 1 >= static_cast<double>(porosity.size())) continue;
    const auto i = static_cast<size_t>(below);
    const double ours = porosity[i] + (middle - below) * (porosity[i + 1] - porosity[i]);
    got.mean += ours - (1 - filled);
    got.size += std::abs(ours - (1 - filled));
    got.reach = std::max(got.reach, place);
    ++got.points;
  }
  if (got.points > 0) got.mean /= got.points;
  if (got.points > 0) got.size /= got.points;
  return got;
}

}  // namespace pilesim

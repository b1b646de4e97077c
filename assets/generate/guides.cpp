#include "generate/guides.h"

#include "generate/convex_parts.h"
#include "generate/implicit.h"
#include "generate/polygonise.h"
#include "generate/swept_surface.h"

namespace pilesim {
namespace {

using Vec2 = Eigen::Vector2d;

void add_rectangle(PlaneCells& cells, double low_x, double high_x, double low_y, double high_y) {
  cells.add({{low_x, low_y}, {high_x, low_y}, {high_x, high_y}, {low_x, high_y}});
}

// A column of rectangles between successive heights, so that strokes beside it share whole edges.
void add_column(PlaneCells& cells, double low_x, double high_x,
                const std::vector<double>& heights) {
  for (size_t i = 0; i + 1 < heights.size(); ++i) {
    add_rectangle(cells, low_x, high_x, heights[i], heights[i + 1]);
  }
}

constexpr double kStroke = 0.36;

PlaneCells letter_p() {
  constexpr double kOuter = 0.58;
  constexpr double kInner = kOuter - kStroke;
  constexpr int kSteps = 16;
  const Vec2 centre(0.5, 2 - kOuter);
  PlaneCells cells;
  add_column(cells, 0, kStroke, {0, 2 - 2 * kOuter, 2 - 2 * kOuter + kStroke, 2 - kStroke, 2});
  add_rectangle(cells, kStroke, centre.x(), 2 - 2 * kOuter, 2 - 2 * kOuter + kStroke);
  add_rectangle(cells, kStroke, centre.x(), 2 - kStroke, 2);
  for (int i = 0; i < kSteps; ++i) {
    const auto rim = [&](double radius, int step) -> Vec2 {
      const double angle = radians(180) * step / kSteps - radians(90);
      return centre + radius * Vec2(std::cos(angle), std::sin(angle));
    };
    cells.add({rim(kInner, i), rim(kOuter, i), rim(kOuter, i + 1), rim(kInner, i + 1)});
  }
  return cells;
}

PlaneCells letter_i() {
  PlaneCells cells;
  add_rectangle(cells, 0, kStroke, 0, 2);
  return cells;
}

PlaneCells letter_l() {
  PlaneCells cells;
  add_column(cells, 0, kStroke, {0, kStroke, 2});
  add_rectangle(cells, kStroke, 1.0, 0, kStroke);
  return cells;
}

PlaneCells letter_e() {
  constexpr double kMiddle = 1.0;
  PlaneCells cells;
  add_column(cells, 0, kStroke,
             {0, kStroke, kMiddle - kStroke / 2, kMiddle + kStroke / 2, 2 - kStroke, 2});
  add_rectangle(cells, kStroke, 1.05, 0, kStroke);
  add_rectangle(cells, kStroke, 0.95, kMiddle - kStroke / 2, kMiddle + kStroke / 2);
  add_rectangle(cells, kStroke, 1.05, 2 - kStroke, 2);
  return cells;
}

constexpr double kLimb = 0.6;  // m, width and depth of the limbs of an L, a T and an arch

}  // namespace

TriangleMesh column() {
  return loft({regular_polygon({0, 0, 0}, 1, 0.4, 48), regular_polygon({0, 2, 0}, 1, 0.4, 48)});
}

TriangleMesh cut_sphere() {
  constexpr double kRadius = 0.8;
  constexpr int kSteps = 20;
  const double first = std::asin(-0.75), last = radians(86);
  std::vector<Ring> rings;
  for (int step = 0; step <= kSteps; ++step) {
    const double latitude = first + (last - first) * step / kSteps;
    const double y = kRadius * (0.75 + std::sin(latitude));
    rings.push_back(regular_polygon({0, y, 0}, 1, kRadius * std::cos(latitude), 48));
  }
  for (Vec3& point : rings.front()) point.y() = 0;
  return loft(rings);
}

TriangleMesh l_guide() {
  PlaneCells cells;
  add_column(cells, -0.8, -0.8 + kLimb, {0, kLimb, 2});
  add_rectangle(cells, -0.8 + kLimb, 0.8, 0, kLimb);
  return extrude(cells, kLimb);
}

TriangleMesh t_guide() {
  PlaneCells cells;
  add_column(cells, -kLimb / 2, kLimb / 2, {0, 2 - kLimb, 2});
  add_rectangle(cells, -1, -kLimb / 2, 2 - kLimb, 2);
  add_rectangle(cells, kLimb / 2, 1, 2 - kLimb, 2);
  return extrude(cells, kLimb);
}

TriangleMesh arch() {
  constexpr double kOuter = 1.1, kLegs = 0.8;
  constexpr int kSteps = 32;
  PlaneCells cells;
  add_rectangle(cells, -kOuter, -kOuter + kLimb, 0, kLegs);
  add_rectangle(cells, kOuter - kLimb, kOuter, 0, kLegs);
  for (int i = 0; i < kSteps; ++i) {
    const auto rim = [&](double radius, int step) -> Vec2 {
      const double angle = radians(180) * step / kSteps;
      return Vec2(0, kLegs) + radius * Vec2(std::cos(angle), std::sin(angle));
    };
    cells.add(
        {rim(kOuter - kLimb, i), rim(kOuter, i), rim(kOuter, i + 1), rim(kOuter - kLimb, i + 1)});
  }
  return extrude(cells, kLimb);
}

TriangleMesh torus() {
  constexpr double kMiddle = 0.75, kTube = 0.3, kFoot = 0.06;
  const Field field = [](const Vec3& point) {
    const double height = point.y() - (kMiddle + kTube - kFoot);
    const double round = std::hypot(point.x(), height) - kMiddle;
    return smooth_intersection(std::hypot(round, point.z()) - kTube, -point.y(), 0.02);
  };
  const Bounds region(Vec3(-1.2, -0.1, -0.45), Vec3(1.2, 2.15, 0.45));
  return simplify(polygonise(field, region, 0.03), 3000);
}

TriangleMesh cone() {
  std::vector<Ring> rings{regular_polygon({0, 0, 0}, 1, 1.0, 72)};
  // The tip is a small ball that the side touches.
  constexpr double kTip = 0.03;
  const double side_angle = std::atan2(2.0, 1.0);
  const double centre_y = 2 - kTip;
  for (int step = 0; step < 4; ++step) {
    const double angle = radians(90) - side_angle + step * side_angle / 4;
    rings.push_back(
        regular_polygon({0, centre_y + kTip * std::sin(angle), 0}, 1, kTip * std::cos(angle), 72));
  }
  return loft(rings);
}

TriangleMesh spiral_tower() {
  constexpr int kSides = 40;  // also the levels of each turn, so that edges run along the ramp
  constexpr int kTurns = 4;
  constexpr double kPitch = 0.7;   // m a turn
  constexpr double kTaper = 0.35;  // m of radius lost a metre up
  constexpr double kWall = 0.8;    // part of the pitch that is upright wall, the rest is ramp
  std::vector<Ring> rings{regular_polygon({0, 0, 0}, 1, 0.5, kSides)};
  for (int level = 0; level <= kTurns * kSides; ++level) {
    const double y = kPitch * level / kSides;
    Ring ring = regular_polygon({0, y, 0}, 1, 1.0, kSides);
    for (int side = 0; side < kSides; ++side) {
      const double phase = static_cast<double>((level - side + kSides) % kSides) / kSides;
      const double overhang = phase <= kWall ? phase : kWall * (1 - phase) / (1 - kWall);
      const double radius = 1.25 - kTaper * (y - kPitch * overhang);
      ring[side].x() *= radius;
      ring[side].z() *= radius;
    }
    rings.push_back(std::move(ring));
  }
  rings.push_back(regular_polygon({0, kPitch * kTurns, 0}, 1, 0.15, kSides));
  return simplify(loft(rings), 3000);
}

TriangleMesh heart() {
  const Field field = [](const Vec3& point) {
    const Vec3 p(std::abs(point.x()), point.y(), point.z() * 1.3);
    const double lobe = round_cone(p, {0, 0.12, 0}, {0.53, 1.43, 0}, 0.16, 0.57);
    const double middle = ellipsoid(p, {0, 0.96, 0}, {0.82, 0.72, 0.52});
    return smooth_intersection(smooth_union(lobe, middle, 0.3), -p.y(), 0.05);
  };
  const Bounds region(Vec3(-1.3, -0.1, -0.8), Vec3(1.3, 2.2, 0.8));
  return simplify(polygonise(field, region, 0.035), 3000);
}

TriangleMesh letters() {
  constexpr double kGap = 0.28;
  constexpr double kDepth = 0.6;
  TriangleMesh word;
  double x = 0;
  for (const auto& [name, cells] :
       {std::pair{"P", letter_p()}, {"I", letter_i()}, {"L", letter_l()}, {"E", letter_e()}}) {
    TriangleMesh letter = extrude(cells, kDepth);
    const double width = letter.bounds().sizes().x();
    for (Vec3& vertex : letter.vertices) vertex.x() += x;
    append_group(word, name, letter);
    x += width + kGap;
  }
  for (Vec3& vertex : word.vertices) vertex.x() -= (x - kGap) / 2;
  return word;
}

}  // namespace pilesim

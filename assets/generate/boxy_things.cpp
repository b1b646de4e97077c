// Things made of convex parts.
#include "generate/convex_parts.h"
#include "generate/swept_surface.h"
#include "generate/things.h"

namespace pilesim {
namespace {

// Moves every point sideways by `slope` metres for each metre above `height_m`.
TriangleMesh sheared(TriangleMesh mesh, int axis, double slope, double height_m) {
  for (Vec3& vertex : mesh.vertices) vertex[axis] += slope * (vertex.y() - height_m);
  return mesh;
}

Ring rectangle(double y, double low_x, double high_x, double low_z, double high_z) {
  return {{low_x, y, high_z}, {high_x, y, high_z}, {high_x, y, low_z}, {low_x, y, low_z}};
}

}  // namespace

TriangleMesh box() { return box_between(Vec3::Constant(-0.1), Vec3::Constant(0.1)); }

TriangleMesh stick() { return cylinder_between({-0.5, 0, 0}, 0, 1.0, 0.01, 16, 0.0015); }

TriangleMesh playing_card() {
  constexpr double kCornerRadius = 0.003;
  constexpr int kCornerSteps = 5;
  const auto outline = [&](double y) {
    Ring ring;
    for (int corner = 0; corner < 4; ++corner) {
      const double x = (corner == 0 || corner == 3 ? 1 : -1) * (0.063 / 2 - kCornerRadius);
      const double z = (corner < 2 ? -1 : 1) * (0.088 / 2 - kCornerRadius);
      for (int step = 0; step <= kCornerSteps; ++step) {
        const double angle = radians(90) * (corner + static_cast<double>(step) / kCornerSteps);
        ring.emplace_back(x + kCornerRadius * std::cos(angle), y,
                          z - kCornerRadius * std::sin(angle));
      }
    }
    return ring;
  };
  return prism(outline(-0.00015), outline(0.00015));
}

TriangleMesh l_shape() {
  TriangleMesh mesh;
  append_group(mesh, "upright", box_between({-0.07, 0, -0.03}, {-0.01, 0.2, 0.03}));
  append_group(mesh, "foot", box_between({-0.01, 0, -0.03}, {0.07, 0.06, 0.03}));
  return mesh;
}

TriangleMesh cross() {
  constexpr double kReach = 0.75;
  constexpr double kHubRadius = 0.14;  // to the corners of the octagon
  const double apothem = kHubRadius * std::cos(kPi / 8);
  const double half_root = kHubRadius * std::sin(kPi / 8);
  TriangleMesh mesh;
  append_group(mesh, "hub",
               prism(regular_polygon({0, 0, -0.1}, 2, kHubRadius, 8, 0.5),
                     regular_polygon({0, 0, 0.1}, 2, kHubRadius, 8, 0.5)));
  for (int arm = 0; arm < 4; ++arm) {
    TriangleMesh part = prism(rectangle(apothem, -half_root, half_root, -0.1, 0.1),
                              rectangle(kReach, -0.035, 0.035, -0.1, 0.1));
    const Quat turn(Eigen::AngleAxisd(arm * kPi / 2, Vec3::UnitZ()));
    for (Vec3& vertex : part.vertices) vertex = turn * vertex;
    append_group(mesh, "arm_" + std::to_string(arm + 1), part);
  }
  return mesh;
}

TriangleMesh pole() {
  TriangleMesh mesh;
  append_group(mesh, "base", cylinder_between({0, 0, 0}, 1, 0.03, 0.2, 48, 0.006));
  std::vector<Ring> rings;
  constexpr double kRadius = 0.03;
  rings.push_back(regular_polygon({0, 0.03, 0}, 1, kRadius, 24));
  for (const double angle : {0.0, 25.0, 50.0, 75.0}) {
    const double y = 1.5 - kRadius + kRadius * std::sin(radians(angle)) / std::sin(radians(75));
    rings.push_back(regular_polygon({0, y, 0}, 1, kRadius * std::cos(radians(angle)), 24));
  }
  append_group(mesh, "shaft", loft(rings));
  return mesh;
}

TriangleMesh book() {
  constexpr double kBoard = 0.003;  // thickness of a cover
  constexpr double kHalfHeight = 0.015;
  constexpr double kHalfLength = 0.12;  // along z
  constexpr double kHinge = -0.079;     // x where the spine begins
  constexpr double kOverhang = 0.004;   // of the covers over the pages
  TriangleMesh mesh;
  append_group(
      mesh, "front_cover",
      box_between({kHinge, kHalfHeight - kBoard, -kHalfLength}, {0.085, kHalfHeight, kHalfLength}));
  append_group(mesh, "back_cover",
               box_between({kHinge, -kHalfHeight, -kHalfLength},
                           {0.085, kBoard - kHalfHeight, kHalfLength}));
  append_group(mesh, "pages",
               box_between({kHinge, kBoard - kHalfHeight, kOverhang - kHalfLength},
                           {0.085 - kOverhang, kHalfHeight - kBoard, kHalfLength - kOverhang}));
  constexpr int kSpineSteps = 8;
  const auto spine_outline = [&](double z) {
    Ring ring;
    for (int step = 0; step <= kSpineSteps; ++step) {
      const double angle = radians(180) * step / kSpineSteps;
      ring.emplace_back(kHinge - 0.006 * std::sin(angle), kHalfHeight * std::cos(angle), z);
    }
    return ring;
  };
  append_group(mesh, "spine", prism(spine_outline(-kHalfLength), spine_outline(kHalfLength)));
  return mesh;
}

TriangleMesh chair() {
  constexpr double kSeatTop = 0.45;
  constexpr double kSeatBottom = 0.42;
  constexpr double kRecline = -0.18;  // metres backwards for a metre up
  TriangleMesh mesh;
  append_group(mesh, "seat", box_between({-0.22, kSeatBottom, -0.21}, {0.22, kSeatTop, 0.22}));
  for (const int side : {-1, 1}) {
    const std::string name = side < 0 ? "left" : "right";
    for (const int end : {-1, 1}) {
      // Tapered, and spread towards the ground.
      const double x = side * 0.19;
      const double z = end * 0.18;
      const TriangleMesh leg =
          prism(rectangle(0, x + side * 0.02 - 0.013, x + side * 0.02 + 0.013,
                          z + end * 0.025 - 0.013, z + end * 0.025 + 0.013),
                rectangle(kSeatBottom, x - 0.021, x + 0.021, z - 0.021, z + 0.021));
      append_group(mesh, name + (end < 0 ? "_back_leg" : "_front_leg"), leg);
    }
    append_group(mesh, name + "_post",
                 sheared(box_between({side * 0.195 - 0.02, kSeatTop, -0.2},
                                     {side * 0.195 + 0.02, 0.9, -0.165}),
                         2, kRecline, kSeatTop));
  }
  int rail = 0;
  for (const auto& [low, high] : {std::pair{0.53, 0.58}, {0.64, 0.69}, {0.75, 0.86}}) {
    append_group(
        mesh, "rail_" + std::to_string(++rail),
        sheared(box_between({-0.175, low, -0.194}, {0.175, high, -0.174}), 2, kRecline, kSeatTop));
  }
  return mesh;
}

TriangleMesh crate() {
  constexpr double kHeight = 0.8;
  constexpr double kInnerX = 0.555;  // half width between the walls
  constexpr double kInnerZ = 0.405;
  constexpr double kPost = 0.045;
  constexpr int kPlanks = 5;
  TriangleMesh mesh;
  for (int i = 0; i < kPlanks; ++i) {
    const std::string number = std::to_string(i + 1);
    // Every second plank is thinner on its outer side, which shows the joints.
    const double thickness = i % 2 == 0 ? 0.025 : 0.019;
    const double left = kInnerX * (2.0 * i / kPlanks - 1);
    const double right = kInnerX * (2.0 * (i + 1) / kPlanks - 1);
    append_group(mesh, "floor_" + number,
                 box_between({left, 0.025 - thickness, -kInnerZ}, {right, 0.025, kInnerZ}));
    const double low = kHeight * i / kPlanks;
    const double high = kHeight * (i + 1) / kPlanks;
    append_group(mesh, "left_" + number,
                 box_between({-kInnerX - thickness, low, -kInnerZ}, {-kInnerX, high, kInnerZ}));
    append_group(mesh, "right_" + number,
                 box_between({kInnerX, low, -kInnerZ}, {kInnerX + thickness, high, kInnerZ}));
    append_group(mesh, "back_" + number,
                 box_between({-kInnerX, low, -kInnerZ - thickness}, {kInnerX, high, -kInnerZ}));
    append_group(mesh, "front_" + number,
                 box_between({-kInnerX, low, kInnerZ}, {kInnerX, high, kInnerZ + thickness}));
  }
  int post = 0;
  for (const double x : {-kInnerX - kPost, kInnerX}) {
    for (const double z : {-kInnerZ - kPost, kInnerZ}) {
      append_group(mesh, "post_" + std::to_string(++post),
                   box_between({x, 0, z}, {x + kPost, kHeight + 0.015, z + kPost}));
    }
  }
  return mesh;
}

TriangleMesh cart() {
  constexpr double kFloor = 0.46;  // upper side of the floor
  constexpr double kRim = 0.95;    // upper side of the walls
  constexpr double kFlare = 0.15;  // how far the walls lean out between the two
  constexpr double kWall = 0.035;
  constexpr double kHalfX = 0.83;  // outer sides of the walls at the floor
  constexpr double kHalfZ = 0.45;
  constexpr double kWheelRadius = 0.24;
  constexpr double kWheelZ = 0.48;  // inner side of the wheels
  TriangleMesh mesh;
  append_group(mesh, "floor",
               box_between({-kHalfX, kFloor - 0.04, -kHalfZ}, {kHalfX, kFloor, kHalfZ}));
  for (const int side : {-1, 1}) {
    // Mitred so that long and short walls meet in a plane.
    const auto span = [side](double inner, double outer) {
      return side < 0 ? std::pair{-outer, -inner} : std::pair{inner, outer};
    };
    const auto long_wall = [&](double y, double flare) {
      const auto [low, high] = span(kHalfZ - kWall + flare, kHalfZ + flare);
      return rectangle(y, -kHalfX - flare, kHalfX + flare, low, high);
    };
    const auto short_wall = [&](double y, double flare) {
      const auto [low, high] = span(kHalfX - kWall + flare, kHalfX + flare);
      return rectangle(y, low, high, kWall - kHalfZ - flare, kHalfZ - kWall + flare);
    };
    append_group(mesh, side < 0 ? "right_wall" : "left_wall",
                 prism(long_wall(kFloor, 0), long_wall(kRim, kFlare)));
    append_group(mesh, side < 0 ? "back_wall" : "front_wall",
                 prism(short_wall(kFloor, 0), short_wall(kRim, kFlare)));
    const double inner_x = kHalfX + kFlare - kWall;
    const double inner_z = kHalfZ + kFlare - kWall;
    const auto [low_z, high_z] = span(inner_z, inner_z + kWall + 0.02);
    append_group(mesh, side < 0 ? "right_rail" : "left_rail",
                 box_between({-inner_x - kWall - 0.02, kRim, low_z},
                             {inner_x + kWall + 0.02, kRim + 0.03, high_z}));
    const auto [low_x, high_x] = span(inner_x, inner_x + kWall + 0.02);
    append_group(mesh, side < 0 ? "back_rail" : "front_rail",
                 box_between({low_x, kRim, -inner_z}, {high_x, kRim + 0.03, inner_z}));
  }
  for (const int end : {-1, 1}) {
    const std::string name = end < 0 ? "back_" : "front_";
    const double x = end * 0.52;
    append_group(mesh, name + "axle",
                 box_between({x - 0.03, kWheelRadius - 0.03, -kWheelZ},
                             {x + 0.03, kWheelRadius + 0.03, kWheelZ}));
    append_group(
        mesh, name + "bolster",
        box_between({x - 0.05, kWheelRadius + 0.03, -0.36}, {x + 0.05, kFloor - 0.04, 0.36}));
    for (const int side : {-1, 1}) {
      const std::string wheel = name + (side < 0 ? "right_" : "left_");
      const double tread_z = side < 0 ? -kWheelZ - 0.07 : kWheelZ;
      append_group(mesh, wheel + "wheel",
                   cylinder_between({x, kWheelRadius, tread_z}, 2, 0.07, kWheelRadius, 40, 0.008));
      const double hub_z = side < 0 ? -kWheelZ - 0.1 : kWheelZ + 0.07;
      append_group(mesh, wheel + "hub",
                   cylinder_between({x, kWheelRadius, hub_z}, 2, 0.03, 0.07, 24, 0.006));
    }
  }
  return mesh;
}

}  // namespace pilesim

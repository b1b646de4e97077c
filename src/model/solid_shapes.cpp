#include "model/solid_shapes.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/counted.h"
#include "core/error.h"
#include "core/text.h"
#include "geometry/convex_hull.h"
#include "geometry/flat_regions.h"
#include "geometry/revolved.h"
#include "geometry/round_crossings.h"
#include "geometry/text_outlines.h"

namespace pilesim {
namespace {

using Kind = CollisionPiece::Kind;

// Corners of drawn circles: about the axis, and of a half circle of a section.
constexpr int kSides = 48, kAcross = 12;
// Corners of a half circle of which mass is computed: exact to 1e-6.
constexpr int kFineAcross = 2048;

std::string report(const std::string& what, size_t pieces, double error_m) {
  return what + ": " + counted(pieces, "piece") + ", surface error " + with_digits(error_m, 3) +
         " m";
}

std::vector<CollisionPiece> hull_pieces(std::vector<TriangleMesh> hulls) {
  std::vector<CollisionPiece> pieces;
  for (TriangleMesh& hull : hulls) {
    pieces.push_back({.kind = Kind::hull, .size = Vec3::Zero(), .hull = std::move(hull)});
  }
  return pieces;
}

// The fewest, from `least` on, whose chords are that near to a circle.
int ring_pieces(double radius, double error_m, int least) {
  constexpr int kMost = 64;
  int pieces = least;
  while (pieces < kMost && radius * (1 - std::cos(kPi / pieces)) > error_m) ++pieces;
  return pieces;
}

// A ring about the axis y of so many sectors.
std::vector<CollisionPiece> sectors(const RoundSector& whole, int count) {
  const RoundSector sector = whole.part(kPi / count);
  std::vector<CollisionPiece> pieces;
  for (int i = 0; i < count; ++i) {
    const Quat turn(Eigen::AngleAxisd(2 * kPi * i / count, Vec3::UnitY()));
    pieces.push_back({.kind = Kind::round, .pose = {.orientation = turn}, .round = sector});
  }
  return pieces;
}

SolidShape made(const ConeShape& cone) {
  const Profile profile = frustum_profile(cone.radius, cone.top_radius, cone.height);
  // A circle near the tip, so that the tip's normal shades no more than the tip.
  constexpr double kTip = 0.02;  // of the height
  Profile drawn = profile;
  if (cone.top_radius == 0) {
    const Eigen::Vector2d base = profile[1], tip = profile[2];
    drawn.insert(drawn.end() - 1, tip + kTip * (base - tip));
  }
  return {revolved_mesh(drawn, kSides),
          frustum_outline(cone.radius, cone.top_radius, cone.height),
          revolved_mass(profile),
          {{.kind = Kind::round,
            .round = RoundSector::frustum(cone.radius, cone.top_radius, cone.height)}},
          "1 piece, exact"};
}

SolidShape made(const CapsuleShape& capsule) {
  const auto& [radius, height] = capsule;
  std::vector<CollisionPiece> pieces = capsule_pieces({}, radius, height);
  std::string text = counted(pieces.size(), "piece") + ", exact";
  return {revolved_mesh(capsule_profile(radius, height, kAcross), kSides),
          capsule_outline(radius, height),
          revolved_mass(capsule_profile(radius, height, kFineAcross)), std::move(pieces),
          std::move(text)};
}

// Exact outside; its hole has chords.
SolidShape made(const TorusShape& torus) {
  constexpr int kFewestPieces = 24;
  constexpr double kError = 0.03;  // of the tube's radius
  const auto& [ring, tube] = torus;
  const int count = ring_pieces(ring, kError * tube, kFewestPieces);
  return {revolved_mesh(torus_profile(ring, tube, 2 * kAcross), kSides), torus_outline(ring, tube),
          revolved_mass(torus_profile(ring, tube, 2 * kFineAcross)),
          sectors({.bottom = ring, .top = ring, .margin = tube}, count),
          report("torus", static_cast<size_t>(count), ring * (1 - std::cos(kPi / count)))};
}

// Exact outside; the chords of its hole are as far on either side of it.
SolidShape made(const TubeShape& tube) {
  constexpr int kFewestPieces = 16;
  constexpr double kError = 0.5;  // of the wall, on both sides together
  const double inner = tube.radius - tube.thickness;
  const Profile profile = tube_profile(tube.radius, inner, tube.height);
  const int count = ring_pieces(inner, kError * tube.thickness, kFewestPieces);
  const double flat = std::cos(kPi / count);
  const double hole = std::min(2 * inner / (1 + flat), inner + tube.thickness / 2);
  return {revolved_mesh(profile, kSides), tube_outline(tube.radius, inner, tube.height),
          revolved_mass(profile),
          sectors({.bottom = tube.radius, .top = tube.radius, .height = tube.height, .hole = hole},
                  count),
          report("tube", static_cast<size_t>(count), inner - hole * flat)};
}

SolidShape made(const WedgeShape& wedge) {
  const Vec3 half = wedge.size / 2;
  TriangleMesh mesh;
  for (const double x : {-half.x(), half.x()}) {
    mesh.vertices.emplace_back(x, -half.y(), half.z());
    mesh.vertices.emplace_back(x, -half.y(), -half.z());
    mesh.vertices.emplace_back(x, half.y(), -half.z());
  }
  mesh.triangles = {{0, 2, 1}, {3, 4, 5}, {0, 1, 4}, {0, 4, 3},
                    {1, 2, 5}, {1, 5, 4}, {0, 3, 5}, {0, 5, 2}};
  std::vector<TriangleMesh> hull = {mesh};
  const MassProperties mass = mass_properties(mesh);
  return {std::move(mesh), {}, mass, hull_pieces(std::move(hull)), "1 piece, exact"};
}

// The regions of a letter whose curves are followed to `tolerance`, in heights of a capital letter.
std::vector<FlatRegion> regions_of(const Letter& letter, double tolerance) {
  constexpr size_t kMostPoints = 4000;  // time goes with the square of them
  const auto refusal = [&](const std::string& how, const std::string& expected) {
    return Error(ErrorKind::input,
                 Problem{.found = "its font draws " + letter.name + " with " + how,
                         .expected = expected,
                         .remedy = R"(Name another "font")"});
  };
  const std::vector<Outline> outlines = flattened(letter, tolerance);
  size_t points = 0;
  for (const Outline& outline : outlines) points += outline.size();
  if (points > kMostPoints) {
    throw refusal(std::to_string(points) + " points", "at most " + std::to_string(kMostPoints));
  }
  std::optional<std::vector<FlatRegion>> regions = fill_outlines(outlines);
  if (!regions) throw refusal("outlines that cross", "outlines apart from each other");
  return std::move(*regions);
}

void append(TriangleMesh& whole, const TriangleMesh& part) {
  const auto first = static_cast<uint32_t>(whole.vertices.size());
  whole.vertices.insert(whole.vertices.end(), part.vertices.begin(), part.vertices.end());
  for (const auto& [a, b, c] : part.triangles) {
    whole.triangles.push_back({first + a, first + b, first + c});
  }
}

SolidShape made(const TextShape& text) {
  constexpr double kDrawn = 0.001, kCollides = 0.01;  // heights of a capital letter
  // Letters are 1 high until all is there.
  const double depth = text.depth / text.height;
  SolidShape solid;
  std::vector<TriangleMesh> hulls;
  for (const Letter& letter : text_letters(text.text, text.font)) {
    for (const FlatRegion& region : regions_of(letter, kDrawn)) {
      append(solid.mesh, extruded(region, depth));
    }
    for (const FlatRegion& region : regions_of(letter, kCollides)) {
      for (const std::vector<uint32_t>& polygon : convex_polygons(region)) {
        std::vector<Vec3> corners;
        for (const uint32_t i : polygon) {
          for (const double z : {-depth / 2, depth / 2}) {
            corners.emplace_back(region.points[i].x(), region.points[i].y(), z);
          }
        }
        hulls.push_back(convex_hull(corners));
      }
    }
  }
  if (hulls.empty()) {
    throw Error(ErrorKind::input,
                Problem{.found = "draws nothing in its font", .expected = "a text with letters"});
  }
  const Vec3 centre = solid.mesh.bounds().center();
  const auto place = [&](TriangleMesh& mesh) {
    for (Vec3& vertex : mesh.vertices) vertex = text.height * (vertex - centre);
  };
  place(solid.mesh);
  for (TriangleMesh& hull : hulls) place(hull);
  solid.mass = mass_properties(solid.mesh);
  solid.collision_report = report("text", hulls.size(), kCollides * text.height);
  solid.pieces = hull_pieces(std::move(hulls));
  return solid;
}

}  // namespace

std::optional<SolidShape> solid_shape(const Shape& shape) {
  return std::visit(
      [](const auto& each) -> std::optional<SolidShape> {
        if constexpr (requires { made(each); }) {
          return made(each);
        } else {
          return std::nullopt;
        }
      },
      shape);
}

// Two balls with a cylinder between; a flat one would be no more than 0.5 % of the radius.
std::vector<CollisionPiece> capsule_pieces(const Pose& pose, double radius, double height) {
  constexpr double kFlat = 0.2;  // of the radius
  const double straight = height - 2 * radius;
  std::vector<CollisionPiece> pieces;
  for (const double side : {-1.0, 1.0}) {
    const Vec3 centre = pose.apply({0, side * straight / 2, 0});
    pieces.push_back(
        {.kind = Kind::sphere, .pose = {centre, pose.orientation}, .size = Vec3::Constant(radius)});
  }
  if (straight > kFlat * radius) {
    pieces.push_back(
        {.kind = Kind::round, .pose = pose, .round = RoundSector::cylinder(radius, straight)});
  }
  return pieces;
}

}  // namespace pilesim

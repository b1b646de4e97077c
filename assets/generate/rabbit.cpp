#include "generate/sculptures.h"

namespace pilesim {
namespace {

// Modelled in units of which 32 are its length.
constexpr double kUnit = 0.3 / 32;
const Vec3 kSide = Vec3::UnitZ();
const Quat kRumpTilt = rotation(-8, kSide);
const Quat kChestTilt = rotation(18, kSide);
const Quat kRuffTilt = rotation(24, kSide);
const Quat kThighTilt = rotation(22, kSide) * rotation(-6, Vec3::UnitY());
const Quat kFootTurn = rotation(-4, Vec3::UnitY());
const Quat kHeadTilt = rotation(-14, kSide);
const Quat kEyeTilt = rotation(-20, kSide);
// Leaning back and outwards, opened to the front and side.
const Quat kEarAxes =
    rotation(32, kSide) * rotation(14, Vec3::UnitX()) * rotation(-38, Vec3::UnitY());

// The right half; `p` is mirrored so that p.z() >= 0.
double body(const Vec3& p) {
  const double rump = ellipsoid(p, {-5.6, 7.9, 0}, {8.2, 7.9, 7.0}, kRumpTilt);
  const double chest = ellipsoid(p, {3.4, 8.6, 0}, {5.6, 7.2, 5.2}, kChestTilt);
  double solid = smooth_union(rump, chest, 5.0);
  const double neck = round_cone(p, {3.8, 11.0, 0}, {7.0, 15.5, 0}, 4.6, 3.6);
  solid = smooth_union(solid, neck, 3.0);
  const double ruff = ellipsoid(p, {7.6, 11.6, 0}, {2.7, 3.6, 3.7}, kRuffTilt);
  solid = smooth_union(solid, ruff, 1.2);
  const double tail = ellipsoid(p, {-14.0, 6.6, 0}, {2.4, 2.5, 2.4});
  return smooth_union(solid, tail, 0.7);
}

double hind_leg(const Vec3& p, Detail detail) {
  const double thigh = ellipsoid(p, {-3.9, 5.7, 4.7}, {5.9, 5.1, 3.1}, kThighTilt);
  if (detail == Detail::distant) return thigh;
  const double foot = ellipsoid(p, {0.2, 1.25, 5.5}, {5.4, 1.35, 1.75}, kFootTurn);
  return smooth_union(thigh, foot, 1.2);
}

double front_leg(const Vec3& p, Detail detail) {
  if (detail == Detail::distant) {  // both in one
    return round_cone(p, {5.6, 7.6, 1.2}, {8.0, 2.0, 1.2}, 3.2, 2.0);
  }
  const double leg = round_cone(p, {5.6, 7.6, 2.6}, {7.6, 2.0, 2.5}, 2.3, 1.35);
  const double paw = ellipsoid(p, {8.5, 1.3, 2.5}, {2.2, 1.3, 1.5});
  return smooth_union(leg, paw, 1.2);
}

double head(const Vec3& p) {
  double solid = ellipsoid(p, {8.8, 17.6, 0}, {5.0, 4.4, 4.1}, kHeadTilt);
  const double cheek = sphere(p, {10.6, 15.9, 2.1}, 2.5);
  solid = smooth_union(solid, cheek, 1.6);
  const double muzzle = ellipsoid(p, {12.9, 16.0, 0}, {2.3, 1.9, 1.9});
  solid = smooth_union(solid, muzzle, 1.6);
  return solid;
}

double face_details(double solid, const Vec3& p) {
  const double whisker_pad = ellipsoid(p, {13.9, 15.75, 1.0}, {1.45, 1.15, 1.2});
  solid = smooth_union(solid, whisker_pad, 0.35);
  const double chin = ellipsoid(p, {13.0, 14.3, 0}, {1.35, 0.8, 1.05});
  solid = smooth_union(solid, chin, 0.25);
  const double nose = ellipsoid(p, {14.7, 16.75, 0}, {0.95, 0.65, 1.05});
  solid = smooth_union(solid, nose, 0.25);
  // An almond: the ball looks out between two lids.
  const double socket = ellipsoid(p, {11.05, 18.3, 4.25}, {1.9, 1.5, 1.0}, kEyeTilt);
  solid = smooth_cut(solid, socket, 0.5);
  const double eyeball = sphere(p, {10.95, 18.25, 2.7}, 1.4);
  return smooth_union(solid, eyeball, 0.1);
}

double ear(const Vec3& p, Detail detail) {
  const Vec3 base(6.3, 20.5, 1.7);
  const Vec3 local = kEarAxes.conjugate() * (p - base);
  if (detail == Detail::distant) {
    return round_cone(local, {0, 0, 0}, {0, 9.3, 0.4}, 1.5, 2.0);
  }
  const double thickness = detail == Detail::full ? 1.0 : 1.25;
  const double lower = ellipsoid(local, {0, 5.2, 0}, {thickness, 6.6, 2.2});
  const double root = round_cone(local, {0, -1.5, 0}, {0, 2.5, 0}, 1.5, 1.0);
  double leaf = smooth_union(lower, root, 1.0);
  if (detail == Detail::full) {
    const double hollow = ellipsoid(local, {1.25, 5.3, 0}, {1.15, 5.4, 1.5});
    leaf = smooth_cut(leaf, hollow, 0.5);
  }
  return leaf;
}

double toes(double solid, const Vec3& p) {
  for (const double side : {-1.0, 0.0, 1.0}) {
    const double reach = -0.25 * std::abs(side);
    const double front = ellipsoid(p, {9.6 + reach, 1.05, 2.5 + 0.85 * side}, {1.35, 1.0, 0.62});
    const double hind = ellipsoid(p, {4.6 + reach, 1.1, 5.75 + 0.95 * side}, {1.7, 1.0, 0.68});
    solid = smooth_union(solid, std::min(front, hind), 0.2);
  }
  return solid;
}

double field_of(const Vec3& point, Detail detail) {
  const Vec3 p(point.x(), point.y(), std::abs(point.z()));
  double solid = smooth_union(body(p), head(p), 1.8);
  solid = smooth_union(solid, hind_leg(p, detail), 0.5);
  solid = smooth_union(solid, front_leg(p, detail), 0.9);
  if (detail == Detail::full) solid = toes(face_details(solid, p), p);
  solid = smooth_union(solid, ear(p, detail), 0.8);
  return smooth_intersection(solid, -p.y(), 0.3);
}

}  // namespace

Sculpture rabbit(Detail detail) {
  return {[detail](const Vec3& point) { return kUnit * field_of(point / kUnit, detail); },
          Bounds(Vec3(-18, -1, -10) * kUnit, Vec3(18, 35, 10) * kUnit),
          {Vec3(12.5, 17, 0) * kUnit, 5.5 * kUnit, 2.0},
          0.003};
}

}  // namespace pilesim

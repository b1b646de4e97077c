#include "generate/sculptures.h"

namespace pilesim {
namespace {

// Modelled in centimetres.
constexpr double kCentimetre = 0.01;
const Vec3 kSide = Vec3::UnitZ();

// The right half; `p` is mirrored so that p.z() >= 0.
double body(const Vec3& p) {
  const double rump = ellipsoid(p, {-5.6, 7.9, 0}, {8.2, 7.9, 7.0}, rotation(-8, kSide));
  const double chest = ellipsoid(p, {3.4, 8.6, 0}, {5.6, 7.2, 5.2}, rotation(18, kSide));
  double solid = smooth_union(rump, chest, 5.0);
  const double neck = round_cone(p, {3.8, 11.0, 0}, {7.0, 15.5, 0}, 4.6, 3.6);
  solid = smooth_union(solid, neck, 3.0);
  const double ruff = ellipsoid(p, {7.6, 11.6, 0}, {2.7, 3.6, 3.7}, rotation(24, kSide));
  solid = smooth_union(solid, ruff, 1.2);
  const double tail = ellipsoid(p, {-14.0, 6.6, 0}, {2.4, 2.5, 2.4});
  return smooth_union(solid, tail, 0.7);
}

double hind_leg(const Vec3& p) {
  const double thigh = ellipsoid(p, {-3.9, 5.7, 4.7}, {5.9, 5.1, 3.1},
                                 rotation(22, kSide) * rotation(-6, Vec3::UnitY()));
  const double foot =
      ellipsoid(p, {0.2, 1.25, 5.5}, {5.4, 1.35, 1.75}, rotation(-4, Vec3::UnitY()));
  return smooth_union(thigh, foot, 1.2);
}

double front_leg(const Vec3& p) {
  const double leg = round_cone(p, {5.6, 7.6, 2.6}, {7.6, 2.0, 2.5}, 2.3, 1.35);
  const double paw = ellipsoid(p, {8.5, 1.3, 2.5}, {2.2, 1.3, 1.5});
  return smooth_union(leg, paw, 1.2);
}

double head(const Vec3& p) {
  double solid = ellipsoid(p, {8.8, 17.6, 0}, {5.0, 4.4, 4.1}, rotation(-14, kSide));
  const double cheek = sphere(p, {10.6, 15.9, 2.1}, 2.5);
  solid = smooth_union(solid, cheek, 1.6);
  const double muzzle = ellipsoid(p, {12.9, 16.0, 0}, {2.3, 1.9, 1.9});
  solid = smooth_union(solid, muzzle, 1.6);
  return solid;
}

double face_details(double solid, const Vec3& p) {
  const double whisker_pad = ellipsoid(p, {14.0, 15.6, 0.95}, {1.3, 1.05, 1.1});
  solid = smooth_union(solid, whisker_pad, 0.4);
  const double chin = ellipsoid(p, {13.3, 14.4, 0}, {1.2, 0.75, 0.9});
  solid = smooth_union(solid, chin, 0.4);
  const double mouth = round_cone(p, {15.0, 14.9, 0}, {12.6, 15.0, 2.6}, 0.22, 0.16);
  solid = smooth_cut(solid, mouth, 0.45);
  const double nose = ellipsoid(p, {14.75, 16.75, 0}, {0.85, 0.6, 0.95});
  solid = smooth_union(solid, nose, 0.25);
  // An almond: the ball looks out between two lids.
  const Quat tilt = rotation(-20, kSide);
  const double socket = ellipsoid(p, {10.9, 18.3, 4.3}, {1.75, 1.25, 1.2}, tilt);
  solid = smooth_cut(solid, socket, 0.5);
  const double eyeball = sphere(p, {10.8, 18.25, 2.75}, 1.22);
  return smooth_union(solid, eyeball, 0.1);
}

double ear(const Vec3& p, Detail detail) {
  // A leaf, leaning back and outwards, opened to the front and side.
  const Quat axes =
      rotation(32, kSide) * rotation(14, Vec3::UnitX()) * rotation(-38, Vec3::UnitY());
  const Vec3 base(6.3, 20.5, 1.7);
  const Vec3 local = axes.conjugate() * (p - base);
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

double field_cm(const Vec3& point, Detail detail) {
  const Vec3 p(point.x(), point.y(), std::abs(point.z()));
  double solid = smooth_union(body(p), head(p), 1.8);
  solid = smooth_union(solid, hind_leg(p), 0.5);
  solid = smooth_union(solid, front_leg(p), 0.9);
  if (detail == Detail::full) solid = toes(face_details(solid, p), p);
  solid = smooth_union(solid, ear(p, detail), 0.8);
  return smooth_intersection(solid, -p.y(), 0.3);
}

}  // namespace

Sculpture rabbit(Detail detail) {
  return {
      [detail](const Vec3& point) { return kCentimetre * field_cm(point / kCentimetre, detail); },
      Bounds(Vec3(-18, -1, -10) * kCentimetre, Vec3(18, 35, 10) * kCentimetre)};
}

}  // namespace pilesim

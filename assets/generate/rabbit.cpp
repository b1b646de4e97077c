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
  const double whisker_pad = ellipsoid(p, {14.0, 15.5, 0.85}, {1.2, 1.0, 1.05});
  solid = smooth_union(solid, whisker_pad, 0.5);
  const double chin = ellipsoid(p, {13.0, 14.5, 0}, {1.2, 0.8, 0.9});
  solid = smooth_union(solid, chin, 0.5);
  const double nose = ellipsoid(p, {15.05, 16.7, 0}, {0.65, 0.5, 0.8});
  solid = smooth_union(solid, nose, 0.2);
  const double socket = sphere(p, {11.0, 18.5, 4.35}, 1.35);
  solid = smooth_cut(solid, socket, 0.5);
  const double eyeball = sphere(p, {10.8, 18.45, 2.95}, 1.12);
  return smooth_union(solid, eyeball, 0.08);
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

double toe_grooves(double solid, const Vec3& p) {
  for (const double z : {2.1, 2.95}) {
    solid = smooth_cut(solid, round_cone(p, {9.7, 1.9, z}, {11.2, 0.6, z}, 0.25, 0.3), 0.35);
  }
  for (const double z : {5.25, 6.15}) {
    solid = smooth_cut(solid, round_cone(p, {4.0, 2.2, z}, {6.2, 0.7, z}, 0.28, 0.32), 0.35);
  }
  return solid;
}

double field_cm(const Vec3& point, Detail detail) {
  const Vec3 p(point.x(), point.y(), std::abs(point.z()));
  double solid = smooth_union(body(p), head(p), 1.8);
  solid = smooth_union(solid, hind_leg(p), 0.7);
  solid = smooth_union(solid, front_leg(p), 0.9);
  if (detail == Detail::full) solid = toe_grooves(face_details(solid, p), p);
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

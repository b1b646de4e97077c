#include "generate/sculptures.h"

namespace pilesim {
namespace {

// Modelled in units of which the ears' tips stand 36 above the ground.
constexpr double kUnit = 0.4 / 36;
const Vec3 kAcross = Vec3::UnitX();
const Quat kShellTilt = rotation(8, kAcross);
const Quat kFootTurn = rotation(12, Vec3::UnitY());
const Quat kKneeTilt = rotation(-12, kAcross);
const Quat kPauldronTilt = rotation(-25, Vec3::UnitZ());
const Quat kEarTilt = rotation(-38, Vec3::UnitZ());

// A plate edge once in every unit of `phase`: rises slowly and drops at the end, 0 to 1, as
// overlapping plates do.
double plate(double phase) {
  const double t = phase - std::floor(phase);
  constexpr double kDrop = 0.8;
  const double s = t < kDrop ? t / kDrop : (1 - t) / (1 - kDrop);
  return s * s * (3 - 2 * s);
}

// `p` is mirrored so that p.x() >= 0 in what follows, but for the arms.
double torso(const Vec3& p) {
  const double belly = ellipsoid(p, {0, 15.5, 0.6}, {5.9, 7.0, 5.4});
  const double chest = ellipsoid(p, {0, 22.0, -0.2}, {5.2, 4.6, 4.4});
  return smooth_union(belly, chest, 3.0);
}

// Soft scales across the belly, that overlap upwards.
double belly_scales(double solid, const Vec3& p) {
  const double front = std::clamp((p.z() - 2.2) / 2.0, 0.0, 1.0);
  const double middle = std::clamp((4.6 - p.x()) / 0.8, 0.0, 1.0);
  const double sag = 0.06 * p.x() * p.x();
  return solid - front * middle * 0.45 * plate((p.y() - sag) / 2.5);
}

// The shell of the back: plates that overlap downwards, seen as arcs from side to side.
double carapace(const Vec3& p, Detail detail) {
  const Vec3 centre(0, 17.4, -1.2);
  double shell = ellipsoid(p, centre, {7.1, 9.9, 6.6}, kShellTilt);
  if (detail == Detail::full) {
    const Vec3 hinge(0, 17.0, 4.0);  // the plates fan out around it
    const double angle = std::atan2(p.y() - hinge.y(), hinge.z() - p.z());
    shell -= 0.65 * plate(0.5 - angle / radians(25)) - 0.3;
  }
  const double front = Vec3(0, 0.12, 1).normalized().dot(p - Vec3(0, 17.4, 0.9));
  shell = smooth_intersection(shell, front, 0.7);
  // A rim round its front edge hides the plates' ends.
  const double skin = ellipsoid(p, centre, {7.4, 10.2, 6.9}, kShellTilt);
  const double rim = std::sqrt(skin * skin + front * front) - 0.75;
  shell = smooth_union(shell, rim, 0.3);
  const double foot = 9.0 - p.y();
  return smooth_intersection(shell, foot, 1.0);
}

double tail(const Vec3& p, Detail detail) {
  const Vec3 joints[] = {{0, 10.5, -3.5}, {0, 5.5, -8.0}, {0, 2.6, -12.5}, {0, 2.4, -17.0}};
  constexpr double kRadii[] = {4.2, 3.0, 2.0, 0.9};
  double solid = 1e3;
  for (int i = 0; i < 3; ++i) {
    const double bone = round_cone(p, joints[i], joints[i + 1], kRadii[i], kRadii[i + 1]);
    solid = i == 0 ? bone : smooth_union(solid, bone, 0.8);
  }
  if (detail == Detail::full) {
    const double along = (p - joints[0]).dot(Vec3(0, -0.5, -1).normalized());
    const double fade = std::clamp((along - 1.5) / 2, 0.0, 1.0);
    solid -= fade * (0.4 * plate(along / 2.3) - 0.2);
  }
  return solid;
}

double leg(const Vec3& p, Detail detail) {
  const double thigh = round_cone(p, {3.0, 10.5, 0.2}, {4.7, 6.2, 1.2}, 3.4, 2.5);
  const double shin = round_cone(p, {4.7, 6.2, 1.2}, {4.9, 2.4, 0.2}, 2.3, 2.0);
  double solid = smooth_union(thigh, shin, 0.8);
  const double foot = ellipsoid(p, {5.2, 1.4, 1.8}, {2.6, 1.6, 3.9}, kFootTurn);
  solid = smooth_union(solid, foot, 1.0);
  const double knee = ellipsoid(p, {4.9, 6.5, 2.9}, {1.8, 2.0, 1.3}, kKneeTilt);
  solid = smooth_union(solid, knee, 0.25);
  if (detail == Detail::full) {
    for (const double x : {-1.5, 0.0, 1.5}) {
      const Vec3 root(5.8 + x, 1.0, 4.6 - 0.25 * std::abs(x));
      solid = smooth_union(
          solid, round_cone(p, root, root + Vec3(0.15 * x + 0.2, -0.4, 1.6), 0.85, 0.35), 0.3);
    }
  }
  return smooth_intersection(solid, -p.y(), 0.3);
}

// Both arms are of the same build; `side` is -1 or 1 along x.
double arm(const Vec3& point, double side, const Vec3& elbow, const Vec3& wrist, Detail detail) {
  const Vec3 p(side * point.x(), point.y(), point.z());
  const Vec3 shoulder(5.4, 23.4, 0);
  const double upper = round_cone(p, shoulder, elbow, 2.0, 1.6);
  const double fore = round_cone(p, elbow, wrist, 1.6, 1.5);
  double solid = smooth_union(upper, fore, 0.6);
  const Vec3 forearm = (wrist - elbow).normalized();
  // A flared bracer on the forearm.
  const double bracer = round_cone(p, elbow + 1.0 * forearm, wrist - 0.3 * forearm, 1.75, 2.15);
  solid = smooth_union(solid, bracer, 0.2);
  const Vec3 palm = wrist + 1.9 * forearm;
  solid = smooth_union(solid, ellipsoid(p, palm, {1.8, 1.9, 1.5}), 0.4);
  if (detail == Detail::full) {
    const Vec3 across = forearm.cross(Vec3::UnitZ()).normalized();
    for (const double finger : {-1.0, 0.0, 1.0}) {
      const Vec3 root = palm + 1.0 * forearm + finger * 1.05 * across;
      const Vec3 tip = root + 1.9 * forearm + finger * 0.45 * across + Vec3(0, 0, 0.5);
      solid = smooth_union(solid, round_cone(p, root, tip, 0.72, 0.35), 0.3);
    }
    const Vec3 thumb = palm + Vec3(0, 0, 1.0);
    solid = smooth_union(
        solid,
        round_cone(p, thumb, thumb + 0.9 * forearm - 0.6 * across + Vec3(0, 0, 1.0), 0.7, 0.4),
        0.3);
  }
  double pauldron = ellipsoid(p, {6.5, 24.2, -0.1}, {3.1, 2.9, 3.3}, kPauldronTilt);
  if (detail == Detail::full) {
    const double angle = std::atan2(p.y() - 21.5, p.x() - 4.5);
    pauldron -= 0.4 * plate(angle / radians(32) + 0.2) - 0.2;
  }
  pauldron = smooth_intersection(pauldron,
                                 Vec3(-0.5, -1, 0).normalized().dot(p - Vec3(8.0, 22.2, 0)), 0.4);
  return smooth_union(solid, pauldron, 0.25);
}

double head(const Vec3& p, Detail detail) {
  const double skull = ellipsoid(p, {0, 29.6, 0.6}, {3.9, 4.1, 4.2});
  const double neck = round_cone(p, {0, 24.5, -0.2}, {0, 28.5, 0.3}, 3.4, 3.0);
  double solid = smooth_union(skull, neck, 1.0);
  const double snout = round_cone(p, {0, 28.6, 3.2}, {0, 27.5, 7.6}, 2.3, 1.25);
  solid = smooth_union(solid, snout, 1.2);
  if (detail == Detail::full) {
    solid = smooth_union(solid, ellipsoid(p, {0, 28.1, 8.5}, {1.0, 0.7, 0.6}), 0.2);
    solid = smooth_cut(solid, round_cone(p, {0, 26.5, 9.0}, {2.4, 27.0, 4.4}, 0.22, 0.25), 0.3);
    solid = smooth_cut(solid, sphere(p, {2.6, 30.0, 4.6}, 1.2), 0.4);
    solid = smooth_union(solid, sphere(p, {2.05, 29.9, 3.75}, 1.0), 0.08);
  }
  // The helmet: a thicker dome with a brow, open at the face, and a crest from brow to nape.
  double helmet = ellipsoid(p, {0, 30.2, 0.1}, {4.7, 4.8, 4.9});
  const double face = Vec3(0, -1, 0.85).normalized().dot(p - Vec3(0, 31.2, 3.4));
  helmet = smooth_intersection(helmet, face, 0.5);
  helmet = smooth_intersection(helmet, 27.2 - p.y(), 0.6);
  solid = smooth_union(solid, helmet, 0.2);
  const Vec3 arc(0, 30.0, -0.2);
  const double reach = (Vec3(0, p.y(), p.z()) - arc).norm();
  const double crest = std::max(std::abs(reach - 4.8) - 0.9, p.x() - 0.55);
  const double crest_part =
      smooth_intersection(crest, -Vec3(0, 1, -0.35).normalized().dot(p - Vec3(0, 30.6, 0)), 0.6);
  solid = smooth_union(solid, crest_part, 0.4);
  const double ear_thickness = detail == Detail::full ? 0.75 : 1.0;
  double ear = ellipsoid(p, {4.9, 33.4, -0.8}, {1.5, 3.1, ear_thickness}, kEarTilt);
  if (detail == Detail::full) {
    ear = smooth_cut(ear, ellipsoid(p, {4.9, 33.5, 0.1}, {0.9, 2.3, 0.7}, kEarTilt), 0.3);
  }
  return smooth_union(solid, ear, 0.5);
}

// Bare limbs that tens of triangles can follow.
double distant_figure(const Vec3& point) {
  const Vec3 p(std::abs(point.x()), point.y(), point.z());
  const double leg = round_cone(p, {3.2, 10, 0}, {5.2, 2.2, 1.4}, 3.3, 2.2);
  double solid = smooth_union(torso(p), leg, 1.0);
  const double tail_bone = round_cone(p, {0, 10.5, -3.5}, {0, 2.4, -15.8}, 4.4, 1.9);
  solid = smooth_union(solid, tail_bone, 1.0);
  const double snout = round_cone(p, {0, 29.2, 0}, {0, 27.8, 7.0}, 4.6, 1.6);
  solid = smooth_union(solid, snout, 1.0);
  const double ear = round_cone(p, {2.8, 31, -0.6}, {5.6, 34.4, -0.8}, 1.6, 1.5);
  solid = smooth_union(solid, ear, 0.5);
  const double upper = round_cone(point, {5, 22.6, 0}, {11, 23.4, 0.8}, 2.7, 2.2);
  const double raised = round_cone(point, {11, 23.4, 0.8}, {13, 31.5, 2.6}, 2.2, 1.9);
  const double lowered = round_cone(point, {-5, 22.6, 0}, {-12.6, 14.0, 5.2}, 2.7, 1.9);
  solid = smooth_union(solid, smooth_union(upper, raised, 0.5), 0.8);
  return smooth_union(solid, lowered, 0.8);
}

double field_of(const Vec3& point, Detail detail) {
  if (detail == Detail::distant) return distant_figure(point);
  const Vec3 p(std::abs(point.x()), point.y(), point.z());
  double solid = torso(p);
  if (detail == Detail::full) solid = belly_scales(solid, p);
  solid = smooth_union(solid, leg(p, detail), 0.8);
  solid = smooth_union(solid, tail(p, detail), 1.2);
  solid = smooth_union(solid, carapace(p, detail), 0.3);
  solid = smooth_union(solid, head(p, detail), 0.6);
  // One arm is raised in a greeting.
  solid = smooth_union(solid, arm(point, 1, {10.6, 24.2, 0.8}, {12.4, 29.4, 2.2}, detail), 0.5);
  solid = smooth_union(solid, arm(point, -1, {9.6, 18.6, 1.2}, {11.6, 15.4, 4.4}, detail), 0.5);
  return solid;
}

}  // namespace

Sculpture armoured_biped(Detail detail) {
  return {[detail](const Vec3& point) { return kUnit * field_of(point / kUnit, detail); },
          Bounds(Vec3(-19, -1, -19.5) * kUnit, Vec3(19, 41, 13) * kUnit),
          {Vec3(0, 29, 4) * kUnit, 6 * kUnit, 2.0},
          0.0035};
}

}  // namespace pilesim

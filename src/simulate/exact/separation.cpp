#include "simulate/exact/separation.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <vector>

#include "simulate/exact/exact_constants.h"

namespace pilesim::exact {

using namespace exact_constants;

namespace {

// Closer than this share of the extent, the direction from one to the other is lost in rounding.
constexpr double kLeastDistance = 1e-3;
constexpr double kGainByFace = 1e-5;
// A direction is found when it turns by less, rad^2 / 2: what a better one can gain is about this
// share of the shift.
constexpr double kSameDirection = 2e-4;
constexpr int kMostRounds = 6;
constexpr int kMostIterations = 64;
// A share of the squared distance that GJK may still gain.
constexpr double kGain = 1e-9;

// A point of the difference b - a, with what it is of.
struct Corner {
  Vec3 at, a, b;
  uint32_t of_a = 0, of_b = 0;  // vertices
};

// The point of a simplex that is closest to the origin: the corners it lies between, with their
// shares.
struct Nearest {
  Nearest() = default;
  Nearest(uint8_t i) : corners{i}, count(1) {}  // NOLINT(google-explicit-constructor)
  Nearest(uint8_t i, uint8_t j, double t) : corners{i, j}, shares{1 - t, t}, count(2) {}
  Nearest(std::array<uint8_t, 3> which, std::array<double, 3> weights)
      : corners(which), shares(weights), count(3) {}

  std::array<uint8_t, 3> corners{};
  std::array<double, 3> shares{1, 0, 0};
  int count = 0;  // 0: the origin is inside
};

// Corners stay where they are; the simplex lists those that it has.
class Simplex {
 public:
  int count() const { return count_; }
  const Corner& corner(int k) const { return corners_[used_[k]]; }
  double share(int k) const { return shares_[k]; }
  void clear() { count_ = 0; }
  Corner& add();
  // Leaves the corners between which the closest point lies.
  Vec3 closest();

 private:
  const Vec3& at(uint8_t i) const { return corners_[i].at; }
  Nearest on_segment(uint8_t i, uint8_t j) const;
  Nearest on_triangle(uint8_t i, uint8_t j, uint8_t k) const;
  Nearest on_tetrahedron() const;
  Vec3 point_of(const Nearest& nearest) const;

  std::array<Corner, 4> corners_;
  std::array<uint8_t, 4> used_{};
  std::array<double, 3> shares_{};
  int count_ = 0;
};

Corner& Simplex::add() {
  uint32_t free = 0xF;
  for (int k = 0; k < count_; ++k) free &= ~(1U << used_[k]);
  used_[count_] = static_cast<uint8_t>(std::countr_zero(free));
  return corners_[used_[count_++]];
}

Nearest Simplex::on_segment(uint8_t i, uint8_t j) const {
  const Vec3 &a = at(i), &b = at(j);
  const Vec3 along = b - a;
  const double length2 = along.squaredNorm();
  const double t = length2 > 0 ? -a.dot(along) / length2 : 0;
  if (t <= 0) return i;
  if (t >= 1) return j;
  return {i, j, t};
}

Nearest Simplex::on_triangle(uint8_t i, uint8_t j, uint8_t k) const {
  const Vec3 &a = at(i), &b = at(j), &c = at(k);
  const Vec3 ab = b - a, ac = c - a;
  const double d1 = -ab.dot(a), d2 = -ac.dot(a);
  if (d1 <= 0 && d2 <= 0) return i;
  const double d3 = -ab.dot(b), d4 = -ac.dot(b);
  if (d3 >= 0 && d4 <= d3) return j;
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return {i, j, d1 - d3 > 0 ? d1 / (d1 - d3) : 0};
  const double d5 = -ab.dot(c), d6 = -ac.dot(c);
  if (d6 >= 0 && d5 <= d6) return k;
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return {i, k, d2 - d6 > 0 ? d2 / (d2 - d6) : 0};
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
    const double whole = (d4 - d3) + (d5 - d6);
    return {j, k, whole > 0 ? (d4 - d3) / whole : 0};
  }
  const double whole = va + vb + vc;
  if (!(whole > 0)) return on_segment(i, j);  // no area
  return {{i, j, k}, {va / whole, vb / whole, vc / whole}};
}

// The closest of the faces that the origin lies outside of.
Nearest Simplex::on_tetrahedron() const {
  constexpr std::array<std::array<uint8_t, 4>, 4> kFaces = {
      {{0, 1, 2, 3}, {0, 3, 1, 2}, {0, 2, 3, 1}, {1, 3, 2, 0}}};
  double best2 = std::numeric_limits<double>::infinity();
  Nearest best;
  for (const auto& face : kFaces) {
    const uint8_t i = used_[face[0]], j = used_[face[1]], k = used_[face[2]];
    const Vec3& a = at(i);
    const Vec3 normal = (at(j) - a).cross(at(k) - a);
    const double other = normal.dot(at(used_[face[3]]) - a), origin = -normal.dot(a);
    if (other * origin > 0) continue;  // on the same side
    const Nearest candidate = on_triangle(i, j, k);
    const double distance2 = point_of(candidate).squaredNorm();
    if (distance2 < best2) {
      best2 = distance2;
      best = candidate;
    }
  }
  return best;
}

Vec3 Simplex::point_of(const Nearest& nearest) const {
  Vec3 point = Vec3::Zero();
  for (int k = 0; k < nearest.count; ++k) point += nearest.shares[k] * at(nearest.corners[k]);
  return point;
}

Vec3 Simplex::closest() {
  const Nearest nearest = count_ == 1   ? Nearest(used_[0])
                          : count_ == 2 ? on_segment(used_[0], used_[1])
                          : count_ == 3 ? on_triangle(used_[0], used_[1], used_[2])
                                        : on_tetrahedron();
  if (nearest.count == 0) return Vec3::Zero();
  std::ranges::copy(nearest.corners, used_.begin());
  shares_ = nearest.shares;
  count_ = nearest.count;
  return point_of(nearest);
}

class Pair {
 public:
  Pair(const ConvexPiece& a, const ConvexPiece& b, const Relative& b_in_a, KnownVertices& known)
      : a_(a),
        b_(b),
        b_in_a_(b_in_a),
        known_(known),
        radii_(a.radius_m() + b.radius_m()),
        has_vertices_(a.kind() != ConvexPiece::Kind::round &&
                      b.kind() != ConvexPiece::Kind::round) {}

  double along(const Vec3& normal) const {
    const Corner corner = support(normal);
    return normal.dot(corner.at) - radii_;
  }

  // The corner of b - a that is least along `normal`.
  Corner support(const Vec3& normal) const {
    Corner corner;
    const Vec3 back = -(b_in_a_.turn.transpose() * normal);
    if (has_vertices_) {
      return corner_of(a_.farthest_vertex(normal), b_.farthest_vertex(back));
    }
    corner.a = a_.farthest(normal);
    corner.b = b_in_a_.apply(b_.farthest(back));
    corner.at = corner.b - corner.a;
    return corner;
  }

  Corner corner_of(uint32_t of_a, uint32_t of_b) const {
    Corner corner;
    corner.a = a_.vertices()[of_a];
    corner.b = b_in_a_.apply(b_.vertices()[of_b]);
    corner.at = corner.b - corner.a;
    corner.of_a = of_a;
    corner.of_b = of_b;
    return corner;
  }

  enum class Outcome { found, beyond, overlap };
  // With b moved by `shift`; the distance is that of the cores there. `guess` is unit.
  Outcome gjk(const Vec3& shift, const Vec3& guess, double least, const Reach& beyond,
              Separation& found) const {
    Simplex simplex;
    Vec3 closest;
    Vec3 normal = guess;
    double distance = std::numeric_limits<double>::infinity();
    if (has_vertices_) {
      for (size_t k = 0; k < known_.count; ++k) {
        Corner& corner = simplex.add();
        corner = corner_of(known_.a[k], known_.b[k]);
        corner.at += shift;
      }
      if (simplex.count() > 0) {
        closest = simplex.closest();
        distance = closest.norm();
        if (distance <= least) {  // of no use: start again
          simplex.clear();
          distance = std::numeric_limits<double>::infinity();
        } else {
          normal = closest / distance;
        }
      }
    }
    for (int i = 0; i < kMostIterations; ++i) {
      Corner corner = support(normal);
      corner.at += shift;
      const double bound = normal.dot(corner.at);
      // In this direction they are apart by more than was asked for, where b really is.
      if (bound - normal.dot(shift) - radii_ > beyond.along(normal)) {
        found.normal = normal;
        found.distance_m = bound - normal.dot(shift) - radii_;
        found.is_exact = false;
        return Outcome::beyond;
      }
      if (simplex.count() > 0) {
        if (distance - bound <= kGain * distance) break;
        bool known = false;
        for (int k = 0; k < simplex.count(); ++k) {
          known = known || simplex.corner(k).at == corner.at;
        }
        if (known) break;
      }
      simplex.add() = corner;
      closest = simplex.closest();
      const double now = closest.norm();
      if (now <= least) return Outcome::overlap;
      if (now >= distance) break;  // no better: rounding
      distance = now;
      normal = closest / now;
    }
    found.normal = normal;
    found.on_a = found.on_b = Vec3::Zero();
    for (int k = 0; k < simplex.count(); ++k) {
      const Corner& corner = simplex.corner(k);
      found.on_a += simplex.share(k) * corner.a;
      found.on_b += simplex.share(k) * corner.b;
      known_.a[k] = static_cast<uint16_t>(corner.of_a);
      known_.b[k] = static_cast<uint16_t>(corner.of_b);
    }
    known_.count = static_cast<uint8_t>(simplex.count());
    found.distance_m = distance;
    return Outcome::found;
  }

  // Normals of the round side towards a point in the frame of the piece.
  static std::vector<Vec3> round_normals(const ConvexPiece& piece, const Vec3& point) {
    std::vector<Vec3> normals;
    if (piece.kind() != ConvexPiece::Kind::round) return normals;
    if (const auto side = piece.round_side(point - piece.foot())) {
      normals.push_back(side->normal);
      // Around an arc, too.
      const Vec3 from_arc = point - side->lower;
      if (piece.radius_m() > 0 && !from_arc.isZero(0)) normals.push_back(from_arc.normalized());
    }
    if (piece.radius_m() > 0) {
      normals.push_back(piece.axis());
      normals.emplace_back(-piece.axis());
    }
    return normals;
  }

  // The face normal along which they overlap least: where they are deep in each other. `normal` is
  // as good as `most`; none better: it is left. `of_a` and `of_b` are points of the two: the deeper
  // they are in the other one, the fewer faces are looked at.
  void best_face(const Vec3& of_a, const Vec3& of_b, Vec3& normal, double& most) const {
    const auto consider = [&](const Vec3& candidate) {
      const double apart = along(candidate);
      if (apart <= most) return;
      most = apart;
      normal = candidate;
    };
    // The plane of a face cannot be farther from the other piece than from a point of it, nor than
    // from its inner ball.
    const auto at_most = [&](const ConvexPiece::Face& face, const Vec3& point, const Vec3& centre,
                             double inner_radius_m) {
      return std::min(face.normal.dot(point), face.normal.dot(centre) - inner_radius_m) -
             face.offset_m - radii_;
    };
    const Vec3 centre_b = b_in_a_.apply(b_.centre());
    for (const ConvexPiece::Face& face : a_.faces()) {
      if (at_most(face, of_b, centre_b, b_.inner_radius_m()) > most) consider(face.normal);
    }
    const auto in_b = [&](const Vec3& point) {
      return Vec3(b_in_a_.turn.transpose() * (point - b_in_a_.shift));
    };
    const Vec3 centre_a = in_b(a_.centre()), point_a = in_b(of_a);
    for (const ConvexPiece::Face& face : b_.faces()) {
      if (at_most(face, point_a, centre_a, a_.inner_radius_m()) > most) {
        consider(-(b_in_a_.turn * face.normal));
      }
    }
    for (const Vec3& normal_of_a : round_normals(a_, centre_b)) consider(normal_of_a);
    for (const Vec3& normal_of_b : round_normals(b_, centre_a)) {
      consider(-(b_in_a_.turn * normal_of_b));
    }
  }

  Separation find(const Vec3& guess, const Reach& reach) const {
    const double small = std::min(a_.smallest_extent_m(), b_.smallest_extent_m());
    Separation found;
    Vec3 start = guess;
    if (start.isZero()) {
      start = b_in_a_.apply(b_.centre()) - a_.centre();
      start = start.squaredNorm() > 0 ? Vec3(start.normalized()) : Vec3::UnitY();
      const Outcome outcome = gjk(Vec3::Zero(), start, kLeastDistance * small, reach, found);
      if (outcome == Outcome::beyond) return found;
      if (outcome == Outcome::found) return finish(found);
      const Corner corner = support(start);
      double most = start.dot(corner.at) - radii_;
      best_face(corner.a, corner.b, start, most);
    }
    const double apart = along(start);
    if (apart > reach.along(start)) return {start, apart, Vec3::Zero(), Vec3::Zero(), false};
    Outcome outcome = climb(start, apart, small, reach, found);
    if (outcome == Outcome::beyond) return found;
    const double depth = radii_ - found.distance_m;
    if (depth > kResolution * small && !(known_.is_wall && depth > kTooDeep * small)) {
      Vec3 face = found.normal;
      double better = kGainByFace * small - depth;
      best_face(found.on_a, found.on_b, face, better);
      if (face != found.normal) {
        known_.count = 0;
        outcome = climb(face, better, small, reach, found);
        if (outcome == Outcome::beyond) return found;
      }
    }
    return finish(found);
  }

 private:
  // From a direction to a better one, until it is the best about there.
  Outcome climb(Vec3 start, double apart, double small, const Reach& reach,
                Separation& found) const {
    for (int round = 0; round < kMostRounds; ++round) {
      // Cores with radii are apart where their surfaces overlap.
      double shift = std::max(0.0, kShift * small - (apart + radii_));
      Outcome outcome = gjk(shift * start, start, kLeastDistance * small, reach, found);
      for (int wider = 0; wider < 4 && outcome == Outcome::overlap; ++wider) {
        shift = 2 * shift + kShift * small;
        outcome = gjk(shift * start, start, kLeastDistance * small, reach, found);
      }
      if (outcome == Outcome::beyond) return outcome;
      if (outcome == Outcome::overlap) {
        found.normal = start;
        const Corner corner = support(start);
        found.on_a = corner.a;
        found.on_b = corner.b;
      }
      found.distance_m = (found.on_b - found.on_a).dot(found.normal);
      const double turned = 1 - found.normal.dot(start);
      start = found.normal;
      apart = found.distance_m - radii_;
      if (shift == 0 || turned < kSameDirection) break;
    }
    return Outcome::found;
  }

  Separation finish(Separation found) const {
    found.on_a += a_.radius_m() * found.normal;
    found.on_b -= b_.radius_m() * found.normal;
    found.distance_m -= radii_;
    found.is_exact = true;
    return found;
  }

  const ConvexPiece& a_;
  const ConvexPiece& b_;
  const Relative& b_in_a_;
  KnownVertices& known_;
  double radii_;
  bool has_vertices_;
};

}  // namespace

double separation_along(const ConvexPiece& a, const ConvexPiece& b, const Relative& b_in_a,
                        const Vec3& normal) {
  KnownVertices none;
  return Pair(a, b, b_in_a, none).along(normal);
}

Separation find_separation(const ConvexPiece& a, const ConvexPiece& b, const Relative& b_in_a,
                           const Vec3& guess, const Reach& reach, KnownVertices& known) {
  return Pair(a, b, b_in_a, known).find(guess, reach);
}

}  // namespace pilesim::exact

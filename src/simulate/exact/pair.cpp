#include "simulate/exact/pair.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "simulate/exact/exact_constants.h"

namespace pilesim::exact {

using namespace exact_constants;

namespace {

constexpr int kMostAdvances = 24;
// A normal that is tilted by more would slow or lift a fast body.
constexpr double kSameWay = 1e-6;

// Rounds so that never too little is subtracted.
void spend(float& bound, float motion) {
  constexpr float kRounding = 1e-6F;
  bound -= motion + kRounding * (std::abs(bound) + std::abs(motion));
}

class Finder {
 public:
  Finder(Pair& pair, const PosedBody& a, const PosedBody& b, const NarrowSettings& settings,
         NarrowScratch& scratch)
      : pair_(pair),
        a_(a),
        b_(b),
        shape_a_(*a.shape),
        shape_b_(*b.shape),
        scratch_(scratch),
        step_s_(settings.step_s),
        is_of_one_piece_(!shape_a_.surface && shape_a_.pieces.size() == 1 &&
                         shape_b_.pieces.size() == 1),
        small_(smaller_extent(shape_a_, shape_b_)),
        around_a_(settings.surroundings->of(pair.a)),
        around_b_(settings.surroundings->of(pair.b)) {
    const double h = settings.step_s;
    const double fall = a.is_awake != b.is_awake ? settings.gravity * h * h : 0;
    turning_ = a.turning_m_s + b.turning_m_s;
    displacement_ = h * (b.velocity - a.velocity);
    unknown_m_ = h * turning_ + fall;
    reach_m_ = kContactMargin * small_ + displacement_.norm() + unknown_m_;
    near_m_ = 2 * kContactMargin * small_;
  }

  void find() {
    spend(pair_.list_bound_m, pair_.motion_m);
    for (PiecePair& pieces : pair_.pieces) {
      spend(pieces.bound_m, pair_.motion_m);
    }
    pair_.motion_m = 0;
    pair_.toward.setZero();
    b_in_a_ = relative_at(0);
    reach_ = Reach(kContactMargin * small_ + unknown_m_, turn_a_.transpose() * displacement_);
    const Mat3 to_a = step_s_ * turn_a_.transpose();
    scratch_.manifold.turn = to_a * (b_.spin - a_.spin);
    scratch_.manifold.shift =
        to_a * (b_.velocity - a_.velocity - b_.spin.cross(b_.position - a_.position));
    scratch_.all.clear();
    double bound = std::numeric_limits<double>::infinity();
    if (shape_a_.is_plane) {
      for (const ConvexPiece& piece : shape_b_.pieces) test_plane(piece, bound);
      pair_.toward = (turn_a_ * Vec3::UnitY()).cast<float>();
    } else {
      if (pair_.list_bound_m < reach_m_) list_pieces();
      if (shape_a_.surface && !shape_a_.surface->is_solid()) settle_sides();
      // Faces that pieces have come to before those that they may have come to from behind.
      for (const bool known_side : {true, false}) {
        for (PiecePair& pieces : pair_.pieces) {
          if ((pieces.side >= 0) != known_side) continue;
          const size_t first = scratch_.all.size();
          if (pieces.bound_m <= reach_m_) test(pieces);
          for (size_t i = first; i < scratch_.all.size(); ++i) {
            scratch_.all[i].pieces = static_cast<uint32_t>(&pieces - pair_.pieces.data());
          }
          bound = std::min<double>(bound, pieces.bound_m);
        }
      }
      bound = std::min<double>(bound, pair_.list_bound_m);
    }
    pair_.bound_m = static_cast<float>(bound);
    if (bound < -kDeepPieces * small_ && pair_.pieces.size() > 1 && !shape_a_.surface &&
        a_.is_moved_by_contacts && b_.is_moved_by_contacts) {
      separate_one_way();
    } else {
      pair_.exit_normal.setZero();
    }
    reduce();
    note_found();
  }

  // Gives contacts the forces of those of the step before.
  void take_over(std::span<const Contact> before, std::vector<Contact>& contacts) {
    std::vector<Contact>& former = scratch_.former;
    former.assign(before.begin(), before.end());
    const auto near2 = static_cast<float>(kSamePlace * small_ * kSamePlace * small_);
    for (const SurfacePoint& point : scratch_.all) {
      Contact contact;
      contact.arm_a = point.place.cast<float>();
      contact.arm_b = point.other_arm.cast<float>();
      contact.normal = point.normal.cast<float>();
      contact.distance_m = static_cast<float>(point.distance_m);
      contact.gap_m = static_cast<float>(point.gap_m);
      contact.time_s = static_cast<float>(point.time_s);
      contact.is_round = point.is_round;
      contact.is_of_b = point.is_of_b;
      contact.found_distance_m = contact.distance_m;
      contact.found_on_b = (b_.turn.transpose() * point.other_arm).cast<float>();
      const Mat3& turn = point.is_of_b ? b_.turn : a_.turn;
      contact.found_normal = (turn.transpose() * point.normal).cast<float>();
      Contact* best = nullptr;
      float least = near2;
      for (Contact& old : former) {
        if (old.normal_force_n <= 0 || old.normal.dot(contact.normal) < kSameNormal) continue;
        const float distance2 = std::min((old.arm_a - contact.arm_a).squaredNorm(),
                                         (old.arm_b - contact.arm_b).squaredNorm());
        if (distance2 >= least) continue;
        least = distance2;
        best = &old;
      }
      if (best != nullptr) {
        contact.normal_force_n = best->normal_force_n;
        contact.friction_n =
            best->friction_n - best->friction_n.dot(contact.normal) * contact.normal;
        contact.torque_nm = best->torque_nm;
        best->normal_force_n = -1;  // taken
      }
      contacts.push_back(contact);
    }
  }

 private:
  // Where the bodies are `t` seconds from now, by their velocities.
  Relative relative_at(double t) {
    if (t == 0) {
      turn_a_ = a_.turn;
      position_a_ = a_.position;
      position_b_ = b_.position;
      return {turn_a_.transpose() * b_.turn, turn_a_.transpose() * (b_.position - a_.position)};
    }
    const auto turned = [t](const PosedBody& body) {
      const Vec3 turn = t * body.spin;
      const double angle = turn.norm();
      if (angle == 0) return body.orientation;
      return Quat(Eigen::AngleAxisd(angle, turn / angle)) * body.orientation;
    };
    turn_a_ = turned(a_).toRotationMatrix();
    position_a_ = a_.position + t * a_.velocity;
    position_b_ = b_.position + t * b_.velocity;
    return {turn_a_.transpose() * turned(b_).toRotationMatrix(),
            turn_a_.transpose() * (position_b_ - position_a_)};
  }

  // Along the normal, a's frame, they may come nearer in the step by much.
  bool is_fast(const Vec3& normal) const {
    return reach_.along(normal) > (kContactMargin + kMotionInStep) * small_;
  }

  // Contacts of one pair of pieces as bodies stand, and their distance. `look(relative, reach)`
  // finds the separation, `touch(relative, separation, reach)` adds points to scratch_.all.
  template <typename Look, typename Touch>
  double test(bool is_round, const Look& look, const Touch& touch) {
    const Separation now = look(b_in_a_, reach_);
    const double reach_m = reach_.along(now.normal);
    if (!now.is_exact || now.distance_m > reach_m) return now.distance_m;
    const size_t first = scratch_.all.size();
    const bool fast = is_fast(now.normal);
    // The normal of round sides turns as they pass each other: it is that of the impact.
    const bool turns = is_round && is_of_one_piece_;
    const double close_m = turns ? 0.1 * kResolution * small_ : near_m_;
    const auto touch_now = [&] {
      touch(b_in_a_, now, reach_m);
      add_contacts(first, 0, is_round);
    };
    if (now.distance_m <= close_m || !(fast || turns)) {
      touch_now();
      return now.distance_m;
    }
    // Conservative advancement: on by times in which nothing can touch.
    Separation then = now;
    double t = 0;
    for (int i = 0; i < kMostAdvances && then.distance_m > close_m && t < step_s_; ++i) {
      const Vec3 normal = turn_a_ * then.normal;
      const double closing = normal.dot(a_.velocity - b_.velocity) + turning_;
      if (closing <= 0) break;
      t = std::min(step_s_, t + (then.distance_m - close_m / 2) / closing);
      then = look(relative_at(t), t < step_s_ || fast ? close_m : reach_m);
    }
    // Those that pass each other, or meet in the next step, may yet be pushed together in this one.
    const double most_m = fast ? near_m_ : reach_m;
    if (then.is_exact && then.distance_m <= most_m) {
      touch(relative_at(t), then, most_m + kContactMargin * small_);
      add_contacts(first, t, is_round);
      // Bodies that move by little are not moved there.
      for (size_t i = first; i < scratch_.all.size() && !fast; ++i) scratch_.all[i].time_s = 0;
    }
    relative_at(0);  // for the next pieces
    return now.distance_m;
  }

  static bool is_round(const ConvexPiece& piece) {
    return piece.kind() != ConvexPiece::Kind::polytope;
  }

  void test_plane(const ConvexPiece& piece, double& bound) {
    const auto plane_in = [](const Relative& relative) {
      return std::pair(Vec3(relative.turn.transpose() * Vec3::UnitY()), -relative.shift.y());
    };
    bound = std::min(bound, test(
                                is_round(piece),
                                [&](const Relative& relative, const Reach&) {
                                  const auto [normal, offset] = plane_in(relative);
                                  Separation separation;
                                  separation.normal = Vec3::UnitY();
                                  separation.distance_m = normal.dot(piece.farthest(-normal)) -
                                                          piece.radius_m() - offset;
                                  return separation;
                                },
                                [&](const Relative& relative, const Separation&, double reach) {
                                  const auto [normal, offset] = plane_in(relative);
                                  const size_t first = scratch_.all.size();
                                  add_plane_manifold(piece, normal, offset, reach,
                                                     scratch_.manifold, scratch_.all);
                                  for (size_t i = first; i < scratch_.all.size(); ++i) {
                                    scratch_.all[i].place = relative.apply(scratch_.all[i].place);
                                    scratch_.all[i].normal = relative.turn * scratch_.all[i].normal;
                                  }
                                }));
  }

  void test(PiecePair& pieces) {
    const ConvexPiece& b = shape_b_.pieces[pieces.b];
    pieces.known.is_wall = !a_.is_moved_by_contacts || !b_.is_moved_by_contacts;
    Vec3 guess = pieces.axis.cast<double>();
    if (!guess.isZero()) guess.normalize();
    if (shape_a_.surface) return meet_triangle(pieces, b, guess);
    const ConvexPiece& a = shape_a_.pieces[pieces.a];
    bool first = true, is_turned = false, is_on_arc = false;
    const double distance = test(
        is_round(a) || is_round(b),
        [&](const Relative& relative, const Reach& reach) {
          Separation separation = find_separation(a, b, relative, guess, reach, pieces.known);
          is_on_arc = part_by_arcs(a, b, relative, separation);
          is_turned = leave_surroundings(pieces, relative, reach, separation);
          guess = separation.normal;
          if (first) pieces.axis = guess.cast<float>();
          first = false;
          return separation;
        },
        [&](const Relative& relative, const Separation& separation, double reach) {
          if (is_turned) {
            add_turned(pieces, relative, separation, reach);
            return;
          }
          if (is_on_arc) return add_deepest(b, relative, separation.normal, separation.distance_m);
          const size_t before = scratch_.all.size();
          add_manifold(a, b, relative, separation, reach, scratch_.manifold, scratch_.all);
          drop_covered(a, b, relative, before);
          // A point beside the face may be a neighbour's.
          if (scratch_.all.size() == before) return;
          const SurfacePoint& point = scratch_.all.back();
          if (point.normal.dot(separation.normal) > kSamePlane) return;
          const Vec3 half = point.distance_m / 2 * point.normal;
          Separation beside{point.normal, point.distance_m, point.place - half, point.place + half};
          const bool is_away = leave_surroundings(pieces, relative, reach, beside);
          if (is_away || !beside.is_exact) scratch_.all.pop_back();
        });
    pieces.bound_m = static_cast<float>(distance);
    if (is_of_one_piece_) {
      pair_.toward = (turn_a_ * pieces.axis.cast<double>()).cast<float>();
    }
  }

  // Arcs go on in the next sector of a ring: the corners between them would brake it as it rolls.
  // Whether the normal is one that only the next sector has.
  bool is_covered(const ConvexPiece& a, const ConvexPiece& b, const Relative& relative,
                  const Vec3& normal) const {
    return a.is_covered(normal) || b.is_covered(-(relative.turn.transpose() * normal));
  }

  // Sectors that penetrate part by their arcs, not by the faces between them; else what is covered
  // is left to the next sector. Whether the normal has been turned.
  bool part_by_arcs(const ConvexPiece& a, const ConvexPiece& b, const Relative& relative,
                    Separation& separation) const {
    if (!separation.is_exact || !is_covered(a, b, relative, separation.normal)) return false;
    if (separation.distance_m > -kResolution * small_) {
      separation.is_exact = false;
      return false;
    }
    if (a.is_covered(separation.normal)) separation.normal = a.to_arc(separation.normal);
    const Vec3 of_b = -(relative.turn.transpose() * separation.normal);
    if (b.is_covered(of_b)) separation.normal = -(relative.turn * b.to_arc(of_b));
    separation.distance_m = separation_along(a, b, relative, separation.normal);
    return true;
  }

  // Where b is deepest in the other along the normal, by so much.
  void add_deepest(const ConvexPiece& b, const Relative& relative, const Vec3& normal,
                   double distance_m) {
    const Vec3 on_b =
        relative.apply(b.farthest(-(relative.turn.transpose() * normal))) - b.radius_m() * normal;
    scratch_.all.push_back({on_b - distance_m / 2 * normal, normal, distance_m});
  }

  void drop_covered(const ConvexPiece& a, const ConvexPiece& b, const Relative& relative,
                    size_t first) {
    const auto begin = scratch_.all.begin() + static_cast<std::ptrdiff_t>(first);
    scratch_.all.erase(std::remove_if(begin, scratch_.all.end(),
                                      [&](const SurfacePoint& point) {
                                        return is_covered(a, b, relative, point.normal);
                                      }),
                       scratch_.all.end());
  }

  // For a piece that a static one lies against: where the normal points into that, it is turned
  // to the nearest that does not; or it is covered there, and nothing touches it. Whether it is
  // turned.
  bool leave_surroundings(const PiecePair& pieces, const Relative& relative, const Reach& reach,
                          Separation& separation) const {
    const bool is_a = around_a_.all != nullptr;
    const ModelSurroundings::Place& around = is_a ? around_a_ : around_b_;
    if (around.all == nullptr || !separation.is_exact ||
        separation.distance_m > reach.along(separation.normal) ||
        !around.all->is_beside(around.thing, is_a ? pieces.a : pieces.b)) {
      return false;
    }
    const ConvexPiece &a = shape_a_.pieces[pieces.a], &b = shape_b_.pieces[pieces.b];
    const Mat3 to_b = relative.turn.transpose();
    const auto lowest = [&](const Vec3& direction) {
      if (is_a) {
        return direction.dot(relative.apply(b.farthest(-(to_b * direction)))) - b.radius_m();
      }
      const Vec3 in_a = relative.turn * direction;
      return in_a.dot(a.farthest(-in_a) - relative.shift) - a.radius_m();
    };
    const Vec3 normal = is_a ? separation.normal : -(to_b * separation.normal);
    const Vec3 point = is_a ? separation.on_a : to_b * (separation.on_b - relative.shift);
    const Vec3 outward = around.all->outward(around.thing, is_a ? pieces.a : pieces.b, 1, point,
                                             normal, small_, lowest);
    if (outward.isZero(0)) {
      separation.is_exact = false;
      return false;
    }
    if (outward == normal) return false;
    separation.normal = is_a ? outward : -(relative.turn * outward);
    separation.distance_m = separation_along(a, b, relative, separation.normal);
    return true;
  }

  // Over the face of the static piece that has been turned to. Where it is none, but between two,
  // the point that comes nearest, if it is there that pieces are nearest.
  void add_turned(const PiecePair& pieces, const Relative& relative, const Separation& separation,
                  double reach) {
    const bool is_a = around_a_.all != nullptr;
    const ConvexPiece &a = shape_a_.pieces[pieces.a], &b = shape_b_.pieces[pieces.b];
    const Vec3 outward =
        is_a ? separation.normal : -(relative.turn.transpose() * separation.normal);
    const ConvexPiece& piece = is_a ? a : b;
    const uint32_t face = piece.face_along(outward);
    if (face != ConvexPiece::kNone && piece.faces()[face].normal.dot(outward) > kNearlyFacing) {
      const Feature feature{is_a ? Feature::Of::a : Feature::Of::b, face};
      add_manifold(a, b, relative, feature, reach, scratch_.manifold, scratch_.all);
      return;
    }
    const Vec3 moving =
        is_a ? relative.apply(b.farthest(-(relative.turn.transpose() * separation.normal)))
             : a.farthest(separation.normal);
    const Vec3 place = is_a ? separation.on_a : separation.on_b;
    const Vec3 apart = moving - place;
    const double along = apart.dot(separation.normal);
    if ((apart - along * separation.normal).norm() <= kBeside * small_) {
      scratch_.all.push_back({place, separation.normal, separation.distance_m});
    }
  }

  void meet_triangle(PiecePair& pieces, const ConvexPiece& b, Vec3 guess) {
    const TriangleSurface::Face face = shape_a_.surface->face(pieces.a);
    thread_local ConvexPiece triangle{face.corners};
    triangle.become(face.corners);
    const bool is_solid = shape_a_.surface->is_solid();
    if (pieces.side == 0 || (pieces.side < 0 && is_solid)) {
      pieces.side = side_of(pieces.a, b);
    }
    // From behind a solid's surface nothing comes: that is another triangle's.
    if (pieces.side < 0 && is_solid) {
      pieces.bound_m = static_cast<float>(reach_m_ + std::max(0.0, -farthest_over(face, b, 1)));
      return;
    }
    // A body that tips over an edge of the surface stays in touch with that edge.
    const bool tips_over = !guess.isZero() && pieces.side * height_over(face, b) < 0;
    bool first = true;
    const double distance = test(
        is_round(b),
        [&](const Relative& relative, const Reach& reach) {
          // Apart as they were, or over the face, or beside it.
          if (!guess.isZero()) {
            const double apart = separation_along(triangle, b, relative, guess);
            if (apart > reach.along(guess)) return Separation{guess, apart, {}, {}, false};
          }
          Separation separation = find_separation(
              triangle, b, relative, tips_over ? guess : Vec3(pieces.side * face.normal), reach,
              pieces.known);
          if (separation.distance_m < -kContactMargin * small_) {
            leave_wrong_side(pieces, triangle, b, relative, separation);
          }
          if (!is_solid && separation.is_exact && separation.distance_m > 0) {
            if (const int8_t side = side_along(separation.normal, face)) pieces.side = side;
          }
          guess = separation.normal;
          if (first) pieces.axis = guess.cast<float>();
          first = false;
          return separation;
        },
        [&](const Relative& relative, const Separation& separation, double reach) {
          const size_t before = scratch_.all.size();
          touch_triangle(pieces, triangle, b, relative, separation, reach);
          drop_covered(triangle, b, relative, before);
        });
    pieces.bound_m = static_cast<float>(distance);
    if (distance > reach_m_) pieces.side = 0;
    is_inside_ = is_inside_ || distance < -kContactMargin * small_;
  }

  // Deep in a triangle as seen from its side, a piece may yet be apart from it: it has come round,
  // or past an edge, or is on the other slope of a ridge. A piece inside a solid leaves it as it
  // came.
  void leave_wrong_side(PiecePair& pieces, const ConvexPiece& triangle, const ConvexPiece& b,
                        const Relative& relative, Separation& separation) const {
    const TriangleSurface& surface = *shape_a_.surface;
    KnownVertices none;
    const Separation apart = find_separation(triangle, b, relative, Vec3::Zero(),
                                             std::numeric_limits<double>::infinity(), none);
    if (apart.distance_m <= 0) return;
    const bool is_behind = side_along(apart.normal, surface.face(pieces.a)) < 0;
    if (is_behind && surface.is_solid() &&
        (!surface.has_one_side() || surface.is_below(apart.on_b))) {
      return;
    }
    separation = apart;
  }

  // The side of a triangle that `normal`, from it to what is apart from it, is on. 0: not clear.
  static int8_t side_along(const Vec3& normal, const TriangleSurface::Face& face) {
    const double cosine = normal.dot(face.normal);
    if (std::abs(cosine) <= kOnThatSide) return 0;
    return cosine > 0 ? 1 : -1;
  }

  double height_over(const TriangleSurface::Face& face, const ConvexPiece& b) const {
    return face.normal.dot(b_in_a_.apply(b.centre()) - face.corners[0]);
  }

  // How far the piece's lowest point, towards the front (`side` 1) or the back (-1), is over the
  // face.
  double farthest_over(const TriangleSurface::Face& face, const ConvexPiece& b, int side) const {
    const Vec3 outward = side * face.normal;
    const Vec3 farthest = b_in_a_.apply(b.farthest(b_in_a_.turn.transpose() * outward));
    return outward.dot(farthest - face.corners[0]) + b.radius_m();
  }

  // The side on which what is nearest of the piece is, where that is clear, else its centre: on a
  // dome the centre of a wide piece is behind the planes of all faces but those below its middle.
  int8_t side_of(uint32_t place, const ConvexPiece& b) const {
    const TriangleSurface::Face face = shape_a_.surface->face(place);
    if (shape_a_.surface->has_one_side()) return 1;
    const int8_t of_centre = height_over(face, b) >= 0 ? 1 : -1;
    // A piece inside a solid leaves it as it came; a sheet has no inside.
    if (is_inside_ && shape_a_.surface->is_solid()) return of_centre;
    if (farthest_over(face, b, -of_centre) < 0) return of_centre;
    KnownVertices none;
    const Separation apart = find_separation(ConvexPiece(face.corners), b, b_in_a_, Vec3::Zero(),
                                             std::numeric_limits<double>::infinity(), none);
    if (apart.distance_m < -kContactMargin * small_) return of_centre;
    const int8_t side = side_along(apart.normal, face);
    return side != 0 ? side : of_centre;
  }

  // A sheet has two sides. On which one of a triangle a piece is that has just come to it, those
  // beside it tell that it pokes into, else how it lies, and where that is not clear all beside it.
  void settle_sides() {
    std::vector<uint32_t>& unsure = scratch_.unsure;
    unsure.clear();
    for (uint32_t i = 0; i < pair_.pieces.size(); ++i) {
      if (pair_.pieces[i].side == 0 && pair_.pieces[i].bound_m <= reach_m_) unsure.push_back(i);
    }
    const auto settle = [&](auto&& side) {
      return std::erase_if(unsure, [&](uint32_t i) {
        pair_.pieces[i].side = side(pair_.pieces[i]);
        return pair_.pieces[i].side != 0;
      });
    };
    while (settle([&](const PiecePair& pieces) {
             return side_of_neighbours(pieces, -kContactMargin * small_);
           }) > 0) {
    }
    settle([&](const PiecePair& pieces) -> int8_t {
      const TriangleSurface::Face face = shape_a_.surface->face(pieces.a);
      KnownVertices none;
      const Separation apart =
          find_separation(ConvexPiece(face.corners), shape_b_.pieces[pieces.b], b_in_a_,
                          Vec3::Zero(), std::numeric_limits<double>::infinity(), none);
      return apart.distance_m > 0 ? side_along(apart.normal, face) : int8_t{0};
    });
    while (settle([&](const PiecePair& pieces) { return side_of_neighbours(pieces, reach_m_); }) >
           0) {
    }
  }

  // The side that triangles no farther from it know. 0: none, or they differ.
  int8_t side_of_neighbours(const PiecePair& pieces, double most_m) const {
    int sum = 0;
    for (const uint32_t neighbour : shape_a_.surface->neighbours(pieces.a)) {
      if (neighbour == pieces.a) continue;
      const auto found = std::ranges::lower_bound(
          pair_.pieces, std::pair(neighbour, pieces.b), {},
          [](const PiecePair& other) { return std::pair(other.a, other.b); });
      if (found == pair_.pieces.end() || found->a != neighbour || found->b != pieces.b) continue;
      if (found->bound_m <= most_m) sum += found->side;
    }
    return static_cast<int8_t>(sum > 0 ? 1 : sum < 0 ? -1 : 0);
  }

  // Never into the surface, nor against an edge that is inside of it.
  void touch_triangle(PiecePair& pieces, const ConvexPiece& triangle, const ConvexPiece& b,
                      const Relative& relative, Separation separation, double reach) {
    const TriangleSurface::Face face = shape_a_.surface->face(pieces.a);
    Vec3 allowed =
        shape_a_.surface->allowed(pieces.a, pieces.side, separation.on_a, separation.normal);
    if (around_a_.all != nullptr && around_a_.all->is_beside(around_a_.thing, pieces.a)) {
      const auto lowest = [&](const Vec3& direction) {
        const Vec3 in_b = -(relative.turn.transpose() * direction);
        return direction.dot(relative.apply(b.farthest(in_b))) - b.radius_m();
      };
      allowed = around_a_.all->outward(around_a_.thing, pieces.a, pieces.side, separation.on_a,
                                       allowed, small_, lowest);
      if (allowed.isZero(0)) return;
    }
    // The edge of what goes down on the other side is not touched from behind.
    if (allowed.dot(separation.normal) <= (pieces.side > 0 ? 0 : kOnThatSide)) return;
    const size_t first = scratch_.all.size();
    const bool is_corrected = (allowed - separation.normal).norm() > kSameWay;
    if (is_corrected) {
      separation.normal = allowed;
      separation.distance_m = separation_along(triangle, b, relative, allowed);
      separation.on_b = relative.apply(b.farthest(-(relative.turn.transpose() * allowed))) -
                        b.radius_m() * allowed;
      separation.on_a = separation.on_b - separation.distance_m * allowed;
      if (separation.distance_m > reach) return;
    }
    const Feature feature =
        add_manifold(triangle, b, relative, separation, reach, scratch_.manifold, scratch_.all);
    const bool is_beside = feature.of == Feature::Of::none;
    if (is_beside && is_corrected) {
      scratch_.all.resize(first);
      scratch_.all.push_back(
          {(separation.on_a + separation.on_b) / 2, allowed, separation.distance_m});
    }
    // A point that is not over the triangle, or is beside it, is its neighbour's.
    size_t kept = first;
    for (size_t i = first; i < scratch_.all.size(); ++i) {
      const SurfacePoint& point = scratch_.all[i];
      if (is_corrected && !is_over(pieces, face, point)) continue;
      if (is_beside && point.normal.dot(separation.normal) < 1 - 1e-6) continue;
      scratch_.all[kept++] = point;
    }
    scratch_.all.erase(scratch_.all.begin() + static_cast<std::ptrdiff_t>(kept),
                       scratch_.all.end());
  }

  // Over the triangle, or coming to it within the step across the bottom of a valley: without that
  // contact a body would be in the other slope before it meets it.
  bool is_over(const PiecePair& pieces, const TriangleSurface::Face& face,
               const SurfacePoint& point) const {
    for (size_t k = 0; k < 3; ++k) {
      const Vec3 side = face.corners[(k + 1) % 3] - face.corners[k];
      const Vec3 outward = side.cross(face.normal);  // as long as the edge
      const double beyond = outward.dot(point.place - face.corners[k]);
      if (beyond <= 1e-6 * side.squaredNorm()) continue;
      const bool comes = point.distance_m > 0 &&
                         shape_a_.surface->is_valley(pieces.a, k, pieces.side) &&
                         beyond <= -outward.dot(turn_a_.transpose() * displacement_);
      if (!comes) return false;
    }
    return true;
  }

  // Pairs of pieces whose boxes, widened, meet; those that were listed keep what is known of them.
  void list_pieces() {
    const double margin = kListMargin * std::min(shape_b_.smallest_extent_m,
                                                 shape_a_.surface ? shape_b_.smallest_extent_m
                                                                  : shape_a_.smallest_extent_m);
    if (is_of_one_piece_) {
      pair_.list_bound_m = std::numeric_limits<float>::infinity();
      if (pair_.pieces.empty()) pair_.pieces.push_back({});
      return;
    }
    const std::vector<PiecePair>& former = pair_.pieces;
    std::vector<PiecePair>& listed = scratch_.pieces;
    listed.clear();
    const double around = reach_m_ + margin;
    const Mat3 spread = b_in_a_.turn.cwiseAbs();
    auto known = former.begin();
    std::vector<NarrowScratch::Met>& met = scratch_.met;
    met.clear();
    for (uint32_t j = 0; j < shape_b_.pieces.size(); ++j) {
      const Bounds& own = shape_b_.pieces[j].box();
      const Vec3 centre = b_in_a_.apply(own.center()), half = spread * (own.sizes() / 2);
      if (shape_a_.surface) {
        const Vec3 wide = half + Vec3::Constant(around);
        const Bounds box(Vec3(centre - wide), Vec3(centre + wide));
        shape_a_.surface->tree().for_each_near(box, 0, [&](uint32_t place) {
          const Corners& corners = shape_a_.surface->tree().corners()[place];
          const Bounds of_face = Bounds(corners[0]).extend(corners[1]).extend(corners[2]);
          if (of_face.intersects(box)) met.push_back({place, j, -1});
        });
        continue;
      }
      for (uint32_t i = 0; i < shape_a_.pieces.size(); ++i) {
        const Bounds& other = shape_a_.pieces[i].box();
        const Vec3 apart = (centre - half - other.max()).cwiseMax(other.min() - (centre + half));
        const double gap = apart.maxCoeff();
        if (gap <= around) met.push_back({i, j, gap});
      }
    }
    std::ranges::sort(met, {},
                      [](const NarrowScratch::Met& m) { return uint64_t{m.a} << 32 | m.b; });
    for (const auto& [i, j, gap] : met) {
      while (known != former.end() && std::pair(known->a, known->b) < std::pair(i, j)) ++known;
      if (known != former.end() && known->a == i && known->b == j) {
        listed.push_back(*known);
        continue;
      }
      PiecePair& made = listed.emplace_back(PiecePair{i, j});
      if (shape_a_.surface && shape_a_.surface->is_solid()) {
        made.side = side_of(i, shape_b_.pieces[j]);
      }
      // A piece as far away as its box is not tested yet.
      if (gap > 0) spend(made.bound_m = static_cast<float>(gap), 0);
    }
    // There are many lists: none has much room to spare.
    if (pair_.pieces.capacity() > 2 * listed.size()) std::vector<PiecePair>().swap(pair_.pieces);
    pair_.pieces.assign(listed.begin(), listed.end());
    pair_.list_bound_m = static_cast<float>(around);
  }

  // Pairs of pieces know nothing of each other, and may push against each other for ever: of their
  // directions the one by which all that do come apart soonest.
  void separate_one_way() {
    const auto distance = [&](const PiecePair& pieces, const Vec3& normal) {
      return separation_along(shape_a_.pieces[pieces.a], shape_b_.pieces[pieces.b], b_in_a_,
                              normal);
    };
    std::vector<uint32_t> touching;
    for (uint32_t i = 0; i < pair_.pieces.size(); ++i) {
      if (pair_.pieces[i].bound_m < kContactMargin * small_) touching.push_back(i);
    }
    const auto opposed = [&](uint32_t i, uint32_t j) {
      const PiecePair &one = pair_.pieces[i], &other = pair_.pieces[j];
      return std::min(one.bound_m, other.bound_m) < -kDeepPieces * small_ &&
             one.axis.dot(other.axis) < kOpposed;
    };
    const bool conflict = std::ranges::any_of(touching, [&](uint32_t i) {
      return std::ranges::any_of(touching, [&](uint32_t j) { return opposed(i, j); });
    });
    if (!conflict) {
      pair_.exit_normal.setZero();
      return;
    }
    // How far they are to go; the search ends where it is no better than `most`.
    const auto depth = [&](const Vec3& normal, double most) {
      double deepest = 0;
      for (const uint32_t i : touching) {
        deepest = std::max(deepest, -distance(pair_.pieces[i], normal));
        if (deepest >= most) break;
      }
      return deepest;
    };
    Vec3 exit_normal = pair_.exit_normal.cast<double>();
    double least = std::numeric_limits<double>::infinity();
    if (!exit_normal.isZero()) {
      exit_normal.normalize();
      least = kBetterExit * depth(exit_normal, least);
    }
    const auto consider = [&](const Vec3& normal) {
      const double candidate = depth(normal, least);
      if (candidate >= least) return;
      least = candidate;
      exit_normal = normal;
    };
    for (const uint32_t i : touching) {
      const PiecePair& pieces = pair_.pieces[i];
      consider(pieces.axis.cast<double>());
      for (const auto& face : shape_a_.pieces[pieces.a].faces()) consider(face.normal);
      for (const auto& face : shape_b_.pieces[pieces.b].faces()) {
        consider(-(b_in_a_.turn * face.normal));
      }
    }
    pair_.exit_normal = exit_normal.cast<float>();
    const Vec3 normal = turn_a_ * exit_normal;
    std::erase_if(scratch_.all, [&](const SurfacePoint& point) {
      return std::ranges::binary_search(touching, point.pieces) &&
             point.normal.dot(normal) < kAgrees;
    });
    for (const uint32_t i : touching) {
      const PiecePair& pieces = pair_.pieces[i];
      const double apart = distance(pieces, exit_normal);
      if (pieces.axis.cast<double>().dot(exit_normal) >= kAgrees || apart >= 0) continue;
      const ConvexPiece &a = shape_a_.pieces[pieces.a], &b = shape_b_.pieces[pieces.b];
      const size_t first = scratch_.all.size();
      add_deepest(b, b_in_a_, exit_normal, apart);
      add_contacts(first, 0, is_round(a) || is_round(b));
    }
  }

  // Points from `first` on were found `t` seconds from now: to the world, and to how far they are
  // apart now.
  void add_contacts(size_t first, double t, bool is_round) {
    for (size_t i = first; i < scratch_.all.size(); ++i) {
      SurfacePoint& point = scratch_.all[i];
      const Vec3 place = position_a_ + turn_a_ * point.place;
      point.normal = turn_a_ * point.normal;
      const Vec3 arm_a = place - position_a_, arm_b = place - position_b_;
      point.gap_m = point.distance_m;
      const double parting =
          point.normal.dot(b_.velocity + b_.spin.cross(arm_b) - a_.velocity - a_.spin.cross(arm_a));
      if (t > 0) point.distance_m -= t * parting;
      point.later_m = point.distance_m + step_s_ * parting;
      point.place = arm_a;
      point.other_arm = arm_b;
      point.time_s = t;
      point.is_round = is_round;
    }
  }

  // One set for the pair: of each plane the points that span it.
  void reduce() {
    std::vector<SurfacePoint>& all = scratch_.all;
    if (all.size() <= 1 || (pair_.pieces.size() <= 1 && all.size() <= kMostOfPlane)) return;
    std::vector<SurfacePoint>& kept = scratch_.points;
    kept.clear();
    std::ranges::stable_sort(all, {}, &SurfacePoint::distance_m);
    std::vector<uint8_t>& taken = scratch_.taken;
    taken.assign(all.size(), 0);
    for (size_t i = 0; i < all.size(); ++i) {
      if (taken[i] != 0) continue;
      const size_t first = kept.size();
      const Vec3& normal = all[i].normal;
      const double level = normal.dot(all[i].place);
      for (size_t j = i; j < all.size(); ++j) {
        if (taken[j] != 0 || all[j].normal.dot(normal) < kSamePlane) continue;
        // Planes side by side: steps of a stair.
        if (std::abs(normal.dot(all[j].place) - level) > 0.1 * small_) continue;
        taken[j] = 1;
        kept.push_back(all[j]);
      }
      keep_lowest(kept, first, kResolution * small_, kSameDepth * small_);
    }
    std::swap(all, kept);
  }

  // For reuse_contacts(). Round sides roll on, bodies that leave each other one way ask where to,
  // and those that meet within the step come to other places.
  void note_found() {
    const bool may_reuse = pair_.exit_normal.isZero(0) &&
                           std::ranges::none_of(scratch_.all, [](const SurfacePoint& point) {
                             return point.is_round || point.time_s > 0;
                           });
    pair_.found_turn = (a_.orientation.conjugate() * b_.orientation).cast<float>();
    pair_.found_shift = b_in_a_.shift;
    pair_.found_margin_m = may_reuse ? static_cast<float>(reach_.least_m) : -1;
  }

  Pair& pair_;
  const PosedBody& a_;
  const PosedBody& b_;
  const CollisionShape& shape_a_;
  const CollisionShape& shape_b_;
  NarrowScratch& scratch_;
  double step_s_;
  bool is_of_one_piece_;  // each body is
  Mat3 turn_a_;
  Relative b_in_a_;
  Vec3 position_a_, position_b_;  // as relative_at() has left them
  double small_, turning_ = 0, near_m_ = 0;
  ModelSurroundings::Place around_a_, around_b_;  // of the one that is static, if any
  Vec3 displacement_;     // m, world: of b against a in the step, if nothing stops it
  double unknown_m_ = 0;  // and by turning, and by gravity, in any direction
  double reach_m_ = 0;    // in any direction: nothing farther can touch
  Reach reach_ = 0;
  bool is_inside_ = false;  // of a surface, through faces that were before it
};

}  // namespace

bool may_touch(Pair& pair, const MotionBound& a, const MotionBound& b,
               const NarrowSettings& settings) {
  const auto h = static_cast<float>(settings.step_s);
  const auto fall = a.is_awake != b.is_awake ? static_cast<float>(settings.gravity) * h * h : 0.0F;
  const Vec3f moved = b.moved - a.moved, velocity = b.velocity - a.velocity;
  const float turned = a.turned_m + b.turned_m, motion = moved.norm();
  pair.motion_m += motion + turned;
  float closing = velocity.norm();
  if (pair.toward.isZero(0)) {
    spend(pair.bound_m, motion + turned);
  } else {
    spend(pair.bound_m, turned - pair.toward.dot(moved));
    closing = std::max(0.0F, -pair.toward.dot(velocity));
  }
  const float reach = static_cast<float>(kContactMargin) * std::min(a.extent_m, b.extent_m) + fall +
                      h * (closing + a.turning_m_s + b.turning_m_s);
  constexpr float kSurely = 1 + 1e-5F;
  return pair.bound_m <= kSurely * reach;
}

bool reuse_contacts(const Pair& pair, const PosedBody& a, const PosedBody& b,
                    const NarrowSettings& settings, std::span<const Contact> former,
                    std::vector<Contact>& contacts) {
  if (pair.found_margin_m < 0) return false;
  const double h = settings.step_s;
  const double most_m = kResolution * smaller_extent(*a.shape, *b.shape);
  const Vec3 apart = b.position - a.position;
  const Vec3 moved = a.turn.transpose() * apart - pair.found_shift;
  const Quat since =
      a.orientation.conjugate() * b.orientation * pair.found_turn.conjugate().cast<double>();
  const double motion = moved.norm() + 2 * since.vec().norm() * b.shape->radius_m;
  if (motion > most_m) return false;
  const double fall = a.is_awake != b.is_awake ? settings.gravity * h * h : 0;
  const double ahead =
      h * ((b.velocity - a.velocity).norm() + a.turning_m_s + b.turning_m_s) + fall;
  if (motion + ahead > pair.found_margin_m) return false;
  const Vec3 shifted = a.turn * moved;
  const Vec3 turned = a.turn * (std::copysign(2.0, since.w()) * since.vec());  // rad
  for (const Contact& old : former) {
    Contact& contact = contacts.emplace_back(old);
    const Vec3 arm_b = b.turn * old.found_on_b.cast<double>();
    const Vec3 normal = (old.is_of_b ? b.turn : a.turn) * old.found_normal.cast<double>();
    contact.arm_b = arm_b.cast<float>();
    contact.arm_a = (arm_b + apart).cast<float>();
    contact.normal = normal.cast<float>();
    contact.distance_m =
        static_cast<float>(old.found_distance_m + normal.dot(turned.cross(arm_b) + shifted));
    contact.gap_m = contact.distance_m;
    contact.friction_n -= contact.friction_n.dot(contact.normal) * contact.normal;
    contact.bounce = contact.impact_s = 0;
    contact.hits = false;
  }
  return true;
}

void find_contacts(Pair& pair, const PosedBody& a, const PosedBody& b,
                   const NarrowSettings& settings, std::span<const Contact> former,
                   std::vector<Contact>& contacts, NarrowScratch& scratch) {
  Finder finder(pair, a, b, settings, scratch);
  finder.find();
  finder.take_over(former, contacts);
}

}  // namespace pilesim::exact

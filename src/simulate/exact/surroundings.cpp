#include "simulate/exact/surroundings.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "simulate/exact/exact_constants.h"

namespace pilesim::exact {

using namespace exact_constants;

namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();
constexpr uint32_t kWhole = ~uint32_t{0};  // of a surface: all of its triangles
constexpr uint32_t kLeafSize = 4;
// A normal that has to turn by more to leave all that is there (the cosine) is of another contact.
constexpr double kLeastAgreement = 0.1;
constexpr int kMostConstraints = 12;
constexpr int kMostLifts = 4;
// Faces whose angle has a smaller sine are one face, not a valley.
constexpr double kFlush = 1e-3;

// Something solid at a point, in its own frame.
struct Solid {
  const Surroundings::Thing* thing;
  const ConvexPiece* piece = nullptr;             // or
  std::optional<TriangleSurface::Face> triangle;  // or the half-space below the thing's plane
  bool has_inside = true;                         // of a triangle: what is behind it is solid

  Vec3 to_own(const Vec3& point) const {
    return thing->turn.transpose() * (point - thing->position);
  }

  // The way into it from `point` that exceeds `normal` most, and by how much, m. Both are in the
  // frame of all.
  std::pair<Vec3, double> worst(const Vec3& point, const Vec3& normal) const {
    const Vec3 at = to_own(point), towards = thing->turn.transpose() * normal;
    Vec3 way = Vec3::Zero();
    double most = -kInfinite;
    const auto consider = [&](const Vec3& into) {
      const double exceeds = towards.dot(into);
      if (exceeds <= most) return;
      most = exceeds;
      way = into;
    };
    // Endless: any excess is too much.
    const auto consider_endless = [&](const Vec3& into) {
      constexpr double kFar = 1e6;
      const double exceeds = towards.dot(into);
      if (exceeds > kSameNormalEnd) consider(kFar * into);
    };
    if (piece != nullptr) {
      consider(piece->farthest(towards) + piece->radius_m() * towards - at);
    } else if (triangle) {
      for (const Vec3& corner : triangle->corners) consider(corner - at);
      if (has_inside) consider_endless(-triangle->normal);
    } else {
      const Vec3 across = towards - towards.y() * Vec3::UnitY();
      if (across.squaredNorm() > 0) consider_endless(across.normalized());
      consider_endless(-Vec3::UnitY());
    }
    const double length = way.norm();
    if (length == 0) return {Vec3::Zero(), -kInfinite};
    return {Vec3(thing->turn * (way / length)), most};
  }

  static constexpr double kSameNormalEnd = 1e-6;
};

}  // namespace

// One question of outward().
class Surroundings::Search {
 public:
  Search(const Surroundings& all, uint32_t thing, uint32_t piece, int side, double small_m,
         const Lowest& lowest)
      : all_(all),
        self_(thing),
        own_(all.things_[thing]),
        lowest_(lowest),
        piece_(own_.shape->surface ? nullptr : &own_.shape->pieces[piece]),
        side_(side),
        small_m_(small_m),
        tolerance_m_(kResolution * small_m) {
    if (own_.shape->surface) triangle_.emplace(own_.shape->surface->face(piece));
  }

  // In the thing's frame, as outward().
  Vec3 outward(const Vec3& own_point, const Vec3& own_normal) {
    const Vec3 point = own_.position + own_.turn * own_point, normal = own_.turn * own_normal;
    find(point);
    if (all_leave(point, normal)) return own_normal;
    if (const Vec3 turned = nearest(point, normal); !turned.isZero(0)) return to_own(turned);
    if (const Vec3 open = where_open(point, normal); !open.isZero(0)) return to_own(open);
    const bool is_apart = lowest_(own_normal) > own_normal.dot(own_point);
    return is_apart ? Vec3(Vec3::Zero()) : to_own(of_own_face(point, normal));
  }

 private:
  Vec3 to_own(const Vec3& direction) const { return own_.turn.transpose() * direction; }

  // Puts all else that is at the point into solids_.
  void find(const Vec3& point) {
    solids_.clear();
    for (const uint32_t plane : all_.planes_) {
      const Thing& thing = all_.things_[plane];
      const Vec3 at = thing.turn.transpose() * (point - thing.position);
      if (plane != self_ && at.y() <= tolerance_m_) solids_.push_back({&thing});
    }
    const Vec3 around = Vec3::Constant(tolerance_m_);
    const Bounds box(Vec3(point - around), Vec3(point + around));
    all_.tree_.for_each_near(box, 0, [&](uint32_t place) {
      const Item& item = all_.items_[all_.tree_.items()[place]];
      const Thing& thing = all_.things_[item.thing];
      const Vec3 at = thing.turn.transpose() * (point - thing.position);
      if (item.piece == kWhole) {
        if (item.thing != self_) find_triangles(thing, at);
        return;
      }
      const ConvexPiece& piece = thing.shape->pieces[item.piece];
      const bool is_own = item.thing == self_ && &piece == piece_;
      if (!is_own && piece.holds(at, tolerance_m_)) solids_.push_back({&thing, &piece});
    });
  }

  // A triangle of a solid is as thick as what meets it.
  void find_triangles(const Thing& thing, const Vec3& at) {
    const TriangleSurface& surface = *thing.shape->surface;
    const double thick = surface.is_solid() ? small_m_ : tolerance_m_;
    const Vec3 around = Vec3::Constant(thick);
    const Bounds box(Vec3(at - around), Vec3(at + around));
    found_.clear();
    double highest_m = -kInfinite;
    Vec3 nearest = Vec3::Zero();  // the normal of the face that is nearest to the point
    surface.tree().for_each_near(box, 0, [&](uint32_t place) {
      const TriangleSurface::Face face = surface.face(place);
      const double height = face.normal.dot(at - face.corners[0]);
      if (height > tolerance_m_ || height < -thick || !is_over(face, at)) return;
      found_.emplace_back(height, face);
      if (height <= highest_m) return;
      highest_m = height;
      nearest = face.normal;
    });
    // A point on the surface is not below its other faces, nor one inside below the far side.
    const bool is_on_it = highest_m >= -tolerance_m_;
    for (const auto& [height, face] : found_) {
      if (is_on_it ? height < -tolerance_m_ : face.normal.dot(nearest) < 0) continue;
      solids_.push_back({&thing, nullptr, face, surface.is_solid()});
    }
  }

  bool is_over(const TriangleSurface::Face& face, const Vec3& point) const {
    for (size_t k = 0; k < 3; ++k) {
      const Vec3 edge = face.corners[(k + 1) % 3] - face.corners[k];
      const Vec3 outward = edge.cross(face.normal);
      if (outward.dot(point - face.corners[k]) > tolerance_m_ * outward.norm()) return false;
    }
    return true;
  }

  // Whether nothing of solids_ is in front of the plane through the point.
  bool all_leave(const Vec3& point, const Vec3& normal) const {
    return std::ranges::all_of(solids_, [&](const Solid& solid) {
      return solid.worst(point, normal).second <= tolerance_m_;
    });
  }

  // The nearest to `normal` along which all that is at the point, the piece too, is left; or zero.
  Vec3 nearest(const Vec3& point, const Vec3& normal) {
    constraints_.clear();
    Vec3 best = normal;
    for (int i = 0; i < kMostConstraints; ++i) {
      Vec3 into = Vec3::Zero();
      double most = tolerance_m_;
      const auto consider = [&](const Solid& solid) {
        const auto [way, exceeds] = solid.worst(point, best);
        if (exceeds <= most) return;
        most = exceeds;
        into = way;
      };
      for (const Solid& solid : solids_) consider(solid);
      consider(own_solid());
      if (into.isZero(0)) return best;
      constraints_.push_back(into);
      best = out_of(normal, constraints_);
      if (best.norm() < kLeastAgreement) return Vec3::Zero();
      best.normalize();
    }
    return Vec3::Zero();
  }

  Solid own_solid() const { return {&own_, piece_, triangle_, false}; }

  // The normal of the piece where it goes on when the point comes out of what covers it: a wall
  // that stands on a floor is a wall however deep a body is in the floor, and of a floor at the
  // foot of a slope the upper side counts, not the end that is below the slope. Zero: it does not
  // go on.
  Vec3 where_open(Vec3 point, const Vec3& normal) {
    for (int lift = 0; lift < kMostLifts; ++lift) {
      bool is_covered = false;
      Vec3 way = Vec3::Zero();
      double most = -kInfinite;
      for (const Solid& solid : solids_) {
        if (solid.worst(point, normal).second <= tolerance_m_) continue;
        is_covered = true;
        const auto [apart, out] = way_out(solid, point);
        if (apart <= most) continue;
        most = apart;
        way = out;
      }
      if (!is_covered) {
        const bool is_its_own = own_solid().worst(point, normal).second <= tolerance_m_;
        const Vec3 face = own_face(point);
        return is_its_own || face.isZero(0) ? normal : face;
      }
      // Along its own face, behind which is its own solid and before it nothing; in a valley that
      // is farther than straight out.
      const Vec3 across = own_face(point);
      const Vec3 along = way - way.dot(across) * across;
      if (along.norm() <= kFlush * way.norm()) return Vec3::Zero();
      point += way.squaredNorm() / along.squaredNorm() * along;
      const Vec3 at = own_.turn.transpose() * (point - own_.position);
      if (piece_ != nullptr ? !piece_->holds(at, tolerance_m_) : !is_over(*triangle_, at)) break;
      find(point);
    }
    return Vec3::Zero();
  }

  // The normal of its face at the point, of several the one that the body is most outside of; zero:
  // there is none.
  Vec3 own_face(const Vec3& point) const {
    if (triangle_) return own_.turn * (side_ * triangle_->normal);
    const Vec3 at = own_.turn.transpose() * (point - own_.position);
    double most = -kInfinite;
    Vec3 normal = Vec3::Zero();
    for (const ConvexPiece::Face& face : piece_->faces()) {
      if (std::abs(face.offset_m - face.normal.dot(at)) > tolerance_m_) continue;
      const double apart = separation(own_, face.normal, face.offset_m);
      if (apart <= most) continue;
      most = apart;
      normal = own_.turn * face.normal;
    }
    return normal;
  }

  // How far the body that meets the piece is out of the solid where it comes out soonest, m, and
  // the way by which the point comes out there, and a little more.
  std::pair<double, Vec3> way_out(const Solid& solid, const Vec3& point) const {
    const Vec3 at = solid.to_own(point);
    double most = -kInfinite;
    Vec3 way = Vec3::Zero();
    const auto consider = [&](const Vec3& normal, double offset_m) {
      const double apart = separation(*solid.thing, normal, offset_m);
      if (apart <= most) return;
      most = apart;
      const double depth = std::max(0.0, offset_m - normal.dot(at));
      way = (depth + 3 * tolerance_m_) * (solid.thing->turn * normal);
    };
    if (solid.triangle) {
      const TriangleSurface::Face& face = *solid.triangle;
      consider(face.normal, face.normal.dot(face.corners[0]));
    } else if (solid.piece != nullptr) {
      for (const ConvexPiece::Face& face : solid.piece->faces()) {
        consider(face.normal, face.offset_m);
      }
    } else {
      consider(Vec3::UnitY(), 0);
    }
    return {most, way};
  }

  // How far the body that meets the piece is over a plane of a thing's frame, m.
  double separation(const Thing& thing, const Vec3& normal, double offset_m) const {
    const Vec3 towards = thing.turn * normal;
    const double shift = towards.dot(own_.position - thing.position);
    return lowest_(to_own(towards)) + shift - offset_m;
  }

  // The body is deeper in all of them than their edge: along which face of the piece it comes out
  // soonest. Zero: along none.
  Vec3 of_own_face(const Vec3& point, const Vec3& normal) {
    if (piece_ == nullptr) {
      const Vec3 own = own_face(point);
      find(point);
      return all_leave(point, own) ? own : Vec3::Zero();
    }
    std::vector<std::pair<double, Vec3>> faces;  // how far out, and the way to the face
    const Vec3 at = own_.turn.transpose() * (point - own_.position);
    for (const ConvexPiece::Face& face : piece_->faces()) {
      if (face.normal.dot(to_own(normal)) > kSamePlane) continue;
      const double depth = std::max(0.0, face.offset_m - face.normal.dot(at));
      faces.emplace_back(separation(own_, face.normal, face.offset_m),
                         own_.turn * face.normal * (depth + kLeast));
    }
    std::ranges::sort(faces, std::greater(), &std::pair<double, Vec3>::first);
    for (const auto& [apart, way] : faces) {
      const Vec3 at_face = point + way;
      find(at_face);
      if (Vec3 turned = nearest(at_face, normal); !turned.isZero(0)) return turned;
      Vec3 own = way.normalized();
      if (all_leave(at_face, own)) return own;
    }
    return Vec3::Zero();
  }

  static constexpr double kLeast = 1e-12;  // m: keeps a direction

  const Surroundings& all_;
  uint32_t self_;
  const Thing& own_;
  const Lowest& lowest_;
  const ConvexPiece* piece_;
  std::optional<TriangleSurface::Face> triangle_;
  int side_;
  double small_m_, tolerance_m_;
  std::vector<Solid> solids_;
  std::vector<std::pair<double, TriangleSurface::Face>> found_;  // height over it, m
  std::vector<Vec3> constraints_;
};

Surroundings::Surroundings(std::vector<Thing> things)
    : things_(std::move(things)),
      tree_({}, {}, kLeafSize),
      beside_(things_.size()),
      on_surfaces_(things_.size()) {
  std::vector<Bounds> boxes;
  std::vector<Vec3> centres;
  for (uint32_t t = 0; t < things_.size(); ++t) {
    const Thing& thing = things_[t];
    if (thing.shape->is_plane) {
      planes_.push_back(t);
    } else if (thing.shape->surface) {
      items_.push_back({t, kWhole});
    } else {
      for (uint32_t p = 0; p < thing.shape->pieces.size(); ++p) items_.push_back({t, p});
    }
  }
  for (const Item& item : items_) {
    boxes.push_back(box_of(things_[item.thing], item.piece));
    centres.push_back(boxes.back().center());
  }
  tree_ = BoxTree(boxes, centres, kLeafSize);
  // `near`: a box of the frame of all.
  const auto mark_near = [&](const Item& item, const Bounds& near) {
    const Thing& thing = things_[item.thing];
    if (item.piece != kWhole) {
      beside_[item.thing].resize(thing.shape->pieces.size());
      beside_[item.thing][item.piece] = 1;
      return;
    }
    std::unique_ptr<SurfaceMarks>& marks = on_surfaces_[item.thing];
    if (!marks) marks = std::make_unique<SurfaceMarks>();
    const Vec3 half = thing.turn.transpose().cwiseAbs() * (near.sizes() / 2);
    const Vec3 centre = thing.turn.transpose() * (near.center() - thing.position);
    marks->near.emplace_back(Vec3(centre - half), Vec3(centre + half));
  };
  for (uint32_t i = 0; i < items_.size(); ++i) {
    for (const uint32_t p : planes_) {
      const Vec3 normal = things_[p].turn * Vec3::UnitY();
      const Vec3 half = boxes[i].sizes() / 2;
      const double lowest =
          normal.dot(boxes[i].center() - things_[p].position) - normal.cwiseAbs().dot(half);
      if (lowest <= 0) mark_near(items_[i], boxes[i]);
    }
    tree_.for_each_near(boxes[i], 0, [&](uint32_t place) {
      const uint32_t j = tree_.items()[place];
      if (i == j || !boxes[i].intersects(boxes[j])) return;
      mark_near(items_[i], boxes[j]);
    });
  }
}

const std::vector<uint8_t>& Surroundings::marks_of(uint32_t thing) const {
  if (!on_surfaces_[thing]) return beside_[thing];
  SurfaceMarks& marks = *on_surfaces_[thing];
  std::call_once(marks.once, [&] {
    const TriangleTree& tree = things_[thing].shape->surface->tree();
    marks.triangles.resize(tree.triangles().size());
    for (const Bounds& near : marks.near) {
      tree.for_each_near(near, 0, [&](uint32_t place) { marks.triangles[place] = 1; });
    }
  });
  return marks.triangles;
}

// A little wider.
Bounds Surroundings::box_of(const Thing& thing, uint32_t piece) const {
  const Bounds& own = piece == kWhole ? thing.shape->box : thing.shape->pieces[piece].box();
  const Vec3 half = thing.turn.cwiseAbs() * (own.sizes() / 2);
  const Vec3 centre = thing.position + thing.turn * own.center();
  const Vec3 wide = half + Vec3::Constant(kResolution * half.maxCoeff());
  return {Vec3(centre - wide), Vec3(centre + wide)};
}

Vec3 Surroundings::outward(uint32_t thing, uint32_t piece, int side, const Vec3& point,
                           const Vec3& normal, double small_m, const Lowest& lowest) const {
  return Search(*this, thing, piece, side, small_m, lowest).outward(point, normal);
}

ModelSurroundings::ModelSurroundings(const Model& model, std::span<const CollisionShape> shapes)
    : places_(model.bodies.size()) {
  std::vector<uint8_t> stays(model.bodies.size(), 0);
  for (size_t i = 0; i < model.bodies.size(); ++i) {
    stays[i] = model.bodies[i].role == Role::fixed && model.bodies[i].start_s == kFromTheStart;
  }
  for (const ModelEvent& event : model.events) {
    if (event.kind != ModelEvent::Kind::remove) continue;
    for (const uint32_t body : event.bodies) stays[body] = 0;
  }
  const auto add = [&](std::vector<Surroundings::Thing> things, std::span<const uint32_t> bodies) {
    groups_.push_back(std::make_unique<Surroundings>(std::move(things)));
    const Surroundings& all = *groups_.back();
    for (uint32_t t = 0; t < bodies.size(); ++t) {
      if (all.is_beside(t)) places_[bodies[t]] = {&all, t};
    }
  };
  std::vector<Surroundings::Thing> things;
  std::vector<uint32_t> fixed;
  for (uint32_t i = 0; i < model.bodies.size(); ++i) {
    const ModelBody& body = model.bodies[i];
    const CollisionShape& shape = shapes[body.shape];
    if (stays[i] != 0) {
      things.push_back({body.pose.position, body.pose.orientation.toRotationMatrix(), &shape});
      fixed.push_back(i);
    } else if (body.role != Role::dynamic && shape.pieces.size() > 1) {
      add({{Vec3::Zero(), Mat3::Identity(), &shape}}, std::array{i});
    }
  }
  if (!fixed.empty()) add(std::move(things), fixed);
}

}  // namespace pilesim::exact

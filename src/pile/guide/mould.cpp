#include "pile/guide/mould.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <span>
#include <utility>

#include "core/philox.h"
#include "geometry/inside_test.h"
#include "geometry/mass_properties.h"
#include "geometry/triangle_tree.h"
#include "model/body_distances.h"
#include "pile/guide/guide_constants.h"
#include "pile/guide/obstacle.h"
#include "pile/guide/room.h"
#include "simulate/exact/engine.h"

namespace pilesim {
namespace {

using namespace guide_constants;

constexpr int kHalvings = 30;

// A simulation of the mould and its contents.
class Mould {
 public:
  Mould(const Scene& scene, const Model& model, uint32_t attempt);
  MouldFilling run();

 private:
  bool comes_near(const ModelShape& shape, const Pose& pose) const;
  void add_what_stands();
  bool insert();
  void fall(double time);
  void tap();
  void settle();
  bool remove_penetrating();
  void set_friction(double share);
  double fastest() const;
  double outside_m(uint32_t body, const InsideTest& inside, const TriangleTree& walls) const;
  double gap_below(const MouldFilling& filling, const Vec3& up) const;
  double descent_m(const MouldFilling& filling, const Vec3& up, double most_m) const;
  MouldFilling read() const;

  const Model& model_;
  GuideFill fill_;
  uint64_t seed_, key_;  // of the random numbers
  double radius_ = 0;    // largest bounding radius of the bodies, m
  double thickness_ = std::numeric_limits<double>::infinity();
  double unit_s_ = 1, unit_speed_ = 1;  // sqrt(r / g), sqrt(g r)
  Scene scene_;
  Model world_;  // its bodies, then the mould and the obstacles
  std::unique_ptr<ExactEngine> engine_;
  std::unique_ptr<Room> room_;
  std::vector<std::vector<Vec3>> points_;  // by shape
  uint32_t next_ = 0;                      // next body to insert
  uint32_t rounds_ = 0;
  uint64_t steps_ = 0;
  StageTimer timer_;
};

Mould::Mould(const Scene& scene, const Model& model, uint32_t attempt)
    : model_(model),
      fill_(*model.guide_fill),
      seed_(scene.seed),
      key_(uint64_t{attempt} << 32 | fill_.emitter),
      scene_(scene) {
  const auto bodies = std::span(model.bodies).subspan(fill_.first, fill_.count);
  points_.resize(model.shapes.size());
  for (const ModelBody& body : bodies) {
    radius_ = std::max(radius_, model.shapes[body.shape].bounding_radius);
    thickness_ = std::min(thickness_, model.shapes[body.shape].smallest_extent);
  }
  const double gravity = scene.gravity.norm();
  unit_s_ = std::sqrt(radius_ / gravity);
  unit_speed_ = std::sqrt(radius_ * gravity);
  scene_.guide.reset();
  scene_.step_s = filling_step_s(scene, radius_);
  scene_.simulator.sleeping = false;
  world_.materials = model.materials;
  for (Material& material : world_.materials) material.restitution = 0;
  world_.shapes = model.shapes;
  ModelShape& walls = world_.shapes.emplace_back();
  walls.name = "guide";
  walls.mesh = model.guide;
  // Bodies touch closed surfaces from outside; turned inside out, the guide keeps them inside.
  for (Triangle& triangle : walls.mesh.triangles) std::swap(triangle[1], triangle[2]);
  walls.collides_as_mesh = true;
  walls.smallest_extent = thickness_;
  walls.bounding_radius = model.guide.bounds().sizes().norm();
  world_.bodies.assign(bodies.begin(), bodies.end());
  ModelBody mould{.name = "guide",
                  .shape = static_cast<uint32_t>(model.shapes.size()),
                  .material = bodies.front().material};
  mould.role = Role::fixed;
  mould.linear_velocity = mould.angular_velocity = Vec3::Zero();
  world_.bodies.push_back(std::move(mould));
  room_ = std::make_unique<Room>(model.guide, kMouldCell * thickness_);
  add_what_stands();
  engine_ = make_exact_engine(scene_, world_);
  for (uint32_t i = fill_.count; i < world_.bodies.size(); ++i) {
    const Pose& pose = world_.bodies[i].pose;
    engine_->add(i, {.position = pose.position, .orientation = pose.orientation}, false, false);
  }
  for (const ModelBody& body : bodies) {
    if (points_[body.shape].empty()) {
      points_[body.shape] = points_of(model.shapes[body.shape], room_->cell_m());
    }
  }
}

// Compares bounding boxes.
bool Mould::comes_near(const ModelShape& shape, const Pose& pose) const {
  if (shape.is_plane) return true;
  Bounds box;
  const Bounds own = shape.mesh.bounds();
  for (int corner = 0; corner < 8 && !own.isEmpty(); ++corner) {
    box.extend(pose.apply(own.corner(static_cast<Bounds::CornerType>(corner))));
  }
  const Vec3 round = Vec3::Constant(shape.bounding_radius);
  if (own.isEmpty()) box = Bounds(Vec3(pose.position - round), Vec3(pose.position + round));
  return box.intersects(widened(model_.guide.bounds(), room_->cell_m()));
}

// Adds fixed bodies of the scene that reach into the guide, such as ground that it is embedded in.
// Free cells keep half a cell from the walls, and so from bodies that only touch them.
void Mould::add_what_stands() {
  const Vec3 up = -scene_.gravity.normalized();
  const double near_m = room_->cell_m() / 2 - kLeastReach * thickness_;
  for (const ModelBody& body : model_.bodies) {
    if (!stands_still(body) || !comes_near(model_.shapes[body.shape], body.pose)) continue;
    const Obstacle obstacle(model_.shapes[body.shape], body.pose, model_.guide, up);
    if (!room_->block(obstacle, near_m)) continue;
    world_.bodies.push_back(body);
    world_.bodies.back().start_s = kFromTheStart;
  }
}

// Inserts bodies wherever there is room; true if it inserted any.
bool Mould::insert() {
  room_->clear();
  for (uint32_t i = 0; i < next_; ++i) {
    const BodyMotion motion = engine_->motion(i);
    room_->cover({motion.position, motion.orientation}, points_[world_.bodies[i].shape]);
  }
  room_->list_free();
  Philox draws(seed_, Stream::mould, key_, rounds_++);
  const uint32_t before = next_;
  for (int failed = 0; failed < kMouldTries && next_ < fill_.count;) {
    const std::vector<Vec3>& points = points_[world_.bodies[next_].shape];
    Pose pose;
    if (!room_->find(points, draws, pose)) {
      ++failed;
      continue;
    }
    failed = 0;
    room_->cover(pose, points);
    engine_->add(next_, {.position = pose.position, .orientation = pose.orientation}, false, false);
    engine_->set_friction(next_,
                          kSlippery * world_.materials[world_.bodies[next_].material].friction);
    ++next_;
  }
  return next_ > before;
}

void Mould::fall(double time) {
  const auto steps = static_cast<uint64_t>(std::ceil(time * unit_s_ / scene_.actual_step_s()));
  for (uint64_t i = 0; i < steps; ++i) engine_->step(timer_, [] {});
  steps_ += steps;
}

double Mould::fastest() const {
  double most = 0;
  for (uint32_t i = 0; i < next_; ++i) {
    if (!engine_->contains(i)) continue;
    const BodyMotion motion = engine_->motion(i);
    most = std::max(most, motion.linear_velocity.norm() + radius_ * motion.angular_velocity.norm());
  }
  return most;
}

void Mould::set_friction(double share) {
  for (uint32_t i = 0; i < next_; ++i) {
    engine_->set_friction(i, share * world_.materials[world_.bodies[i].material].friction);
  }
}

// Throws all bodies up a little, each a little differently.
void Mould::tap() {
  Philox draws(seed_, Stream::mould, key_, rounds_++);
  const Vec3 up = -scene_.gravity.normalized();
  for (uint32_t i = 0; i < next_; ++i) {
    const Vec3 aside = draws.direction();
    engine_->set_velocity(i, kTap * unit_speed_ * (up + 0.5 * aside), Vec3::Zero());
  }
  fall(kTapTime);
}

void Mould::settle() {
  for (int round = 0; round < kMouldSettle && fastest() > kSlow * unit_speed_; ++round) fall(1);
}

MouldFilling Mould::run() {
  uint32_t before_tap = 0;
  while (next_ < fill_.count) {
    const bool found_room = insert();
    fall(kMouldFall);
    if (rounds_ >= kMouldRounds) break;
    if (found_room || fastest() > kMouldRestSpeed * unit_speed_) continue;
    if (next_ - before_tap <= kWorthATap * next_) break;
    before_tap = next_;
    tap();
  }
  settle();
  set_friction(1);
  settle();
  for (int round = 0; round < kMouldRests && remove_penetrating(); ++round) {
    fall(1);  // let bodies fall that rested on them
    settle();
  }
  return read();
}

// Removes the upper body of each penetrating pair, and bodies that penetrate fixed ones: glue would
// hold them that way. True if it removed any. Contacts of bodies with several pieces point along
// their way out, which may be long.
bool Mould::remove_penetrating() {
  std::vector<BodyContact> contacts;
  engine_->read_contacts(contacts);
  const BodyDistances distances(world_);
  const auto placed = [&](uint32_t body) {
    const BodyMotion motion = engine_->motion(body);
    return distances.place(world_.bodies[body].shape, {motion.position, motion.orientation});
  };
  bool found = false;
  for (const BodyContact& contact : contacts) {
    const auto [a, b] = std::pair(contact.a, contact.b);
    const uint32_t wall = fill_.count;
    if (a == wall || b == wall || contact.distance_m > -kMostPenetration * radius_) continue;
    if (!engine_->contains(a) || !engine_->contains(b)) continue;
    if (distances.distance(placed(a), placed(b), 0) > -kMostPenetration * radius_) continue;
    const Vec3 from_b = engine_->motion(a).position - engine_->motion(b).position;
    const bool a_is_upper = from_b.dot(scene_.gravity) < 0;
    engine_->remove(b >= next_ || (a < next_ && a_is_upper) ? a : b);
    found = true;
  }
  return found;
}

// Largest distance by which it reaches out of the guide.
double Mould::outside_m(uint32_t body, const InsideTest& inside, const TriangleTree& walls) const {
  const BodyMotion motion = engine_->motion(body);
  double most = 0;
  for (const Vec3& vertex : world_.shapes[world_.bodies[body].shape].mesh.vertices) {
    const Vec3 point = motion.position + motion.orientation * vertex;
    if (!inside.contains(point)) most = std::max(most, walls.distance(point));
  }
  return most;
}

// Vertical gap between the lowest point of the guide and that of its filling: bodies may not reach
// into a round bottom, but the pile has to touch its support.
double Mould::gap_below(const MouldFilling& filling, const Vec3& up) const {
  if (filling.kept.empty()) return 0;
  double guide = std::numeric_limits<double>::infinity(), bodies = guide;
  for (const Vec3& vertex : model_.guide.vertices) guide = std::min(guide, vertex.dot(up));
  for (const auto& [body, pose] : filling.kept) {
    const ModelShape& shape = world_.shapes[world_.bodies[body].shape];
    if (shape.mesh.vertices.empty()) {
      bodies = std::min(bodies, pose.position.dot(up) - shape.bounding_radius);
    }
    for (const Vec3& vertex : shape.mesh.vertices) {
      bodies = std::min(bodies, pose.apply(vertex).dot(up));
    }
  }
  return std::max(0.0, bodies - guide);
}

// Largest distance, at most `most_m`, by which the filling can descend without touching a fixed
// body.
double Mould::descent_m(const MouldFilling& filling, const Vec3& up, double most_m) const {
  if (most_m <= 0) return 0;
  const BodyDistances distances(model_);
  double way_m = most_m;
  for (const ModelBody& body : model_.bodies) {
    if (!stands_still(body) || !comes_near(model_.shapes[body.shape], body.pose)) continue;
    const PlacedShape still = distances.place(body.shape, body.pose);
    for (const std::pair<uint32_t, Pose>& kept : filling.kept) {
      const uint32_t shape = world_.bodies[kept.first].shape;
      const auto apart = [&](double down_m) {
        const Pose moved{kept.second.position - down_m * up, kept.second.orientation};
        return distances.distance(distances.place(shape, moved), still, 0);
      };
      const double least = std::min(0.0, apart(0)) - kLeastReach * thickness_;
      // By steps small enough that bodies pass through nothing.
      double low = 0;
      while (low < way_m) {
        double high = std::min(low + thickness_ / 2, way_m);
        if (apart(high) >= least) {
          low = high;
          continue;
        }
        for (int halving = 0; halving < kHalvings; ++halving) {
          const double middle = (low + high) / 2;
          (apart(middle) >= least ? low : high) = middle;
        }
        way_m = low;
      }
    }
  }
  return way_m;
}

MouldFilling Mould::read() const {
  MouldFilling filling;
  filling.figures.is_mould = true;
  filling.figures.dropped = next_;
  filling.figures.simulated_s = static_cast<double>(steps_) * scene_.actual_step_s();
  const InsideTest inside(model_.guide);
  const TriangleTree walls(model_.guide);
  double volume = 0;
  for (uint32_t i = 0; i < next_; ++i) {
    if (!engine_->contains(i)) continue;
    const BodyMotion motion = engine_->motion(i);
    const double outside = outside_m(i, inside, walls);
    if (!inside.contains(motion.position) || outside > kMostOutside * thickness_) continue;
    filling.figures.outside_m = std::max(filling.figures.outside_m, outside);
    volume += world_.shapes[world_.bodies[i].shape].mass.volume_m3;
    filling.kept.emplace_back(i, Pose{motion.position, motion.orientation});
  }
  const Vec3 up = -scene_.gravity.normalized();
  const double gap = descent_m(filling, up, gap_below(filling, up));
  for (auto& [body, pose] : filling.kept) pose.position -= gap * up;
  std::ranges::stable_sort(filling.kept, {},
                           [&](const auto& one) { return one.second.position.dot(up); });
  filling.figures.kept = static_cast<uint32_t>(filling.kept.size());
  filling.figures.volume_share = volume / mass_properties(model_.guide).volume_m3;
  return filling;
}

}  // namespace

MouldFilling fill_mould(const Scene& scene, const Model& model, uint32_t attempt) {
  return Mould(scene, model, attempt).run();
}

}  // namespace pilesim

#include "simulate/dissertation/drawn_world.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include "core/parallel_for.h"
#include "core/philox.h"
#include "signature/response_draw.h"
#include "simulate/sphere/structure_radii.h"

namespace pilesim {
namespace {

// Numbers that the dissertation leaves open; g is gravity, r the outer radius of the body.
constexpr float kLow = 0.4F;      // sqrt(g r): momentum low enough for resting conditions
constexpr float kStill = 0.05F;   // sqrt(g r): the even smaller threshold, and a step's gravity
constexpr float kHit = 0.4F;      // sqrt(g r): a faster body ends its rest
constexpr float kNearGround = 1;  // r: within so much of its outer sphere from level ground
constexpr float kTurn = 0.4F;     // sqrt(g / r): of the small rotational impulse
constexpr float kEase = 0.1F;     // sqrt(g r): how fast the radius goes to h_rest
constexpr float kPosed = 0.02F;   // rad: in its rest pose

constexpr size_t kBodiesPerTask = 256;

// Figure 3.3b: the spin is projected on the plane of the velocity and the normal; its magnitude is
// kept as a key of its own.
Vec3f in_working_plane(const Vec3f& spin, const Vec3f& normal, const Vec3f& velocity) {
  const Vec3f across = working_frame(normal, velocity).z;
  const Vec3f projected = spin - spin.dot(across) * across;
  const float length = projected.norm();
  return length > 1e-6F * spin.norm() ? Vec3f(projected * (spin.norm() / length)) : spin;
}

// The axis and angle by which `up` (body frame) comes to be vertical.
Vec3f turn_to(const Vec3f& up, const Quatf& orientation) {
  const Vec3f now = orientation * up;
  const Vec3f axis = now.cross(Vec3f::UnitY());
  const float sine = axis.norm();
  const float angle = std::atan2(sine, now.y());
  if (sine < 1e-6F) return angle < 1 ? Vec3f::Zero() : Vec3f(angle * now.unitOrthogonal());
  return angle / sine * axis;
}

uint32_t nearest_pose(const std::vector<RestTarget>& targets, const Quatf& orientation) {
  const Vec3f up = orientation.conjugate() * Vec3f::UnitY();
  const auto nearest =
      std::ranges::max_element(targets, {}, [&](const RestTarget& t) { return t.up.dot(up); });
  return static_cast<uint32_t>(nearest - targets.begin());
}

}  // namespace

DrawnWorld::DrawnWorld(const Model& model, const BodySignatures& objects,
                       const SphereWorldSettings& settings)
    : model_(model, objects, settings), surfaces_(model) {
  state_.bodies.resize(model.bodies.size());
}

void DrawnWorld::add(uint32_t body, const Pose& pose, const Vec3& velocity, const Vec3& spin,
                     bool asleep) {
  DrawnBody& added = state_.bodies[body];
  added = {};
  added.position = pose.position.cast<float>();
  added.orientation = pose.orientation.cast<float>();
  added.velocity = velocity.cast<float>();
  added.spin = spin.cast<float>();
  added.asleep = asleep;
  added.changed = true;
  added.radius_m = asleep ? reach_below_at_start_m(model_.model, body) : collision_radius_m(body);
  state_.members.insert(std::ranges::lower_bound(state_.members, body), body);
}

void DrawnWorld::remove(uint32_t body) {
  wake_near(body);
  std::erase(state_.members, body);
}

void DrawnWorld::push(uint32_t body, const Vec3& impulse, const std::optional<Vec3>& point) {
  DrawnBody& pushed = state_.bodies[body];
  pushed.velocity += kind(body).inverse_mass * impulse.cast<float>();
  if (point) {
    const Vec3f arm = point->cast<float>() - pushed.position;
    pushed.spin += kind(body).inverse_inertia * arm.cross(impulse.cast<float>());
  }
  pushed.asleep = false;
}

void DrawnWorld::wake_near(uint32_t body) {
  const bool is_sphere =
      kind(body).object != nullptr && std::ranges::binary_search(state_.members, body);
  for (const uint32_t other : state_.members) {
    DrawnBody& near = state_.bodies[other];
    const float reach = kind(other).outer_m;
    const bool touches = is_sphere ? (near.position - state_.bodies[body].position).norm() <
                                         reach + kind(body).outer_m
                                   : surfaces_.may_touch(body, near.position, reach);
    if (touches) near.asleep = false;
  }
}

void DrawnWorld::put_to_sleep(uint32_t body) {
  set_velocity(body, Vec3::Zero(), Vec3::Zero());
  state_.bodies[body].asleep = true;
}

void DrawnWorld::set_velocity(uint32_t body, const Vec3& linear, const Vec3& angular) {
  DrawnBody& set = state_.bodies[body];
  set.velocity = linear.cast<float>();
  set.spin = angular.cast<float>();
  set.changed = true;
}

// 3.2.4.1: the mean collision height of its spin over its speed. Tables of the project's own layout
// are asked for a plane that it flies straight at.
float DrawnWorld::collision_radius_m(uint32_t i) const {
  const DrawnBody& body = state_.bodies[i];
  const BodySignature& object = *kind(i).object;
  if (!object.signature) return kind(i).radius_m;  // a particle
  const float speed = body.velocity.norm();
  const Vec3f normal = speed > 0 ? Vec3f(-body.velocity / speed) : Vec3f::UnitY();
  const Vec3f velocity = speed > 0 ? body.velocity : Vec3f(-1e-6F * Vec3f::UnitY());
  return collision_height(object.signature->heights, object.gyration_m, normal, velocity,
                          object.spin_of(body.orientation, body.spin))
      .mean_m;
}

void DrawnWorld::begin_step(StageTimer& timer) {
  ++state_.steps;
  {
    StageTimer::Scope scope(timer, Stage::integration);
    speed_up();
  }
  {
    StageTimer::Scope scope(timer, Stage::broad_phase);
    sort();
  }
  responses_.resize(state_.members.size());
  StageTimer::Scope scope(timer, Stage::narrow_phase);
  parallel_for(state_.members.size(), kBodiesPerTask, [&](size_t begin, size_t end) {
    for (size_t k = begin; k < end; ++k) responses_[k] = respond(state_.members[k]);
  });
}

DrawnWorld::Drawn DrawnWorld::drawn(uint32_t body) const {
  const auto place = std::ranges::lower_bound(state_.members, body) - state_.members.begin();
  const Response& response = responses_[static_cast<size_t>(place)];
  return {response.is_hit, response.velocity, response.spin};
}

void DrawnWorld::end_step(StageTimer& timer) {
  StageTimer::Scope scope(timer, Stage::integration);
  state_.contacts = 0;
  state_.deepest_m = 0;
  for (size_t k = 0; k < responses_.size(); ++k) {
    move(state_.members[k], responses_[k]);
    state_.contacts += responses_[k].contacts;
    state_.deepest_m = std::max(state_.deepest_m, responses_[k].deepest_m);
  }
}

void DrawnWorld::speed_up() {
  const Vec3f change = model_.settings.step_s * model_.settings.gravity;
  for (const uint32_t i : state_.members) {
    DrawnBody& body = state_.bodies[i];
    if (body.asleep) continue;
    body.velocity += change;
    if (body.rest_target == DrawnBody::kNoTarget) body.radius_m = collision_radius_m(i);
  }
}

// By bounding spheres, as radii change from step to step.
void DrawnWorld::sort() {
  centres_.clear();
  reaches_.clear();
  for (const uint32_t i : state_.members) {
    centres_.push_back(state_.bodies[i].position);
    reaches_.push_back(kind(i).outer_m);
  }
  grid_.sort(centres_, reaches_);
}

DrawnWorld::Response DrawnWorld::respond(uint32_t i) const {
  const DrawnBody& body = state_.bodies[i];
  const SphereKind& kind = this->kind(i);
  Response response{.velocity = body.velocity, .spin = body.spin};
  Philox random(model_.settings.seed, Stream::response, i, static_cast<uint32_t>(state_.steps));
  thread_local std::vector<uint32_t> near;
  thread_local std::vector<SurfaceContact> found;
  near.clear();
  found.clear();
  const float reach_m = kind.outer_m * (1 + kNearGround);
  surfaces_.select({body.position, body.position}, reach_m, near);
  for (const uint32_t surface : near) {
    surfaces_.find(surface, {.centre = body.position, .farthest_m = reach_m, .near_m = reach_m},
                   found);
  }
  for (const SurfaceContact& contact : found) {
    if (!by_spheres(model_.method(i, contact.body))) continue;
    response.is_on_ground |= contact.level;
    meet({contact.normal, contact.velocity, contact.gap - body.radius_m}, i, contact.body, random,
         response);
  }
  const auto meet_body = [&](uint32_t place) {
    const uint32_t other = state_.members[grid_.order()[place]];
    if (other == i || !by_spheres(model_.method(i, other))) return;
    const DrawnBody& partner = state_.bodies[other];
    if (body.asleep && partner.asleep) return;
    const Vec3f apart = body.position - partner.position;
    const float distance = apart.norm(), gap_m = distance - body.radius_m - partner.radius_m;
    if (gap_m > 0) return;
    // For two in one place the order decides.
    const Vec3f normal =
        distance > 0 ? Vec3f(apart / distance) : Vec3f((i < other ? 1.0F : -1.0F) * Vec3f::UnitY());
    meet({normal, partner.velocity, gap_m}, i, other, random, response);
  };
  const Vec3f reach = Vec3f::Constant(kind.outer_m + grid_.widest_m());
  grid_.for_each_in(body.position - reach, body.position + reach, meet_body);
  for (size_t p = grid_.small_count(); p < state_.members.size(); ++p) {
    meet_body(static_cast<uint32_t>(p));
  }
  return response;
}

// 3.2.4.2, steps 1 to 8.
void DrawnWorld::meet(const Contact& contact, uint32_t i, uint32_t other, Philox& random,
                      Response& response) const {
  if (contact.gap_m > 0) return;
  const DrawnBody& body = state_.bodies[i];
  const SphereKind& kind = this->kind(i);
  ++response.contacts;
  response.deepest_m = std::max(response.deepest_m, -contact.gap_m);
  const Vec3f velocity = response.velocity - contact.other_velocity;
  const float closing = -velocity.dot(contact.normal);
  // A body at rest stays so until it is hit.
  if (closing <= 0 || (body.asleep && closing < kHit * fall_speed(kind))) return;
  response.is_hit = true;
  const BodySignature& object = *kind.object;
  if (model_.method(i, other) == PairMethod::particle) {
    bounce(contact, i, other, response);
  } else {
    draw(contact, object, body.orientation, random, response);
  }
  if (body.rest_target == DrawnBody::kNoTarget) return;
  // 3.2.5: a rotational impulse towards the rest pose in place of the drawn spin.
  const Vec3f turn = turn_to(object.rest_targets[body.rest_target].up, body.orientation);
  const float rate = kTurn * std::sqrt(model_.settings.gravity.norm() / kind.outer_m);
  const float most = rate * model_.settings.step_s, angle = turn.norm();
  response.spin = turn * (angle > most ? most / angle : 1) / model_.settings.step_s;
}

void DrawnWorld::draw(const Contact& contact, const BodySignature& object, const Quatf& orientation,
                      Philox& random, Response& response) const {
  const Vec3f velocity = response.velocity - contact.other_velocity;
  const ContactMaterial& material = object.signature->material;
  const ResponseDraw draw = draw_response(
      *object.responses, DrawModel::diagonal, object.gyration_m, material.restitution,
      material.friction, contact.normal, velocity,
      in_working_plane(object.spin_of(orientation, response.spin), contact.normal, velocity),
      random);
  response.velocity = draw.velocity + contact.other_velocity;
  response.spin = object.angular_velocity_of(orientation, draw.spin);
}

// 4.3, level 3: no table, by the materials; the spin stays.
void DrawnWorld::bounce(const Contact& contact, uint32_t i, uint32_t other,
                        Response& response) const {
  const Vec3f velocity = response.velocity - contact.other_velocity;
  const WorkingFrame frame = working_frame(contact.normal, velocity);
  const SphereKind &kind = this->kind(i), &partner = this->kind(other);
  const Vec3 after = particle_response(frame.to_frame(velocity).cast<double>(),
                                       kind.root_restitution * partner.root_restitution,
                                       kind.root_friction * partner.root_friction);
  response.velocity = frame.to_world(after.cast<float>()) + contact.other_velocity;
}

// Slower than `least_speed`, sqrt(g r), and the speed that gravity adds in a step.
bool DrawnWorld::is_calm(uint32_t i, float least_speed) const {
  const DrawnBody& body = state_.bodies[i];
  const SphereKind& kind = this->kind(i);
  const float limit =
      least_speed * fall_speed(kind) + model_.settings.gravity.norm() * model_.settings.step_s;
  return body.velocity.norm() < limit && kind.object->gyration_m * body.spin.norm() < limit;
}

void DrawnWorld::choose_rest(uint32_t i, const Response& response) {
  DrawnBody& body = state_.bodies[i];
  const std::vector<RestTarget>& targets = kind(i).object->rest_targets;
  const bool applies = model_.settings.rest_control && is_posed(i) && response.is_on_ground &&
                       !targets.empty() && is_calm(i, kLow);
  if (!applies) {
    body.rest_target = DrawnBody::kNoTarget;
  } else if (body.rest_target == DrawnBody::kNoTarget) {
    body.rest_target = nearest_pose(targets, body.orientation);
  }
}

void DrawnWorld::move(uint32_t i, const Response& response) {
  DrawnBody& body = state_.bodies[i];
  if (body.asleep && !response.is_hit) return;
  if (body.shared) return;  // who moves it wakes it, too
  const SphereKind& kind = this->kind(i);
  const float step_s = model_.settings.step_s;
  body.asleep = false;
  body.changed = true;
  body.velocity = response.velocity;
  body.spin = response.spin;
  body.position += step_s * body.velocity;
  const float angle = step_s * body.spin.norm();
  if (angle > 0) {
    body.orientation =
        (Quatf(Eigen::AngleAxisf(angle, body.spin.normalized())) * body.orientation).normalized();
  }
  choose_rest(i, response);
  bool is_posed = true;
  if (body.rest_target != DrawnBody::kNoTarget) {
    const RestTarget& target = kind.object->rest_targets[body.rest_target];
    const float most = kEase * fall_speed(kind) * step_s;
    const float left_m = target.height_m - body.radius_m;
    body.radius_m += std::clamp(left_m, -most, most);
    is_posed = std::abs(left_m) <= most && turn_to(target.up, body.orientation).norm() < kPosed;
  }
  if (model_.settings.sleeping && response.contacts > 0 && is_posed && is_calm(i, kStill)) {
    body.asleep = true;
    body.velocity.setZero();
    body.spin.setZero();
  }
}

void DrawnWorld::load(StateReader& reader) {
  std::vector<SurfaceState> surfaces;
  reader(state_, surfaces);
  StateReader::require(state_.bodies.size() == model_.model.bodies.size(),
                       "an entry for each body");
  StateReader::require_below(state_.members, state_.bodies.size());
  StateReader::require(
      std::ranges::adjacent_find(state_.members, std::greater_equal()) == state_.members.end(),
      "bodies in ascending order");
  for (const uint32_t i : state_.members) {
    const DrawnBody& body = state_.bodies[i];
    const BodySignature* object = kind(i).object;
    StateReader::require(object != nullptr, "members that are dynamic");
    StateReader::require(
        body.rest_target == DrawnBody::kNoTarget || body.rest_target < object->rest_targets.size(),
        "a pose of the object");
    StateReader::require(body.position.allFinite() && body.velocity.allFinite() &&
                             body.spin.allFinite() && std::isfinite(body.radius_m),
                         "a state that is finite");
  }
  for (const SurfaceState& surface : surfaces) {
    StateReader::require(surface.body < state_.bodies.size(), "a surface of a body");
  }
  surfaces_.set_state(surfaces);
}

}  // namespace pilesim

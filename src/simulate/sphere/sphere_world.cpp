#include "simulate/sphere/sphere_world.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <functional>
#include <iterator>
#include <map>
#include <tuple>

#include "simulate/sphere/structure_radii.h"

namespace pilesim {
namespace {

// With fewer awake, handing work to threads takes longer than doing it.
constexpr size_t kBodiesForThreads = 1500;
constexpr size_t kFewSleepers = 64;  // may stay among the awake
constexpr size_t kSleepersTurn = 3;  // steps among the awake cost as much as one turn of sorting
// Part of the radius:
constexpr float kSlop = 0.005F;  // spheres may stay sunk this far: contacts do not come and go
// Of sqrt(g r): what approaches faster collides, what is slower lies, rubs and rolls, and wakes
// nothing.
constexpr float kImpactSpeed = 0.3F;
// Sunk spheres come up by e in this time, in sqrt(r / g), or in s without gravity; in so many
// sweeps.
constexpr float kPositionTime = 0.3F;
constexpr float kPositionTimeInFlight = 0.03F;
constexpr int kPositionSweeps = 2;

Quatf turned(const Quatf& orientation, const Vec3f& rotation_vector) {
  const float half = 0.5F * rotation_vector.norm();
  const float half2 = half * half;
  // Series of sin(x) / x and cos(x), to the last bit of a float.
  const bool small = half < 0.5F;
  const float sine =
      small ? 1 - half2 / 6 * (1 - half2 / 20 * (1 - half2 / 42)) : std::sin(half) / half;
  const float cosine = small
                           ? 1 - half2 / 2 * (1 - half2 / 12 * (1 - half2 / 30 * (1 - half2 / 56)))
                           : std::cos(half);
  Quatf turn;
  turn.w() = cosine;
  turn.vec() = 0.5F * sine * rotation_vector;
  return (turn * orientation).normalized();
}

}  // namespace

SphereWorld::SphereWorld(const Model& model, const std::vector<BodySignature>& objects,
                         const SphereWorldSettings& settings)
    : model_(model), settings_(settings), surfaces_(model) {
  const float gravity = settings.gravity.norm();
  impact_base_ = 1.2F * gravity * settings.step_s;
  impact_rise_ = kImpactSpeed * std::sqrt(gravity);
  const size_t count = model.bodies.size();
  bodies_.resize(count);
  collided_.assign(count, kNone);
  place_of_.resize(count);
  std::map<std::tuple<uint32_t, uint32_t, double, bool>, uint32_t> kinds;
  for (const ModelBody& body : model.bodies) {
    const bool dynamic = body.role == Role::dynamic;
    has_structures_ |= body.asleep;
    const auto [kind, is_new] =
        kinds.try_emplace({body.shape, body.material, body.mass_kg, dynamic}, kinds_.size());
    if (is_new) kinds_.push_back(kind_of(body, dynamic ? &objects[body.shape] : nullptr));
    kind_of_.push_back(kind->second);
    radius_m_.push_back(kinds_[kind->second].radius_m);
  }
  if (has_structures_) radius_m_ = radii_in_structures(model, radius_m_);
}

SphereKind SphereWorld::kind_of(const ModelBody& body, const BodySignature* object) const {
  SphereKind kind{.object = object, .mass_kg = static_cast<float>(body.mass_kg)};
  kind.root_friction = static_cast<float>(std::sqrt(model_.materials[body.material].friction));
  kind.root_restitution =
      static_cast<float>(std::sqrt(model_.materials[body.material].restitution));
  if (object == nullptr) return kind;
  kind.root_friction *= object->interlocking;
  const float gravity = settings_.gravity.norm();
  const float radius = object->packing_radius_m, k = object->gyration_m;
  const float time_s =
      gravity > 0 ? kPositionTime * std::sqrt(radius / gravity) : kPositionTimeInFlight;
  kind.radius_m = radius;
  kind.outer_m = object->outer_radius_m;
  kind.rolling_m = object->rolling * radius;
  kind.lift = -std::expm1(-settings_.step_s / (time_s * kPositionSweeps));
  kind.inverse_mass = 1 / kind.mass_kg;
  kind.inverse_inertia = kind.inverse_mass / (k * k);
  return kind;
}

void SphereWorld::add(uint32_t body, const Pose& pose, const Vec3& velocity, const Vec3& spin,
                      bool asleep) {
  SphereBody& added = bodies_[body];
  added = {};
  added.position = pose.position.cast<float>();
  added.orientation = pose.orientation.cast<float>();
  added.velocity = velocity.cast<float>();
  added.spin = spin.cast<float>();
  added.surface_radius_m = asleep ? reach_below_at_start_m(model_, body) : kind(body).radius_m;
  added.changed = true;
  added.asleep = asleep;
  members_.insert(std::ranges::lower_bound(members_, body), body);
  active_.insert(std::ranges::lower_bound(active_, body), body);
}

void SphereWorld::push(uint32_t body, const Vec3& impulse, const std::optional<Vec3>& point) {
  SphereBody& pushed = bodies_[body];
  const SphereKind& kind = this->kind(body);
  pushed.velocity += kind.inverse_mass * impulse.cast<float>();
  if (point) {
    const Vec3f arm = point->cast<float>() - pushed.position;
    pushed.spin += kind.inverse_inertia * arm.cross(impulse.cast<float>());
  }
  wake(body);
}

void SphereWorld::remove(uint32_t body) {
  wake_near(body);
  std::erase(members_, body);
  std::erase(active_, body);
  std::erase(woken_, body);
  bodies_[body].still = false;
}

uint32_t SphereWorld::contact_count() const {
  uint32_t count = 0;
  for (const Batch& batch : batches_) count += batch.pressed;
  return count;
}

float SphereWorld::deepest_penetration_m() const {
  float deepest = 0;
  for (const Batch& batch : batches_) deepest = std::max(deepest, batch.deepest_m);
  return deepest;
}

void SphereWorld::step(StageTimer& timer) {
  begin_step(timer);
  end_step(timer);
}

void SphereWorld::begin_step(StageTimer& timer) {
  ++steps_;
  join_woken();
  const auto awake = static_cast<size_t>(
      std::ranges::count_if(active_, [&](uint32_t body) { return !bodies_[body].asleep; }));
  is_idle_ = awake == 0;
  sweeps_left_ = is_idle_ ? 0 : settings_.sweeps;
  if (is_idle_) return;
  // To sort all sleepers anew costs more the more there are: when those among the awake have cost
  // as much.
  waiting_for_sleep_ += active_.size() - awake;
  if (active_.size() - awake > kFewSleepers &&
      waiting_for_sleep_ > kSleepersTurn * members_.size()) {
    lay_down();
    waiting_for_sleep_ = 0;
  }
  worth_threads_ = awake > kBodiesForThreads;
  {
    StageTimer::Scope scope(timer, Stage::integration);
    speed_up();
  }
  search(timer);
  if (wake_by_contacts()) {
    join_woken();
    search(timer);
  }
  StageTimer::Scope scope(timer, Stage::solver);
  collide_bodies();
}

void SphereWorld::search(StageTimer& timer) {
  {
    StageTimer::Scope scope(timer, Stage::broad_phase);
    sort();
    gather();
  }
  StageTimer::Scope scope(timer, Stage::narrow_phase);
  find_contacts();
}

void SphereWorld::end_step(StageTimer& timer) {
  is_dozing_sorted_ = false;
  if (is_idle_) return;
  {
    StageTimer::Scope scope(timer, Stage::solver);
    while (!is_swept()) sweep();
    separate();
  }
  {
    StageTimer::Scope scope(timer, Stage::integration);
    move();
    former_.swap(kept_);
    join_woken();
  }
}

void SphereWorld::join_woken() {
  if (woken_.empty()) return;
  std::ranges::sort(woken_);
  const auto middle = static_cast<ptrdiff_t>(active_.size());
  active_.insert(active_.end(), woken_.begin(), woken_.end());
  std::ranges::inplace_merge(active_, active_.begin() + middle);
  woken_.clear();
}

// Takes what sleeps, and has been read since, out of the grid of the awake.
void SphereWorld::lay_down() {
  std::vector<uint32_t> asleep;
  std::ranges::copy_if(members_, std::back_inserter(asleep), [&](uint32_t body) {
    return bodies_[body].asleep && !bodies_[body].changed;
  });
  std::vector<Vec3f> centres;
  std::vector<float> reaches;
  for (const uint32_t body : asleep) {
    centres.push_back(bodies_[body].position);
    reaches.push_back(radius_m_[body] * (1 + kNearby));
  }
  SphereGrid& grid = sleepers_.grid;
  grid.sort(centres, reaches);
  // What is much larger than most stays active.
  const std::span<const uint32_t> order = grid.order().first(grid.small_count());
  for (const uint32_t body : members_) bodies_[body].still = false;
  sleepers_.bodies.clear();
  sleepers_.reaches.resize(order.size());
  for (size_t p = 0; p < order.size(); ++p) {
    const uint32_t i = order[p], body = asleep[i];
    sleepers_.bodies.push_back(body);
    sleepers_.reaches.set(p, centres[i], reaches[i]);
    bodies_[body].still = true;
    bodies_[body].kept = kNone;
  }
  active_.clear();
  std::ranges::copy_if(members_, std::back_inserter(active_),
                       [&](uint32_t body) { return !bodies_[body].still; });
}

void SphereWorld::speed_up() {
  const Vec3f change = settings_.step_s * settings_.gravity;
  mean_velocity_.setZero();
  for (const uint32_t body : active_) {
    if (!bodies_[body].asleep) bodies_[body].velocity += change;
    mean_velocity_ += bodies_[body].velocity;
  }
  mean_velocity_ /= static_cast<float>(active_.size());
}

// Batches of one colour share no sphere, so that their order, and threads, change nothing. The
// largest begin, so that threads end together.
template <class Do>
void SphereWorld::for_each_batch(const Do& work) {
  for (const std::vector<uint32_t>& batches : colours_) {
    if (!worth_threads_ || batches.size() < 2) {
      for (const uint32_t batch : batches) work(batches_[batch]);
      continue;
    }
    std::atomic<size_t> next = 0;
    parallel_for(
        std::min(batches.size(), static_cast<size_t>(thread_count())), 1, [&](size_t, size_t) {
          for (size_t i; (i = next.fetch_add(1, std::memory_order_relaxed)) < batches.size();) {
            work(batches_[batches[i]]);
          }
        });
  }
}

void SphereWorld::prepare_contacts() {
  for (std::vector<uint32_t>& batches : colours_) {
    std::erase_if(batches, [&](uint32_t batch) { return batches_[batch].touches.empty(); });
    std::ranges::stable_sort(batches, std::greater(),
                             [&](uint32_t batch) { return batches_[batch].touches.size(); });
  }
  for_each_batch([&](Batch& batch) {
    batch.contacts.close(batch.fixed_begin);
    std::ranges::copy(batch.fixed, motion_.begin() + batch.fixed_begin);
    prepare(batch.contacts.groups(), motion_);
  });
}

void SphereWorld::sweep() {
  if (is_swept()) return;
  if (sweeps_left_ == settings_.sweeps) prepare_contacts();
  const float inverse_step = 1 / settings_.step_s;
  const int sweeps = std::min(kSweepsAtOnce, sweeps_left_);
  sweeps_left_ -= sweeps;
  for_each_batch([&](Batch& batch) {
    for (int i = 0; i < sweeps; ++i) solve(inverse_step, batch.contacts.groups(), motion_);
    if (is_swept()) keep_impulses(batch);
  });
}

// For the next step, and for putting to rest.
void SphereWorld::keep_impulses(Batch& batch) {
  for (size_t i = 0; i < batch.touches.size(); ++i) {
    const Touch& touch = batch.touches[i];
    const ContactGroup& group = batch.contacts.of(touch.slot);
    const size_t lane = touch.slot % kLanes;
    const float push = group.normal_impulse[lane];
    kept_[batch.kept_begin + i] = {touch.other,
                                   touch.next == kNone ? kNone : batch.kept_begin + touch.next,
                                   group.normal_of(lane), group.impulse(lane)};
    bodies_[body_[touch.a]].kept = batch.kept_begin + static_cast<uint32_t>(i);
    batch.pressed += push > 0 ? 1 : 0;
    batch.deepest_m = std::max(batch.deepest_m, -group.gap[lane]);
    if ((touch.other & kSurface) == 0) {
      body_push_[touch.a] += push;
      if ((touch.b & ContactGroups::kFixed) == 0) body_push_[touch.b] += push;
    } else {
      (touch.level ? surface_push_ : body_push_)[touch.a] += push;
    }
  }
}

// How far each sphere moves: along its velocity, and apart from what it is sunk into.
void SphereWorld::separate() {
  const float dt = settings_.step_s;
  share_out(motion_.size(), kBodiesPerTask, [&](size_t begin, size_t end) {
    for (size_t p = begin; p < end; ++p) {
      if (p >= body_.size()) {
        shift_[p] = {dt * motion_[p].velocity, 0};
      } else if (motion_[p].inverse_mass > 0) {
        shift_[p].way += dt * motion_[p].velocity;
        // What flies goes by its mean velocity: along the parabola, whatever the step.
        const bool flies = surface_push_[p] + body_push_[p] == 0 && !bodies_[body_[p]].shared;
        if (flies) shift_[p].way -= 0.5F * dt * dt * settings_.gravity;
      }
    }
  });
  for (int sweep = 0; sweep < kPositionSweeps; ++sweep) {
    for_each_batch(
        [&](Batch& batch) { pilesim::separate(kSlop, batch.contacts.groups(), shift_); });
  }
}

void SphereWorld::move() {
  share_out(body_.size(), kBodiesPerTask, [&](size_t begin, size_t end) {
    for (auto p = static_cast<uint32_t>(begin); p < end; ++p) {
      if (motion_[p].inverse_mass == 0) continue;
      move_body(p);
      settle_body(p);
    }
  });
}

void SphereWorld::move_body(uint32_t p) {
  const uint32_t body = body_[p];
  Vec3f way = shift_[p].way;
  // The centre of what is fast never passes through a surface.
  if (way.squaredNorm() > 0.25F * kinds_[kind_[p]].radius_m * kinds_[kind_[p]].radius_m) {
    const double hit =
        surfaces_.first_hit(centre_[p].cast<double>(), (centre_[p] + way).cast<double>());
    if (hit < 1) way *= static_cast<float>(0.9 * hit);
  }
  bodies_[body].position = centre_[p] + way;
  bodies_[body].changed = true;
  bodies_[body].velocity = motion_[p].velocity;
  bodies_[body].spin = motion_[p].spin;
  bodies_[body].orientation = turned(bodies_[body].orientation, settings_.step_s * motion_[p].spin);
  if (radius_m_[body] < kinds_[kind_[p]].radius_m) widen(body);
}

}  // namespace pilesim

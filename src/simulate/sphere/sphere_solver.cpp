#include "simulate/sphere/sphere_solver.h"

#include <algorithm>
#include <functional>

#include "simulate/sphere/sphere_contact_search.h"

namespace pilesim {

using namespace sphere_constants;

void SphereSolver::collide(const Input& input, SphereStep& step) {
  chosen_.clear();
  for (const SphereBatch& batch : step.batches) {
    for (const SphereImpact& impact : batch.impacts) {
      const bool with_body = (impact.other & kSurface) == 0;
      uint64_t& of_a = collided_[impact.body_a];
      if (of_a == input.step_number ||
          (with_body && collided_[impact.other] == input.step_number)) {
        continue;
      }
      of_a = input.step_number;
      if (with_body) collided_[impact.other] = input.step_number;
      chosen_.push_back(&impact);
    }
  }
  step.share_out(chosen_.size(), 64, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) collide(input, *chosen_[i], step);
  });
}

void SphereSolver::collide(const Input& input, const SphereImpact& impact, SphereStep& step) const {
  // A body that slept so far stays in place in this step, and moves on with its new motion.
  const auto sleeps = [&](uint32_t row) {
    return (row & ContactGroups::kFixed) != 0 || step.motion[row].inverse_mass == 0;
  };
  const auto collider = [&](uint32_t body, uint32_t row) {
    const bool still = sleeps(row);
    const SphereKind& kind = model_.kind(body);
    return Collider{kind.object, kind.mass_kg,
                    still ? input.bodies[body].velocity : step.motion[row].velocity,
                    still ? input.bodies[body].spin : step.motion[row].spin};
  };
  const auto after = [&](const Collider& moved, uint32_t body, uint32_t row, float share_s) {
    if (sleeps(row)) {
      input.bodies[body].velocity = moved.velocity;
      input.bodies[body].spin =
          moved.object->angular_velocity_of(input.bodies[body].orientation, moved.spin);
      return;
    }
    if ((impact.other & kSurface) == 0) {
      step.collision_change[row] += (moved.velocity - step.motion[row].velocity).norm();
    }
    // It moves as before until the two touch.
    step.shift[row].way += share_s * (step.motion[row].velocity - moved.velocity);
    step.motion[row].velocity = moved.velocity;
    step.motion[row].spin = moved.spin;
  };
  const auto random_of = [&](uint32_t body) {
    return Philox(model_.settings.seed, Stream::response, body,
                  static_cast<uint32_t>(input.step_number));
  };
  Collider a = collider(impact.body_a, impact.a);
  Philox random_a = random_of(impact.body_a);
  const auto until_s = [&](const Vec3f& other_velocity) {
    return std::max(0.0F, impact.gap) / (other_velocity - a.velocity).dot(impact.normal);
  };
  if ((impact.other & kSurface) != 0) {
    const float share_s = until_s(impact.surface_velocity);
    const Vec3f still_to_fall =
        falls_after(impact, impact.surface_velocity - a.velocity, share_s, sleeps(impact.a));
    a.velocity -= still_to_fall;
    collide_with_surface(collision(input, impact), impact.surface_velocity, random_a, a);
    a.velocity += still_to_fall;
    // The surface carries a body that does not leave it.
    const float into = (impact.surface_velocity - a.velocity).dot(impact.normal);
    if (into > 0 && !still_to_fall.isZero()) a.velocity += into * impact.normal;
    return after(a, impact.body_a, impact.a, share_s);
  }
  Collider b = collider(impact.other, impact.b);
  Philox random_b = random_of(impact.other);
  const float share_s = until_s(b.velocity);
  pilesim::collide(collision(input, impact), random_a, random_b, a, b);
  after(a, impact.body_a, impact.a, share_s);
  after(b, impact.other, impact.b, share_s);
}

// m/s, gained by gravity between a particle's bounce on a surface and the end of the step. It
// reaches the surface without this gain, and would otherwise gain height with each bounce.
Vec3f SphereSolver::falls_after(const SphereImpact& impact, const Vec3f& closing, float share_s,
                                bool sleeps) const {
  if (impact.method != PairMethod::particle || sleeps) return Vec3f::Zero();
  const Vec3f change = (model_.settings.step_s - share_s) * model_.settings.gravity;
  // A body that approaches only by this step's gravity is at rest.
  return (closing + change).dot(impact.normal) > 0 ? change : Vec3f::Zero();
}

Collision SphereSolver::collision(const Input& input, const SphereImpact& impact) const {
  const uint32_t body = impact.body_a, other = impact.other & ~kSurface;
  return {.normal = impact.normal,
          .method = impact.method,
          .restitution = model_.kind(body).root_restitution * model_.kind(other).root_restitution,
          .friction = root_friction(model_, input.root_friction, body) *
                      root_friction(model_, input.root_friction, other),
          .arm_a = input.radius_m[body],
          .arm_b = input.radius_m[other]};
}

void SphereSolver::prepare_contacts(SphereStep& step) {
  for (std::vector<uint32_t>& batches : step.colours) {
    std::erase_if(batches, [&](uint32_t batch) { return step.batches[batch].touches.empty(); });
    std::ranges::stable_sort(batches, std::greater(),
                             [&](uint32_t batch) { return step.batches[batch].touches.size(); });
  }
  step.for_each_batch([&](SphereBatch& batch) {
    batch.contacts.close(batch.fixed_begin);
    std::ranges::copy(batch.fixed, step.motion.begin() + batch.fixed_begin);
    prepare(batch.contacts.groups(), step.motion);
    batch.patches.close(batch.fixed_begin);
    prepare(batch.patches.groups(), step.motion);
  });
}

void SphereSolver::sweep(std::span<SphereBody> bodies, SphereStep& step) {
  if (is_swept()) return;
  if (sweeps_left_ == model_.settings.sweeps) prepare_contacts(step);
  const float inverse_step = 1 / model_.settings.step_s;
  const int sweeps = std::min(kSweepsAtOnce, sweeps_left_);
  sweeps_left_ -= sweeps;
  step.for_each_batch([&](SphereBatch& batch) {
    for (int i = 0; i < sweeps; ++i) {
      solve(inverse_step, batch.contacts.groups(), step.motion);
      solve(inverse_step, batch.patches.groups(), step.motion);
    }
    if (is_swept()) keep_impulses(bodies, batch, step);
  });
}

// Stores impulses for the next step, and for the stage of rest.
void SphereSolver::keep_impulses(std::span<SphereBody> bodies, SphereBatch& batch,
                                 SphereStep& step) const {
  for (size_t i = 0; i < batch.touches.size(); ++i) {
    const SphereTouch& touch = batch.touches[i];
    const ContactGroup& group =
        touch.patch ? batch.patches.of(touch.slot) : batch.contacts.of(touch.slot);
    if (touch.parallel) {
      step.faced[touch.a] = 1;
      if ((touch.b & ContactGroups::kFixed) == 0) step.faced[touch.b] = 1;
    }
    const size_t lane = touch.slot % kLanes;
    const float push = group.normal_impulse[lane];
    const bool is_last = touch.next == KeptImpulse::kLast;
    step.kept[batch.kept_begin + i] = {touch.other,
                                       is_last ? KeptImpulse::kLast : batch.kept_begin + touch.next,
                                       group.normal_of(lane), group.impulse(lane)};
    bodies[step.body[touch.a]].kept = batch.kept_begin + static_cast<uint32_t>(i);
    batch.pressed += push > 0 ? 1 : 0;
    batch.deepest_m = std::max(batch.deepest_m, -group.gap[lane]);
    if ((touch.other & kSurface) == 0) {
      note_push(bodies, touch, push, step, batch);
      step.body_push[touch.a] += push;
      if ((touch.b & ContactGroups::kFixed) == 0) step.body_push[touch.b] += push;
    } else {
      note_surface(touch, push, group.normal_of(lane), step);
    }
  }
}

// The surface with the largest normal impulse counts as the support.
void SphereSolver::note_surface(const SphereTouch& touch, float push_ns, const Vec3f& normal,
                                SphereStep& step) const {
  float& most_ns = step.surface_push[touch.a];
  const bool is_same = most_ns > 0 && normal.dot(step.surface_normal[touch.a]) > kSameSurface;
  const bool still = touch.face == SurfaceFace::still;
  if (still && is_same) {
    most_ns += push_ns;  // from several bodies side by side
    return;
  }
  if (touch.face == SurfaceFace::moving && normal.dot(model_.up) > kWall) {
    step.ground_push[touch.a] += push_ns;
  }
  if (!still || push_ns <= most_ns) {
    step.body_push[touch.a] += push_ns;
    return;
  }
  step.body_push[touch.a] += most_ns;
  most_ns = push_ns;
  step.surface_normal[touch.a] = normal;
}

// Another solver may push a body in the middle of a step: sleeping bodies then act as walls until
// the end of the step, and receive the impact after it.
void SphereSolver::note_push(std::span<const SphereBody> bodies, const SphereTouch& touch,
                             float push_ns, const SphereStep& step, SphereBatch& batch) const {
  const uint32_t a = step.body[touch.a];
  const uint32_t sleeper = bodies[a].asleep ? a : touch.other;
  const uint32_t pusher = sleeper == a ? touch.other : a;
  if (!bodies[pusher].shared || bodies[pusher].asleep) return;
  if (!bodies[sleeper].asleep || bodies[sleeper].put_to_sleep) return;
  const SphereKind& kind = model_.kind(pusher);
  const float more_ns = push_ns - touch.former_ns;
  if (more_ns > kind.mass_kg * model_.impact_speed(kind.radius_m)) {
    batch.pushed.push_back({sleeper, more_ns});
  }
}

void SphereSolver::separate(std::span<const SphereBody> bodies, SphereStep& step) const {
  const float dt = model_.settings.step_s;
  step.share_out(step.motion.size(), kBodiesPerTask, [&](size_t begin, size_t end) {
    for (size_t p = begin; p < end; ++p) {
      if (p >= step.body.size()) {
        step.shift[p] = {dt * step.motion[p].velocity, 0};
      } else if (step.motion[p].inverse_mass > 0) {
        step.shift[p].way += dt * step.motion[p].velocity;
        // A flying body moves with its mean velocity: along the parabola, whatever the step.
        const bool flies =
            step.surface_push[p] + step.body_push[p] == 0 && !bodies[step.body[p]].shared;
        if (flies) step.shift[p].way -= 0.5F * dt * dt * model_.settings.gravity;
      }
    }
  });
  for (int sweep = 0; sweep < kPositionSweeps; ++sweep) {
    step.for_each_batch([&](SphereBatch& batch) {
      pilesim::separate(kSlop, batch.contacts.groups(), step.shift);
      pilesim::separate(batch.patches.groups(), step.shift);
    });
  }
}

}  // namespace pilesim

// The scratch of a step of the sphere engine, in the order of the grid ("places"): awake bodies and
// the sleepers of structures among them.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <span>
#include <vector>

#include "core/parallel_for.h"
#include "simulate/sphere/body_ellipsoid.h"
#include "simulate/sphere/contact_groups.h"
#include "simulate/sphere/patch_groups.h"
#include "simulate/sphere/sphere_grid.h"
#include "simulate/sphere/sphere_state.h"

namespace pilesim {

// By place of a grid: positions and reaches of spheres, m, padded for SIMD.
struct SphereReaches {
  std::vector<float> x, y, z, reach;
  void resize(size_t count) {
    for (auto* floats : {&x, &y, &z, &reach}) floats->resize(count + kLanes);
  }
  void set(size_t place, const Vec3f& centre, float reach_m) {
    x[place] = centre.x();
    y[place] = centre.y();
    z[place] = centre.z();
    reach[place] = reach_m;
  }
  Vec3f centre(size_t place) const { return {x[place], y[place], z[place]}; }
};

// The face in contact on a surface. None: an edge, or a contact between bodies.
enum class SurfaceFace : uint8_t { none, still, moving };

// A contact, with the data that finds it again in the next step.
struct SphereTouch {
  uint32_t a, b;   // places; b only for bodies
  uint32_t other;  // a body, or kSurface
  uint32_t slot;   // in the groups
  uint32_t next;   // the next touch of a in the batch, or KeptImpulse::kLast
  SurfaceFace face;
  bool patch;       // face contact: the slot is in the patches
  bool parallel;    // the faces are nearly parallel
  float former_ns;  // impulse of the previous step
};

struct SphereImpact {
  uint32_t a, b;  // places; b only for bodies
  uint32_t body_a, other;
  Vec3f normal, surface_velocity;
  float gap;
  PairMethod method;
};

// A sleeper that an impact hit.
struct SphereHit {
  uint32_t body;
  float impulse_ns;
};

// The contacts that one thread finds and solves.
struct SphereBatch {
  ContactGroups contacts;
  PatchGroups patches;
  std::vector<SphereMotion> fixed;  // rows of bodies that nothing moves: see ContactGroups
  uint32_t fixed_begin = 0;
  std::vector<SphereTouch> touches;
  std::vector<SphereImpact> impacts;  // collisions of this step
  std::vector<SphereHit> hit;
  std::vector<SphereHit> pushed;  // sleepers that sweeps pushed
  std::vector<uint32_t> left;     // sleepers whose support left
  uint32_t kept_begin = 0;        // of its touches among the kept impulses
  uint32_t pressed = 0;           // number of loaded contacts
  float deepest_m = 0;
};

struct SphereStep {
  struct Level {
    SphereGrid grid;
    uint32_t offset = 0;  // of its places
  };
  bool worth_threads = false;
  Vec3f mean_velocity = Vec3f::Zero();  // m/s, mean of the active bodies

  // Written by the search. The batches' fixed rows follow in motions and shifts.
  std::vector<Level> levels;
  std::vector<uint32_t> body;      // by place
  std::vector<uint32_t> place_of;  // (B) of active bodies
  std::vector<Vec3f> centre;       // m
  SphereReaches middle;            // positions in the middle of the step
  std::vector<uint32_t> kind;
  std::vector<float> radius_m;
  std::vector<BodyEllipsoid> ellipsoid;
  // Last touch in the batch, and last kept impulse of the previous step.
  std::vector<uint32_t> last_touch, kept_of;
  std::vector<uint32_t> waiting, large;  // only for sort(), like the two below
  std::vector<Vec3f> sorted_middle;
  std::vector<float> sorted_reach;
  std::vector<SphereBatch> batches;
  std::vector<std::vector<uint32_t>> colours;  // batches by colour; those of the coarse levels last

  // Written by the search, then by collisions, the solver and MixedCoupling.
  std::vector<SphereMotion> motion;
  std::vector<SphereShift> shift;
  // Its support, N s: by the fixed surface with the largest impulse, along `surface_normal`, and by
  // all else.
  std::vector<float> surface_push, body_push;
  std::vector<float> ground_push;  // N s, the part of `body_push` from moving ground
  std::vector<float>
      collision_change;  // m/s, change of its velocity by a sampled collision with another body
  std::vector<Vec3f> surface_normal;
  std::vector<Vec3f> ground_velocity;  // m/s, by place: where the nearest surface is below it
  std::vector<KeptImpulse> kept;       // by touch, over all batches
  std::vector<uint8_t> faced;          // by place: has face contact

  // parallel_for, or a plain loop over [0, count) if there is little work.
  template <class Do>
  void share_out(size_t count, size_t grain, const Do& work) const {
    if (worth_threads) {
      parallel_for(count, grain, work);
    } else if (count > 0) {
      work(0, count);
    }
  }

  // Batches of one colour share no sphere, so neither their order nor threads affect the result.
  // The largest run first, so that threads finish together.
  template <class Do>
  void for_each_batch(const Do& work) {
    for (const std::vector<uint32_t>& of_colour : colours) {
      if (!worth_threads || of_colour.size() < 2) {
        for (const uint32_t batch : of_colour) work(batches[batch]);
        continue;
      }
      std::atomic<size_t> next = 0;
      parallel_for(
          std::min(of_colour.size(), static_cast<size_t>(thread_count())), 1, [&](size_t, size_t) {
            for (size_t i; (i = next.fetch_add(1, std::memory_order_relaxed)) < of_colour.size();) {
              work(batches[of_colour[i]]);
            }
          });
    }
  }
};

}  // namespace pilesim

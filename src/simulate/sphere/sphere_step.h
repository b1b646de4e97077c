// The scratch of a step of the engine of spheres. It lies in the order of the grid ("places"), the
// awake of structures with those that sleep among them.
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

// By place of a grid: where spheres are, and how far they reach from there, m. Some room after
// the last place for vectors.
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

// The face of a surface that a contact is with. None: of an edge, or between bodies.
enum class SurfaceFace : uint8_t { none, still, moving };

// A contact as one body or both find it again in the next step.
struct SphereTouch {
  uint32_t a, b;   // places; b of bodies only
  uint32_t other;  // body, or kSurface
  uint32_t slot;   // in the groups
  uint32_t next;   // the next one of a in the batch, or KeptImpulse::kLast
  SurfaceFace face;
  bool patch;       // of faces: the slot is in the patches
  bool parallel;    // the faces are, nearly
  float former_ns;  // pushed in the step before
};

struct SphereImpact {
  uint32_t a, b;  // places; b of bodies only
  uint32_t body_a, other;
  Vec3f normal, surface_velocity;
  float gap;
  PairMethod method;
};

// A sleeper that was hit.
struct SphereHit {
  uint32_t body;
  float impulse_ns;
};

// The contacts that one thread finds and solves.
struct SphereBatch {
  ContactGroups contacts;
  PatchGroups patches;
  std::vector<SphereMotion> fixed;  // rows of the contacts' own: see ContactGroups
  uint32_t fixed_begin = 0;
  std::vector<SphereTouch> touches;
  std::vector<SphereImpact> impacts;  // contacts that collide in this step
  std::vector<SphereHit> hit;
  std::vector<SphereHit> pushed;  // sleepers, by the sweeps
  std::vector<uint32_t> left;     // bodies that sleep, by what they stand on
  uint32_t kept_begin = 0;        // of its touches among what is kept
  uint32_t pressed = 0;           // contacts that carry something
  float deepest_m = 0;
};

struct SphereStep {
  struct Level {
    SphereGrid grid;
    uint32_t offset = 0;  // of its places
  };
  bool worth_threads = false;
  Vec3f mean_velocity = Vec3f::Zero();  // m/s, of the active

  // By the search. Motions and shifts go on with the batches' fixed rows.
  std::vector<Level> levels;
  std::vector<uint32_t> body;      // by place
  std::vector<uint32_t> place_of;  // (B) of active ones
  std::vector<Vec3f> centre;       // m
  SphereReaches middle;            // where it is in the middle of the step
  std::vector<uint32_t> kind;
  std::vector<float> radius_m;
  std::vector<BodyEllipsoid> ellipsoid;
  std::vector<uint32_t> last_touch, kept_of;  // of the batch; of the step before
  std::vector<uint32_t> waiting, large;       // of sort() only, as the two below
  std::vector<Vec3f> sorted_middle;
  std::vector<float> sorted_reach;
  std::vector<SphereBatch> batches;
  std::vector<std::vector<uint32_t>> colours;  // batches; those of the coarse levels last

  // By the search, then by collisions, the solver and MixedCoupling.
  std::vector<SphereMotion> motion;
  std::vector<SphereShift> shift;
  // Its support, N s: the still surface that pushes most, along `surface_normal`, and all else.
  std::vector<float> surface_push, body_push;
  std::vector<float> ground_push;  // N s, how much of `body_push` is of ground that moves
  std::vector<float> blow;         // m/s, change of its velocity by a drawn collision with another
  std::vector<Vec3f> surface_normal;
  std::vector<KeptImpulse> kept;  // by touch of all batches
  std::vector<uint8_t> faced;     // by place: it lies on something face to face

  // parallel_for, or a plain loop over [0, count) where there is little to do.
  template <class Do>
  void share_out(size_t count, size_t grain, const Do& work) const {
    if (worth_threads) {
      parallel_for(count, grain, work);
    } else if (count > 0) {
      work(0, count);
    }
  }

  // Batches of one colour share no sphere, so that their order, and threads, change nothing. The
  // largest begin, so that threads end together.
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

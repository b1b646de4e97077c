// A pile brought to rest by the exact engine, from wherever its bodies lie, in each other or not.
#pragma once

#include <algorithm>
#include <limits>
#include <memory>
#include <optional>
#include <vector>

#include "model/model.h"
#include "scene/scene.h"
#include "simulate/body_state.h"
#include "simulate/exact_engine.h"

namespace pilesim {

// Where a body was on its way to rest.
struct WayPoint {
  uint32_t body = 0;
  Vec3 position = Vec3::Zero();           // m, centre of mass, world
  Quatf orientation = Quatf::Identity();  // unit, body to world

  static void fields(auto& self, auto& stream) {
    stream(self.body, self.position, self.orientation);
  }
};

struct RestSettings {
  // Simulated time under gravity; none: 100 sqrt(r / g), r being the radius of the smallest dynamic
  // body.
  std::optional<double> longest_s;
  // Bodies deeper under the surface of the pile than can be seen may keep penetrating.
  bool visible_only = false;

  static void fields(auto& self, auto& stream) { stream(self.longest_s, self.visible_only); }
};

// First bodies that reach through walls are drawn back, and overlaps are undone, while nothing has
// a weight or a speed. Then the exact engine, without restitution and with the friction of the
// scene, lets all come to rest. When nearly all are still, those that are far from moving bodies
// wait outside of the solver. Bodies that are fixed, held, moved by keys, or frozen by a guide
// never move; nor do bodies that are left as they are, unless they give way. No clock of the scene
// runs. Deterministic, at any number of threads.
class ExactRest {
 public:
  // `start` has one entry a body of the model; those that are present begin there, without speed.
  ExactRest(const Scene& scene, const Model& model, BodyStates start,
            const RestSettings& settings = {});
  ~ExactRest();
  ExactRest(const ExactRest&) = delete;
  ExactRest& operator=(const ExactRest&) = delete;

  // All are still, or the longest time is over.
  bool is_over() const { return state_.is_at_rest || state_.time_s >= longest_s_; }
  bool is_at_rest() const { return state_.is_at_rest; }
  // One step of the engine. Not when it is over.
  FrameStatistics step();

  // As of the last step; who is still, as far as that is known, is asleep, and who is left.
  const BodyStates& states();
  // Bodies that need not be sound because they cannot be seen; ordered.
  std::vector<uint32_t> left() const;
  // Bodies that may move, and how many of them were still when that was last looked at.
  size_t movable() const;
  size_t still() const { return state_.still; }
  double time_s() const { return state_.time_s; }  // under gravity
  // By body, in the order of time, of those that went far; neither where they began nor where they
  // are now. Call once.
  std::vector<WayPoint> take_ways();

  // Between steps: all state that later steps depend on.
  void save(StateWriter& writer) const;
  // State of an object made from the same arguments: continues it to the last bit. Throws
  // Error(input) where the bytes are of no such state; it is not to be used then.
  void load(StateReader& reader);

 private:
  using Marks = std::vector<uint8_t>;  // (B) how restless a body is, or whether it is meant
  // Bodies left because they cannot be seen wait outside of the solver. One that others cannot
  // leave gives way, if it may move, but need not become sound itself unless it comes into view.
  // Deep ones are not there at all: nothing that moves comes near them.
  enum Left : uint8_t { kNotLeft, kMayGo, kStays, kDeep, kGivesWay };

  struct Watched {
    Vec3 position;
    Quat orientation;

    static void fields(auto& self, auto& stream) { stream(self.position, self.orientation); }
  };
  // Whether work on penetrating bodies still helps.
  struct Sunk {
    uint64_t fewest = std::numeric_limits<uint64_t>::max();  // bodies
    int since = 0;                                           // times looked at without fewer

    void note(uint64_t count) {
      since = count < fewest ? 0 : since + 1;
      fewest = std::min(fewest, count);
    }
    static void fields(auto& self, auto& stream) { stream(self.fewest, self.since); }
  };
  // Beside the engine's.
  struct State {
    int parting_steps = 0, settling_steps = 0;
    bool is_parted = false;
    Sunk sunk;           // in the parting, then in the settling
    double time_s = 0;   // under gravity
    uint64_t still = 0;  // bodies, when they were last looked at
    bool few_are_restless = false;
    bool is_at_rest = false;
    std::vector<Watched> watched;  // by movable_: where it was when they were last looked at
    std::vector<Vec3> way_end;     // m, by movable_: the last place that is kept
    Marks left;                    // (B) Left
    std::vector<WayPoint> ways;

    static void fields(auto& self, auto& stream) {
      stream(self.parting_steps, self.settling_steps, self.is_parted, self.sunk, self.time_s,
             self.still, self.few_are_restless, self.is_at_rest, self.watched, self.way_end,
             self.left, self.ways);
    }
  };
  std::unique_ptr<ExactEngine> engine_at(const Scene& scene) const;
  bool is_loose(uint32_t body) const;
  bool is_free(uint32_t body) const { return is_loose(body) && state_.left[body] != kDeep; }
  bool is_meant(uint32_t body) const { return is_loose(body) && state_.left[body] == kNotLeft; }
  // Now, not only if it is let go.
  bool may_move(uint32_t body) const {
    return is_meant(body) || (is_loose(body) && state_.left[body] == kGivesWay);
  }
  void leave_what_is_deep();
  Marks let_go();
  Marks overlooked(const Marks& sunk);
  double most_depth_m(uint32_t body) const;
  bool is_time_for_sunk() const;
  void part();
  void settle();
  void stop_all();
  void slow_down();
  void push_apart(const Marks& sunk);
  void keep_ways();
  void read_states();
  void begin_to_watch();
  void look();
  Marks restless() const;
  Marks sunk() const;
  Marks around(const Marks& marks, uint8_t least, int rings) const;
  void leave_in_solver(const Marks& meant);
  FrameStatistics statistics();

  Scene parting_, settling_;  // the scene with the steps of either; no gravity in the first
  Model model_;               // without restitution
  double longest_s_;
  BodyStates states_;
  std::vector<uint32_t> movable_;   // bodies in the engine that may ever move
  double potential_of_deep_j_ = 0;  // of those that are left for good, outside the engine
  std::unique_ptr<ExactEngine> engine_;
  State state_;
  std::vector<BodyContact> contacts_;  // when they were last looked at
  StageTimer timer_;
};

}  // namespace pilesim

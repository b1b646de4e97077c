// Brings a pile to rest with the exact engine, from any poses, penetrating or not.
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

// The pose of a body on its way to rest.
struct WayPoint {
  uint32_t body = 0;
  Vec3 position = Vec3::Zero();           // m, centre of mass, world
  Quatf orientation = Quatf::Identity();  // unit, body to world

  static void fields(auto& self, auto& stream) {
    stream(self.body, self.position, self.orientation);
  }
};

struct RestSettings {
  // Simulated time under gravity. If empty, 100 sqrt(r / g) with the radius r of the smallest
  // dynamic body.
  std::optional<double> longest_s;
  // Bodies too deep under the surface of the pile to be seen may keep penetrating.
  bool visible_only = false;

  static void fields(auto& self, auto& stream) { stream(self.longest_s, self.visible_only); }
};

// First, without weights or speeds, bodies that reach through walls are drawn back and overlaps are
// removed. Then the exact engine lets all bodies come to rest, without restitution and with the
// scene's friction. Once nearly all are at rest, bodies far from moving ones wait outside the
// solver. Bodies that are static, fixed, kinematic or frozen by a guide never move. Bodies left as
// they are move only if they give way. The scene's clock stands still. Deterministic at any number
// of threads.
class ExactRest {
 public:
  // `start` has one entry per body of the model. Bodies present there start at that pose, at rest.
  ExactRest(const Scene& scene, const Model& model, BodyStates start,
            const RestSettings& settings = {});
  ~ExactRest();
  ExactRest(const ExactRest&) = delete;
  ExactRest& operator=(const ExactRest&) = delete;

  // True when all bodies are at rest, or the longest time is over.
  bool is_over() const { return state_.is_at_rest || state_.time_s >= longest_s_; }
  bool is_at_rest() const { return state_.is_at_rest; }
  // One step of the engine. Call it only while is_over() is false.
  FrameStatistics step();

  // As of the last step. Bodies known to be at rest, and those left as they are, are asleep.
  const BodyStates& states();
  // Bodies that need not become sound because they cannot be seen, in ascending order.
  std::vector<uint32_t> left() const;
  // Number of bodies that may move, and of those that were at rest at the last check.
  size_t movable() const;
  size_t still() const { return state_.still; }
  double time_s() const { return state_.time_s; }  // under gravity
  // Poses of bodies that moved far, by body and time, without their first and last poses. Call it
  // once.
  std::vector<WayPoint> take_ways();

  // Between steps: saves all state that later steps depend on.
  void save(StateWriter& writer) const;
  // Loads the state of an object with the same arguments, and continues it bit by bit. Throws
  // Error(input) if the bytes are not such a state; the object must not be used after that.
  void load(StateReader& reader);

 private:
  using Marks = std::vector<uint8_t>;  // (B) a level of motion, or a flag
  // Bodies left as they are because they cannot be seen wait outside the solver. If others cannot
  // get out of such a body it gives way, if it may move, but need not become sound unless it comes
  // into view. Deep ones are not simulated at all: no moving body reaches them.
  enum Left : uint8_t { kNotLeft, kMayGo, kStays, kDeep, kGivesWay };

  struct Watched {
    Vec3 position;
    Quat orientation;

    static void fields(auto& self, auto& stream) { stream(self.position, self.orientation); }
  };
  // Progress of the work on penetrating bodies.
  struct PenetrationProgress {
    // Smallest number of such bodies so far.
    uint64_t fewest = std::numeric_limits<uint64_t>::max();
    int since = 0;  // checks since that number last fell

    void note(uint64_t count) {
      since = count < fewest ? 0 : since + 1;
      fewest = std::min(fewest, count);
    }
    static void fields(auto& self, auto& stream) { stream(self.fewest, self.since); }
  };
  // State besides that of the engine.
  struct State {
    int parting_steps = 0, settling_steps = 0;
    bool is_parted = false;
    PenetrationProgress penetrating;  // of the first phase, then of the second
    double time_s = 0;                // under gravity
    uint64_t still = 0;               // number of bodies at rest at the last check
    bool few_are_restless = false;
    bool is_at_rest = false;
    std::vector<Watched> watched;  // by movable_: positions at the last check
    std::vector<Vec3> way_end;     // m, by movable_: the last recorded position
    Marks left;                    // (B) Left
    std::vector<WayPoint> ways;

    static void fields(auto& self, auto& stream) {
      stream(self.parting_steps, self.settling_steps, self.is_parted, self.penetrating, self.time_s,
             self.still, self.few_are_restless, self.is_at_rest, self.watched, self.way_end,
             self.left, self.ways);
    }
  };
  std::unique_ptr<ExactEngine> engine_at(const Scene& scene) const;
  bool is_loose(uint32_t body) const;
  bool is_free(uint32_t body) const { return is_loose(body) && state_.left[body] != kDeep; }
  bool is_meant(uint32_t body) const { return is_loose(body) && state_.left[body] == kNotLeft; }
  // True if the body may move now.
  bool may_move(uint32_t body) const {
    return is_meant(body) || (is_loose(body) && state_.left[body] == kGivesWay);
  }
  void leave_what_is_deep();
  Marks let_go();
  Marks overlooked(const Marks& penetrating);
  double most_depth_m(uint32_t body) const;
  bool is_time_for_penetration() const;
  void part();
  void settle();
  void stop_all();
  void slow_down();
  void push_apart(const Marks& penetrating);
  void keep_ways();
  void read_states();
  void begin_to_watch();
  void look();
  Marks restless() const;
  Marks penetrating() const;
  Marks around(const Marks& marks, uint8_t least, int rings) const;
  void leave_in_solver(const Marks& meant);
  FrameStatistics statistics();

  Scene parting_, settling_;  // the scene with the steps of either phase; the first has no gravity
  Model model_;               // without restitution
  double longest_s_;
  BodyStates states_;
  std::vector<uint32_t> movable_;   // bodies in the engine that may ever move
  double potential_of_deep_j_ = 0;  // of bodies left for good, outside the engine
  std::unique_ptr<ExactEngine> engine_;
  State state_;
  std::vector<BodyContact> contacts_;  // at the last check
  StageTimer timer_;
};

}  // namespace pilesim

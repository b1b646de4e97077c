// A pile brought to rest by the exact engine, from wherever its bodies lie, in each other or not.
#pragma once

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
  Vec3f position = Vec3f::Zero();         // m, centre of mass, world
  Quatf orientation = Quatf::Identity();  // unit, body to world
};

// First bodies that reach through walls are drawn back, and overlaps are undone, while nothing has
// a weight or a speed. Then the exact engine, without restitution and with the friction of the
// scene, lets all come to rest. When nearly all are still, those wait outside of the solver that
// are far from what is not. What is fixed, held, moved by keys, or frozen by a guide stands where
// it is all the time. No clock of the scene runs. Deterministic, at any number of threads.
class ExactRest {
 public:
  // `start` has one entry a body of the model; those that are present begin there, without speed.
  // `longest_s`: of simulated time under gravity; none: 100 sqrt(r / g), r being the radius of the
  // smallest dynamic body.
  ExactRest(const Scene& scene, const Model& model, BodyStates start,
            std::optional<double> longest_s);
  ~ExactRest();
  ExactRest(const ExactRest&) = delete;
  ExactRest& operator=(const ExactRest&) = delete;

  // All are still, or the longest time is over.
  bool is_over() const { return is_at_rest_ || time_s_ >= longest_s_; }
  bool is_at_rest() const { return is_at_rest_; }
  // One step of the engine. Not when it is over.
  FrameStatistics step();

  // As of the last step; who is still, as far as that is known, is asleep.
  const BodyStates& states();
  // Bodies that may move, and how many of them were still when that was last looked at.
  size_t movable() const { return movable_.size(); }
  size_t still() const { return still_; }
  double time_s() const { return time_s_; }  // under gravity
  // By body, in the order of time, of those that went far; neither where they began nor where they
  // are now. Call once.
  std::vector<WayPoint> take_ways();

 private:
  using Marks = std::vector<uint8_t>;  // (B) how restless a body is, or whether it is meant

  struct Watched {
    Vec3 position;
    Quat orientation;
  };
  std::unique_ptr<ExactEngine> engine_at(const Scene& scene) const;
  bool is_free(uint32_t body) const;
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
  void mark_sunk(Marks& marks) const;
  Marks around(const Marks& marks, uint8_t least, int rings) const;
  void leave_in_solver(const Marks& meant);
  FrameStatistics statistics();

  Scene parting_, settling_;  // the scene with the steps of either; no gravity in the first
  Model model_;               // without restitution
  double longest_s_;
  BodyStates states_;
  std::vector<uint32_t> movable_;  // bodies
  std::unique_ptr<ExactEngine> engine_;
  int parting_steps_ = 0, settling_steps_ = 0;
  bool is_parted_ = false;
  double time_s_ = 0;
  size_t still_ = 0;
  bool few_are_restless_ = false;
  bool is_at_rest_ = false;
  std::vector<Watched> watched_;  // by movable_: where it was when they were last looked at
  std::vector<Vec3f> way_end_;    // m, by movable_: the last place that is kept
  std::vector<WayPoint> ways_;
  std::vector<BodyContact> contacts_;  // when they were last looked at
  StageTimer timer_;
};

}  // namespace pilesim

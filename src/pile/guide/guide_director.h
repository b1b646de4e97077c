// Holds a pile in a shape while the impulse mode steps it, by fixing bodies that can stand
// (dissertation 6.2; NailDirector follows section 6.2 to the letter).
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "geometry/inside_test.h"
#include "model/model.h"
#include "pile/guide/candidates.h"
#include "pile/guide/pile_holder.h"
#include "pile/guide/support_graph.h"
#include "scene/scene.h"
#include "trajectory/guide_file.h"

namespace pilesim {

// State that the director keeps from step to step. (B): by body of the model. Its control steps and
// impacts write everything except `step`.
struct GuideState {
  explicit GuideState(size_t bodies);

  uint64_t step = 0;                  // the next one
  bool is_penetrating = false;        // bodies penetrated too far at the last control step
  std::vector<BodyContact> contacts;  // of the last control step
  std::vector<uint8_t> asleep;        // (B) 1: put to sleep by this director
  std::vector<Vec3> held_at;          // (B) m, positions of sleeping bodies
  GuideCounts counts;
  uint64_t control_steps = 0;
  double control_s = 0;  // wall time of all control steps

  static void fields(auto& self, auto& stream) {
    stream(self.step, self.is_penetrating, self.contacts, self.asleep, self.held_at, self.counts,
           self.control_steps, self.control_s);
  }
};

class GuideDirector final : public PileHolder {
 public:
  // `scene` has a guide; both outlive the director.
  GuideDirector(const Scene& scene, const Model& model);

  void direct(ImpulseControl& control) override;
  void take_hits(ImpulseControl& control, std::span<const Hit> hits) override;
  void save(StateWriter& writer) const override { writer(state_); }
  void load(StateReader& reader) override;

  const GuideCounts& counts() const override { return state_.counts; }
  uint64_t control_steps() const override { return state_.control_steps; }
  double control_s() const override { return state_.control_s; }
  // For each fixed body one of the contacts that hold it.
  std::vector<Vec3> constraint_points() const override;

 private:
  void control_step(ImpulseControl& control);
  void analyse(ImpulseControl& control);
  void leave_out_penetrating();
  void keep_well_surrounded(const ImpulseControl& control);
  void freeze(ImpulseControl& control);
  void hold(uint32_t body, const Vec3& contact);
  bool in_guide(uint32_t body, const Vec3& centre);
  double free_fall_speed(uint32_t body) const;

  const Model& model_;
  const Guide& guide_;
  double gravity_;                   // m/s^2, magnitude
  std::optional<InsideTest> shape_;  // none: the guide is everywhere

  GuideState state_;

  // Scratch of one control step; the graph of state_.contacts.
  CandidateAnalysis analysis_;
  SupportGraph graph_;
  std::vector<Standing> standing_;  // (B)
  std::vector<uint8_t> chosen_;     // (B) 1: may be fixed
  std::vector<uint8_t> held_;       // (B) 1: asleep
  std::vector<uint32_t> queue_;     // for searches through the graph

  // Cache of inside tests: fixed bodies do not move.
  std::vector<Vec3> asked_at_;   // (B) m, position of the last test; NaN: none yet
  std::vector<uint8_t> inside_;  // (B) its result
};

}  // namespace pilesim

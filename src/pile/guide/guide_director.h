// Holds a pile in a shape while the impulse mode steps it (dissertation 6.2, algorithm 2).
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "geometry/inside_test.h"
#include "model/model.h"
#include "pile/guide/candidates.h"
#include "pile/guide/support_graph.h"
#include "scene/scene.h"
#include "simulate/impulse_control.h"

namespace pilesim {

// Of the last control step, and of all.
struct GuideCounts {
  uint32_t in_guide = 0;  // bodies that are controlled, by their centre of mass
  uint32_t passed = 0, filtered = 0, failed = 0;
  uint32_t held = 0;   // bodies that sleep or have a nail
  uint32_t nails = 0;  // that were placed
  uint64_t control_steps = 0;
  uint64_t knocked_loose = 0;  // bodies that hits woke
  double control_s = 0;        // wall time of all control steps
};

class GuideDirector final : public ImpulseDirector {
 public:
  // `scene` has a guide; both outlive the director.
  GuideDirector(const Scene& scene, const Model& model);

  void direct(ImpulseControl& control) override;
  void take_hits(ImpulseControl& control, std::span<const Hit> hits) override;

  const GuideCounts& counts() const { return counts_; }
  // Where bodies are held, as of the last control step, m: the nails, or of each body that is held
  // still a contact through which it is.
  std::vector<Vec3> constraint_points() const;

 private:
  void control_step(ImpulseControl& control);
  void analyse(ImpulseControl& control);
  void leave_out_the_sunk();
  void keep_well_surrounded(const ImpulseControl& control);
  void freeze(ImpulseControl& control);
  void hold(uint32_t body, const Vec3& contact);
  void nail(ImpulseControl& control);
  struct DrivenNail {
    ConstraintId id;
    Vec3 point;  // m
  };
  DrivenNail drive_in(ImpulseControl& control, const BodyContact& contact);
  double strength(uint32_t body) const;  // of its nails, N s
  bool in_guide(uint32_t body, const Vec3& centre);
  bool is_anchor(const ImpulseControl& control, uint32_t body) const;
  double free_fall_speed(uint32_t body) const;

  const Model& model_;
  const Guide& guide_;
  double gravity_;                   // m/s^2, magnitude
  std::optional<InsideTest> shape_;  // none: everywhere
  CandidateAnalysis analysis_;
  SupportGraph graph_;
  uint64_t step_ = 0;
  bool is_sunk_ = false;               // something overlapped too far at the last control step
  std::vector<BodyContact> contacts_;  // of the last control step
  std::vector<Standing> standing_;     // (B)
  std::vector<uint8_t> chosen_;        // (B) 1: may be held
  std::vector<uint8_t> asleep_;        // (B) 1: put to sleep by this director
  std::vector<uint8_t> inside_;        // (B) at tested_
  std::vector<Vec3> tested_;           // (B) m, where inside_ was found
  std::vector<uint32_t> queue_;        // of searches through the graph
  std::vector<uint8_t> held_;          // (B) 1: sleeps or is nailed
  std::vector<Vec3> held_at_;          // (B) m, of what sleeps
  std::map<std::pair<uint32_t, uint32_t>, DrivenNail> nails_;  // of two bodies, the lower first
  GuideCounts counts_;
};

}  // namespace pilesim

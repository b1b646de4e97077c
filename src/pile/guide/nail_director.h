// Algorithm 2 in section 6.2 of the dissertation, to the letter, for comparison with GuideDirector
// (docs/dissertation.md lists what the text leaves open).
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "geometry/inside_test.h"
#include "model/model.h"
#include "pile/guide/candidates.h"
#include "pile/guide/force_pyramid.h"
#include "pile/guide/pile_holder.h"
#include "pile/guide/support_graph.h"
#include "scene/scene.h"

namespace pilesim {

// (6.2), m^2: over triples of consecutive contacts.
double area_of_triples(std::span<const SupportPoint> contacts);

class NailDirector final : public PileHolder {
 public:
  // `scene` has a guide; both outlive the director.
  NailDirector(const Scene& scene, const Model& model);

  void direct(ImpulseControl& control) override;
  void save(StateWriter& writer) const override { writer(state_); }
  void load(StateReader& reader) override;

  const GuideCounts& counts() const override { return state_.counts; }
  uint64_t control_steps() const override { return state_.control_steps; }
  double control_s() const override { return state_.control_s; }
  std::vector<Vec3> constraint_points() const override;  // the nails

 private:
  struct DrivenNail {
    ConstraintId id = 0;
    Vec3 point = Vec3::Zero();  // m, world, when it was driven in

    static void fields(auto& self, auto& stream) { stream(self.id, self.point); }
  };
  // State that it keeps from step to step.
  struct State {
    uint64_t step = 0;              // the next one
    std::vector<DrivenNail> nails;  // of this cycle
    GuideCounts counts;
    uint64_t control_steps = 0;
    double control_s = 0;  // wall time of all control steps

    static void fields(auto& self, auto& stream) {
      stream(self.step, self.nails, self.counts, self.control_steps, self.control_s);
    }
  };

  void control_step(ImpulseControl& control);
  Standing standing(const ImpulseControl& control, uint32_t body);
  bool may_nail(const ImpulseControl& control, uint32_t body) const;
  void nail(ImpulseControl& control);

  const Scene& scene_;
  const Model& model_;
  const Guide& guide_;
  Vec3 up_;
  std::optional<InsideTest> shape_;  // none: the guide is everywhere

  State state_;

  // Scratch of one control step.
  std::vector<BodyContact> contacts_;
  SupportGraph graph_;
  ForcePyramids pyramids_;
  std::vector<SupportPoint> chosen_;  // relevant contacts of a body
  std::vector<Standing> standing_;    // (B)
  std::vector<uint8_t> nailed_;       // (B)
};

}  // namespace pilesim

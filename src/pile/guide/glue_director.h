// Holds a pile with the least glue at its contacts with which the whole pile stands. Each pair of
// bodies that needs glue gets a spot of just that strength. A larger load stretches and tears it,
// and may then tear its neighbours.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "geometry/inside_test.h"
#include "model/model.h"
#include "pile/glue/glue.h"
#include "pile/guide/candidates.h"
#include "pile/guide/pile_holder.h"
#include "pile/guide/support_graph.h"
#include "scene/scene.h"

namespace pilesim {

// State that the director keeps from step to step. (B): by body of the model. Its control steps
// write everything except `step`.
struct GlueState {
  explicit GlueState(size_t bodies) : covered(bodies), place(bodies, Vec3::Zero()) {}

  struct Spot {
    ConstraintId id = 0;
    PairLine line;
    Vec3 arm_b = Vec3::Zero();  // m, from b's centre in b's frame: where the spot was placed
    double strength_kg = 0, strength_kgm = 0;
    bool holds = true;
    static void fields(auto& self, auto& stream) {
      stream(self.id, self.line, self.arm_b, self.strength_kg, self.strength_kgm, self.holds);
    }
  };

  uint64_t step = 0;             // the next one
  uint64_t start = 0;            // first step of the pile's analyses
  std::vector<uint8_t> covered;  // (B) 1: it has been analysed
  std::vector<Spot> spots;
  GuideCounts counts;
  std::optional<GlueFigures> figures;
  std::vector<Vec3> place;       // (B) m, at the last analysis
  std::vector<PairLine> forces;  // GuideFile::forces
  uint32_t torn_seen = 0;        // number of torn spots at the last analysis
  bool had_forces = false;       // whether that analysis found forces
  int32_t rest_looks = 0;        // control steps for which the pile has rested after an impact
  std::optional<GlueLeft> left;
  uint64_t control_steps = 0;
  double control_s = 0;  // wall time of all control steps

  static void fields(auto& self, auto& stream) {
    stream(self.step, self.start, self.covered, self.spots, self.counts, self.figures, self.place,
           self.forces, self.torn_seen, self.had_forces, self.rest_looks, self.left,
           self.control_steps, self.control_s);
  }
};

// True if an analysis found forces that hold the pile.
bool are_found(const GlueFigures& figures);

// True if the pile after an impact is proved to stand, by friction and remaining glue.
bool stands(const GlueLeft& left);

// Result of the analysis of the initial pile.
struct GlueVerdict {
  bool holds = true;              // such forces were found, or the pile is empty
  std::vector<uint32_t> hanging;  // bodies that no chain of contacts connects to a fixed body
};
GlueVerdict judge_start(const Scene& scene, const Model& model);

// s: the longest step of the scene, with a guide, for bodies of that bounding radius.
double step_with_guide_s(const Scene& scene, double radius_m);

class GlueDirector final : public PileHolder {
 public:
  // `scene` has a guide; both outlive the director.
  GlueDirector(const Scene& scene, const Model& model);

  void direct(ImpulseControl& control) override;
  void save(StateWriter& writer) const override { writer(state_); }
  void load(StateReader& reader) override;

  const GuideCounts& counts() const override { return state_.counts; }
  uint64_t control_steps() const override { return state_.control_steps; }
  double control_s() const override { return state_.control_s; }
  std::vector<PairLine> glue() const override;
  std::vector<PairLine> forces() const override { return state_.forces; }
  std::optional<GlueFigures> glue_figures() const override { return state_.figures; }
  std::optional<GlueLeft> glue_left() const override { return state_.left; }
  // Bodies that in the last analysis no chain of contacts connected to a fixed body.
  const std::vector<uint32_t>& hanging() const { return hanging_; }

 private:
  enum class Part : uint8_t { none, pile, anchor };
  void control_step(ImpulseControl& control);
  void find_parts(const ImpulseControl& control);
  bool may_be_pile(uint32_t body) const;
  bool is_analysis_due(const ImpulseControl& control) const;
  bool is_starting() const;
  bool has_slumped(const ImpulseControl& control) const;
  void judge_each(ImpulseControl& control);
  std::vector<GlueBody> bodies_of(const ImpulseControl& control) const;
  std::vector<GlueContact> contacts_of(std::span<const GlueBody> bodies, double of_friction) const;
  void analyse(ImpulseControl& control);
  void find_left(const ImpulseControl& control);
  bool is_left_due(const ImpulseControl& control);
  void analyse_left(ImpulseControl& control);
  void note_analysis(const ImpulseControl& control);
  void note_forces(const ImpulseControl& control, std::span<const GlueContact> contacts,
                   const GlueSolution& solution, std::span<const GlueThere> there = {});
  void end_forces(const ImpulseControl& control);
  bool is_as_analysed() const;
  void put_on(ImpulseControl& control, std::span<const GlueContact> contacts,
              std::span<const GlueSolution> cases);
  double mean_kg() const;
  double friction_of(uint32_t a, uint32_t b) const;
  double radius_of(uint32_t a, uint32_t b) const;
  void leave_out_highest(std::vector<GlueSpot>& spots) const;
  void drop_torn(const ImpulseControl& control);
  bool is_slow(const ImpulseControl& control, uint32_t body, double most_speed) const;

  const Scene& scene_;
  const Model& model_;
  const Guide& guide_;
  double gravity_;  // m/s^2, magnitude
  Vec3 up_;
  std::optional<InsideTest> shape_;  // none: the guide is everywhere

  GlueState state_;
  std::vector<uint32_t> hanging_;

  // Scratch of one control step.
  std::vector<Part> parts_;  // (B)
  std::vector<BodyContact> contacts_;
  CandidateAnalysis local_;
  SupportGraph graph_;
};

}  // namespace pilesim

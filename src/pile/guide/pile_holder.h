// The reports of a director that holds a pile, whatever its method.
#pragma once

#include <vector>

#include "simulate/impulse_control.h"
#include "trajectory/guide_file.h"

namespace pilesim {

class PileHolder : public ImpulseDirector {
 public:
  virtual const GuideCounts& counts() const = 0;
  virtual uint64_t control_steps() const = 0;
  virtual double control_s() const = 0;  // wall time of all control steps
  // Positions where bodies are held, as of the last control step, m.
  virtual std::vector<Vec3> constraint_points() const { return {}; }
  // All glue of the run in the order of its placement, with the time at which it tore.
  virtual std::vector<PairLine> glue() const { return {}; }
  // GuideFile::forces, of all analyses of a glued pile.
  virtual std::vector<PairLine> forces() const { return {}; }
  // Figures of the last analysis of a glued pile; empty if there was none.
  virtual std::optional<GlueFigures> glue_figures() const { return std::nullopt; }
  // Figures of the last analysis after an impact. Empty while no glue has torn and little has moved
  // since the pile was analysed, or before it is at rest.
  virtual std::optional<GlueLeft> glue_left() const { return std::nullopt; }
};

}  // namespace pilesim

// The reports of a director that holds a pile, by any method.
#pragma once

#include <vector>

#include "simulate/impulse_control.h"
#include "trajectory/guide_file.h"

namespace pilesim {

class PileHolder : public ImpulseDirector {
 public:
  virtual const GuideCounts& counts() const = 0;
  virtual uint64_t control_steps() const = 0;
  virtual double control_s() const = 0;  // wall time of them all
  // Where bodies are held, as of the last control step, m.
  virtual std::vector<Vec3> constraint_points() const { return {}; }
  // All glue that there ever was, what is torn with the time of that; by the time it was put on.
  virtual std::vector<PairLine> glue() const { return {}; }
  // GuideFile::forces, of all analyses of a glued pile.
  virtual std::vector<PairLine> forces() const { return {}; }
  // Figures of the last analysis of a glued pile; none: there was none.
  virtual std::optional<GlueFigures> glue_figures() const { return std::nullopt; }
  // Figures of the last analysis after a hit; none: no glue has torn and little has moved since the
  // pile was analysed, or it is not at rest yet.
  virtual std::optional<GlueLeft> glue_left() const { return std::nullopt; }
};

}  // namespace pilesim

#include "pile/repose/body_columns.h"

namespace pilesim {

BodyColumns::BodyColumns(const Model& model, const PileBodies& bodies, double cell_m)
    : model_(model), bodies_(bodies), cell_m_(cell_m), kept_(model.bodies.size()) {}

const std::vector<Column>& BodyColumns::of(uint32_t body, const BodyMotion& now) {
  Kept& kept = kept_[body];
  if (kept.columns.empty() || kept.position != now.position ||
      kept.orientation.coeffs() != now.orientation.coeffs()) {
    kept.position = now.position;
    kept.orientation = now.orientation;
    kept.columns = columns_of(bodies_.shape_of(model_, body).surface,
                              {now.position, now.orientation}, cell_m_);
  }
  return kept.columns;
}

}  // namespace pilesim

// Caches the ground cells that each body covers while it is at rest.
#pragma once

#include <cstdint>
#include <vector>

#include "model/model.h"
#include "pile/repose/height_field.h"
#include "pile/repose/pile_bodies.h"
#include "simulate/body_control.h"

namespace pilesim {

class BodyColumns {
 public:
  // `model` and `bodies` must outlive it.
  BodyColumns(const Model& model, const PileBodies& bodies, double cell_m);

  double cell_m() const { return cell_m_; }
  const std::vector<Column>& of(uint32_t body, const BodyMotion& now);

 private:
  struct Kept {
    Vec3 position = Vec3::Zero();
    Quat orientation = Quat::Identity();
    std::vector<Column> columns;  // empty: not yet computed
  };

  const Model& model_;
  const PileBodies& bodies_;
  double cell_m_;
  std::vector<Kept> kept_;  // (B)
};

}  // namespace pilesim

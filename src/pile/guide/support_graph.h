// The graph of touching bodies: contacts sorted by body, in flat arrays.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "model/model.h"
#include "pile/guide/equilibrium.h"
#include "simulate/body_control.h"

namespace pilesim {

class SupportGraph {
 public:
  explicit SupportGraph(const Model& model);

  void build(std::span<const BodyContact> contacts);

  // In the order of the contacts.
  std::span<const SupportPoint> supports(uint32_t body) const { return of(body, supports_); }
  // The body at the other side of each support.
  std::span<const uint32_t> neighbours(uint32_t body) const { return of(body, neighbours_); }

 private:
  template <class T>
  std::span<const T> of(uint32_t body, const std::vector<T>& values) const {
    return std::span(values).subspan(first_[body], first_[body + 1] - first_[body]);
  }

  const Model& model_;
  std::vector<double> root_friction_;   // (B) the friction of a pair is the product of both
  std::vector<uint32_t> first_, next_;  // (B + 1) index of a body's first support
  std::vector<SupportPoint> supports_;
  std::vector<uint32_t> neighbours_;
};

}  // namespace pilesim

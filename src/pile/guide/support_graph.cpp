#include "pile/guide/support_graph.h"

#include <cmath>

namespace pilesim {

SupportGraph::SupportGraph(const Model& model) : model_(model) {
  for (const ModelBody& body : model.bodies) {
    root_friction_.push_back(std::sqrt(model.materials[body.material].friction));
  }
  build({});
}

void SupportGraph::build(std::span<const BodyContact> contacts) {
  const size_t bodies = model_.bodies.size();
  first_.assign(bodies + 1, 0);
  for (const BodyContact& contact : contacts) {
    ++first_[contact.a + 1];
    ++first_[contact.b + 1];
  }
  for (size_t body = 0; body < bodies; ++body) first_[body + 1] += first_[body];
  next_ = first_;
  supports_.resize(2 * contacts.size());
  neighbours_.resize(2 * contacts.size());
  for (const BodyContact& contact : contacts) {
    const double friction = root_friction_[contact.a] * root_friction_[contact.b];
    const uint32_t of_a = next_[contact.a]++;
    const uint32_t of_b = next_[contact.b]++;
    supports_[of_a] = {contact.point, contact.normal, friction};
    supports_[of_b] = {contact.point, -contact.normal, friction};
    neighbours_[of_a] = contact.b;
    neighbours_[of_b] = contact.a;
  }
}

}  // namespace pilesim

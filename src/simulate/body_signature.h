// What the statistical simulator knows of an object: its signature and what follows from it.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "scene/model.h"
#include "signature/response_model.h"
#include "signature/signature.h"
#include "simulate/rest_control.h"

namespace pilesim {

struct BodySignature {
  std::shared_ptr<const Signature> signature;
  std::optional<ResponseModel> responses;  // of the signature: tables or splines
  float gyration_m = 0;
  float outer_radius_m = 0;
  // Of the sphere that stands for the body where it lies among others: spheres of this radius pile
  // up as high as the bodies do.
  float packing_radius_m = 0;
  // What resists rolling, as a part of the radius: a ball rolls for ever, a block does not.
  float rolling = 0;
  std::vector<RestTarget> rest_targets;
};

// One for each shape of `model` that dynamic bodies have, in the order of shapes. Throws
// Error(input) for a shape without signature, and for a signature of another mesh, another scale or
// another material.
std::vector<BodySignature> load_signatures(const Model& model);

}  // namespace pilesim

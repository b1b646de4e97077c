// Keys of a part of a scene that is one of several alternatives: a shape, a motor's action, an
// emitter's source.
#pragma once

#include <string>
#include <utility>
#include <variant>

#include "json/object_codec.h"
#include "scene/scene.h"

namespace pilesim {

// The variant that holds the alternatives.
inline Shape& variant_of(Shape& shape) { return shape; }
inline const Shape& variant_of(const Shape& shape) { return shape; }
inline auto& variant_of(Motor& motor) { return motor.action; }
inline const auto& variant_of(const Motor& motor) { return motor.action; }
inline auto& variant_of(Emitter& emitter) { return emitter.source; }
inline const auto& variant_of(const Emitter& emitter) { return emitter.source; }

// Reaches a member of the alternative V.
template <class V, class M>
auto of(M V::*member) {
  return [member](auto& owner) -> auto& { return std::get<V>(variant_of(owner)).*member; };
}

// The alternative V of an Owner.
template <class Owner, class V>
Alternative<Owner> alternative(std::string name, std::string description, Fields<Owner> fields) {
  return {.name = std::move(name),
          .description = std::move(description),
          .select = [](Owner& owner) { variant_of(owner).template emplace<V>(); },
          .is_selected =
              [](const Owner& owner) { return std::holds_alternative<V>(variant_of(owner)); },
          .fields = std::move(fields)};
}

}  // namespace pilesim

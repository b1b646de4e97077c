// Poses in scene files: `position` and `orientation` (or `rotation_deg`) beside the other keys.
#pragma once

#include <string>

#include "scene/object_codec.h"

namespace pilesim {

inline const std::string kRotationText =
    "angles in degrees [x, y, z], turned about the object's own x axis, then its new y axis, then "
    "its new z axis (intrinsic XYZ)";

// `access` takes a T& to its Pose&; `what` stands there.
template <class T, class Access>
Fields<T> pose_fields(Access access, const std::string& what) {
  const auto position = [access](auto& object) -> auto& {
    return std::invoke(access, object).position;
  };
  const auto orientation = [access](auto& object) -> auto& {
    return std::invoke(access, object).orientation;
  };
  return {
      field<T>("position", position, vector3(), "Where " + what + " stands, m."),
      in_group("orientation",
               field<T>("orientation", orientation, quaternion(),
                        "How " + what + " is turned: a unit quaternion [w, x, y, z].")),
      in_group("orientation",
               input_only(derived_field<T>("rotation_deg", orientation, rotation_deg(),
                                           "Instead of orientation: " + kRotationText + "."))),
  };
}

}  // namespace pilesim

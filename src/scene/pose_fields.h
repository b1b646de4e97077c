// Poses in scene files: `position` and `orientation` (or `rotation_deg`) beside the other keys.
#pragma once

#include <string>

#include "json/object_codec.h"

namespace pilesim {

inline const std::string kRotationText =
    "angles in degrees [x, y, z], turned about the object's own x axis, then its new y axis, then "
    "its new z axis (intrinsic XYZ)";

// `access` takes a T& to its Pose&; `what` names the object that has it. `prefix` begins each key.
template <class T, class Access>
Fields<T> pose_fields(Access access, const std::string& what, const std::string& prefix = "") {
  const auto position = [access](auto& object) -> auto& {
    return std::invoke(access, object).position;
  };
  const auto orientation = [access](auto& object) -> auto& {
    return std::invoke(access, object).orientation;
  };
  return {
      field<T>(prefix + "position", position, vector3(), "Position of " + what + ", m."),
      in_group(prefix + "orientation",
               field<T>(prefix + "orientation", orientation, quaternion(),
                        "Orientation of " + what + ": a unit quaternion [w, x, y, z].")),
      in_group(prefix + "orientation",
               input_only(derived_field<T>(prefix + "rotation_deg", orientation, rotation_deg(),
                                           "Instead of the quaternion: " + kRotationText + "."))),
  };
}

}  // namespace pilesim

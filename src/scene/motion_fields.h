// Motion in scene files: `motion`, `interpolation` and `motors` beside the other keys.
#pragma once

#include <string>

#include "json/object_codec.h"
#include "scene/scene_format.h"

namespace pilesim {

// `access` takes a T& to its Motion&; `what` names the moving object.
template <class T, class Access>
Fields<T> motion_fields(Access access, const std::string& what) {
  return {
      field<T>("motion", access, list(motion_key_codec()),
               "Poses of " + what + " by ascending times."),
      field<T>(
          "interpolation",
          [access](auto& object) -> auto& { return std::invoke(access, object).interpolation; },
          enumeration<Interpolation>(
              {{"linear", Interpolation::linear}, {"smooth", Interpolation::smooth}}),
          "Motion between keys: linear, or smooth: at rest at the first and the last key and never "
          "beyond two neighbouring keys."),
      field<T>(
          "motors", [access](auto& object) -> auto& { return std::invoke(access, object).motors; },
          list(kinematic_motor_codec()),
          "Spin, sway and shake " + what +
              ", in its own frame, from where its pose or its motion keys put it. Each motor moves "
              "those after it."),
  };
}

// Reports `interpolation` in an object that has no `motion`.
inline void require_motion(const Json& json, const Path& path, ReadContext& context) {
  if (!json.contains("interpolation") || json.contains("motion")) return;
  context.log.report_key(path / "interpolation", R"(stands without "motion")",
                         "this key beside motion keys only",
                         R"(Add "motion", or take "interpolation" away)");
}

}  // namespace pilesim

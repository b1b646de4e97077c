#include "core/rotation.h"
#include "json/object_codec.h"
#include "scene/pose_fields.h"
#include "scene/scene_format.h"

namespace pilesim {

namespace {

Codec<Hinge> hinge_codec() {
  return object<Hinge>(
      {.noun = "a hinge",
       .fields = {
           required_field<Hinge>("axis", &Hinge::axis, direction(),
                                 "Direction of the free axis, world frame at the start."),
           derived_field<Hinge>("anchor", &Hinge::anchor, vector3(),
                                "A point of the axis, m, world frame. Default: the body's "
                                "position."),
       }});
}

// The resolved scene keeps angles, as they count turns.
Codec<MotionKey> motion_key_codec() {
  Fields<MotionKey> fields = pose_fields<MotionKey>(&MotionKey::pose, "the body at that time");
  for (Field<MotionKey>& each : fields) {
    if (each.key.name == "orientation") {
      each.write = [write = each.write](const MotionKey& key) {
        return key.rotation_deg ? std::nullopt : write(key);
      };
    } else if (each.key.name == "rotation_deg") {
      each = in_group("orientation", optional_field<MotionKey>(
                                         "rotation_deg", &MotionKey::rotation_deg, vector3(),
                                         "Instead of the quaternion: " + kRotationText +
                                             ". Where all keys have them, the angles go "
                                             "from key to key: from 0 to 720 is two turns."));
    }
  }
  return object<MotionKey>(
      {.noun = "a motion key",
       .fields = Fields<MotionKey>{required_field<MotionKey>("time_s", &MotionKey::time_s,
                                                             number(at_least(0)), "Time, s.")} +
                 fields,
       .finish = [](const Json&, const Path&, MotionKey& key, ReadContext&) {
         if (key.rotation_deg) key.pose.orientation = from_rotation_deg(*key.rotation_deg);
       }});
}

Fields<Body> identity_fields() {
  return {
      derived_field<Body>("name", &Body::name, text(),
                          "Unique name for events and messages. Default: \"body/3\" for the "
                          "fourth."),
      required_field<Body>("shape", &Body::shape, text(), "Name of a shape."),
      required_field<Body>("material", &Body::material, text(), "Name of a material."),
  };
}

Fields<Body> state_fields() {
  return {
      field<Body>("linear_velocity", &Body::linear_velocity, vector3(),
                  "Velocity of the centre of mass at the start, m/s."),
      field<Body>("angular_velocity", &Body::angular_velocity, vector3(),
                  "Angular velocity at the start, rad/s, world frame."),
      field<Body>(
          "role", &Body::role,
          enumeration<Role>({{"dynamic", Role::dynamic},
                             {"static", Role::fixed},
                             {"kinematic", Role::kinematic}}),
          "dynamic: moved by forces; static: never moved; kinematic: moved by its motion keys."),
      field<Body>("held", &Body::held, boolean(),
                  "A dynamic body stands still until a release event names it."),
      field<Body>("asleep", &Body::asleep, boolean(),
                  "A dynamic body begins asleep and wakes when something hits it or its support."),
      field<Body>("preference", &Body::preference, preference_codec(), kPreferenceText),
      optional_field<Body>("hinge", &Body::hinge, hinge_codec(),
                           "Lets a dynamic body turn about one axis only."),
      field<Body>("motion", &Body::motion, list(motion_key_codec()),
                  "Poses of a kinematic body by ascending times."),
      field<Body>(
          "interpolation", [](auto& body) -> auto& { return body.motion.interpolation; },
          enumeration<Interpolation>(
              {{"linear", Interpolation::linear}, {"smooth", Interpolation::smooth}}),
          "Motion between keys: linear, or smooth: at rest at the first and the last key and never "
          "beyond two neighbouring keys."),
      optional_field<Body>("colour", &Body::colour, colour(),
                           "\"#rrggbb\" in sRGB. Default: from the palette."),
  };
}

}  // namespace

Codec<Body> body_codec() {
  return object<Body>(
      {.noun = "a body",
       .fields = identity_fields() +
                 pose_fields<Body>(&Body::pose, "the shape's own frame (not its centre of mass)") +
                 state_fields(),
       .finish = [](const Json& json, const Path&, Body& body, ReadContext&) {
         const auto hinge = json.find("hinge");
         if (body.hinge && hinge->is_object() && !hinge->contains("anchor")) {
           body.hinge->anchor = body.pose.position;
         }
       }});
}

Codec<Event> event_codec() {
  const auto bodies = [](auto& event) -> auto& {
    return std::visit(
        [](auto& action) -> auto& { return action.bodies; }, event.action);
  };
  const auto impulse = [](auto& event) -> auto& {
    return std::get<ImpulseEvent>(event.action).impulse;
  };
  const auto point = [](auto& event) -> auto& {
    return std::get<ImpulseEvent>(event.action).point;
  };
  const auto alternative = []<class V>(V, std::string name, std::string description,
                                       Fields<Event> fields) {
    return Alternative<Event>{
        .name = std::move(name),
        .description = std::move(description),
        .select = [](Event& event) { event.action.emplace<V>(); },
        .is_selected = [](const Event& event) { return std::holds_alternative<V>(event.action); },
        .fields = std::move(fields)};
  };
  return object<Event>(
      {.noun = "an event",
       .fields = {required_field<Event>("time_s", &Event::time_s, number(at_least(0)), "Time, s."),
                  required_field<Event>("bodies", bodies, list(text(), 1),
                                        "Names of bodies; an emitter's name means all its bodies, "
                                        "\"emitter/17\" its eighteenth.")},
       .choice_key = "type",
       .alternatives = {
           alternative(ReleaseEvent{}, "release", "Lets held bodies go.", {}),
           alternative(RemoveEvent{}, "remove", "Takes bodies out of the scene.", {}),
           alternative(
               ImpulseEvent{}, "impulse", "Applies an impulse to dynamic bodies.",
               {required_field<Event>("impulse", impulse, vector3(),
                                      "Impulse on each body, N s, world frame."),
                optional_field<Event>("point", point, vector3(),
                                      "Point at which it acts, m, world frame. Default: the "
                                      "centre of mass.")}),
       }});
}

}  // namespace pilesim

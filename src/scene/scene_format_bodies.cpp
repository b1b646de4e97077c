#include <algorithm>
#include <functional>
#include <utility>

#include "core/rotation.h"
#include "json/object_codec.h"
#include "scene/looks.h"
#include "scene/motion_fields.h"
#include "scene/pose_fields.h"
#include "scene/scene_format.h"
#include "scene/variant_fields.h"

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

Codec<SurfaceVelocity> surface_velocity_codec() {
  using S = SurfaceVelocity;
  Codec<S> codec =
      object<S>({.noun = "a surface velocity",
                 .fields = {field<S>("linear", &S::linear, vector3(), "m/s, own frame."),
                            field<S>("angular", &S::angular, vector3(),
                                     "rad/s, own frame, about the body's own origin.")},
                 .finish = [](const Json& json, const Path& path, S&, ReadContext& context) {
                   if (!json.empty()) return;
                   context.log.report(path, "is empty, so the surface stands still",
                                      "\"linear\", \"angular\", or both",
                                      R"(Add "linear": [x, y, z] in m/s, or take the key away)");
                 }});
  codec.schema["minProperties"] = 1;
  return codec;
}

}  // namespace

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

namespace {

template <class V>
Field<Motor> anchor() {
  return field<Motor>("anchor", of(&V::anchor), vector3(), "A point of the axis, m, own frame.");
}

Fields<Motor> wave_fields() {
  return {required_field<Motor>("frequency_hz", &Motor::frequency_hz, number(above(0)),
                                "How often a second it goes to and fro."),
          field<Motor>("phase_deg", &Motor::phase, angle_deg(between(-360, 360)),
                       "Of the sine at start_s: 0 is the middle, 90 the far end.")};
}

}  // namespace

Codec<Motor> kinematic_motor_codec() {
  std::vector<Alternative<Motor>> types = {
      alternative<Motor, SpinMotor>(
          "spin", "Turns at a rate.",
          {required_field<Motor>("angular_velocity", of(&SpinMotor::angular_velocity), vector3(),
                                 "rad/s, own frame."),
           anchor<SpinMotor>()}),
      alternative<Motor, SwayMotor>(
          "sway", "Turns to and fro, as a sine.",
          Fields<Motor>{required_field<Motor>("axis", of(&SwayMotor::axis), direction(),
                                              "The axis, own frame."),
                        anchor<SwayMotor>(),
                        required_field<Motor>("amplitude_deg", of(&SwayMotor::amplitude),
                                              angle_deg(between(0, 180)),
                                              "How far it turns to either side.")} +
              wave_fields()),
      alternative<Motor, ShakeMotor>("shake", "Moves to and fro, as a sine.",
                                     Fields<Motor>{required_field<Motor>(
                                         "amplitude_m", of(&ShakeMotor::amplitude_m), vector3(),
                                         "How far it moves to either side [x, y, z], own "
                                         "frame.")} +
                                         wave_fields())};
  return object<Motor>(
      {.noun = "a motor",
       .fields = {field<Motor>("start_s", &Motor::start_s, number(at_least(0)), "When it starts."),
                  optional_field<Motor>("end_s", &Motor::end_s, number(at_least(0)),
                                        "When it has come to rest. Default: never."),
                  derived_field<Motor>("ramp_s", &Motor::ramp_s, number(at_least(0)),
                                       "In which it grows to its rate or amplitude, and before "
                                       "end_s shrinks. Default: of a spin 0, else a period.")},
       .choice_key = "type",
       .alternatives = std::move(types),
       .finish = [](const Json& json, const Path&, Motor& motor, ReadContext&) {
         if (json.contains("ramp_s") || std::holds_alternative<SpinMotor>(motor.action)) return;
         motor.ramp_s = 1 / motor.frequency_hz;
         if (motor.end_s) motor.ramp_s = std::min(motor.ramp_s, (*motor.end_s - motor.start_s) / 2);
         motor.ramp_s = std::max(motor.ramp_s, 0.0);
       }});
}

namespace {

Fields<Body> identity_fields() {
  return {
      derived_field<Body>("name", &Body::name, text(),
                          "Unique name for events and messages. Default: \"body/3\" for the "
                          "fourth."),
      required_field<Body>("shape", &Body::shape, text(), "Name of a shape."),
      required_field<Body>("material", &Body::material, text(), "Name of a material."),
  };
}

Fields<Body> start_fields() {
  return {
      field<Body>("linear_velocity", &Body::linear_velocity, vector3(),
                  "Velocity of the centre of mass at the start, m/s."),
      field<Body>("angular_velocity", &Body::angular_velocity, vector3(),
                  "Angular velocity at the start, rad/s, world frame."),
      field<Body>("role", &Body::role,
                  enumeration<Role>({{"dynamic", Role::dynamic},
                                     {"static", Role::fixed},
                                     {"kinematic", Role::kinematic}}),
                  "dynamic: moved by forces; static: never moved; kinematic: moved by its motion "
                  "keys and motors."),
      field<Body>("held", &Body::held, boolean(),
                  "A dynamic body stands still until a release event names it."),
      field<Body>("asleep", &Body::asleep, boolean(),
                  "A dynamic body begins asleep and wakes when something hits it or its support."),
      field<Body>("preference", &Body::preference, preference_codec(), kPreferenceText),
      optional_field<Body>("hinge", &Body::hinge, hinge_codec(),
                           "Lets a dynamic body turn about one axis only."),
  };
}

Fields<Body> surface_fields() {
  return {
      optional_field<Body>(
          "surface_velocity", &Body::surface_velocity, surface_velocity_codec(),
          "Velocity of the surface of a static or kinematic body that itself stays "
          "where it is: a belt, a roller, a turntable. Friction carries what lies on "
          "it."),
      optional_field<Body>("look", &Body::look, look_codec(),
                           "Look in pictures by name. Default: the material's."),
      optional_field<Body>("colour", &Body::colour, colour(),
                           "\"#rrggbb\" in sRGB. Default: the look's, or from the palette."),
  };
}

}  // namespace

Codec<Body> body_codec() {
  return object<Body>(
      {.noun = "a body",
       .fields = identity_fields() +
                 pose_fields<Body>(&Body::pose, "the shape's own frame (not its centre of mass)") +
                 start_fields() + motion_fields<Body>(&Body::motion, "a kinematic body") +
                 surface_fields(),
       .finish = [](const Json& json, const Path& path, Body& body, ReadContext& context) {
         require_motion(json, path, context);
         const auto hinge = json.find("hinge");
         if (body.hinge && hinge->is_object() && !hinge->contains("anchor")) {
           body.hinge->anchor = body.pose.position;
         }
       }});
}

Codec<Event> event_codec() {
  const auto targets = [](auto& event) -> auto& {
    return std::visit(
        [](auto& action) -> auto& { return action.bodies; }, event.action);
  };
  const Field<Event> bodies =
      required_field<Event>("bodies", targets, list(text(), 1),
                            "Names of bodies; an emitter's name means all its bodies, "
                            "\"emitter/17\" its eighteenth.");
  const auto highest = [](auto& event) -> auto& {
    return std::get<RemoveEvent>(event.action).highest;
  };
  const auto is_by_height = [highest](const Event& event) { return highest(event) > 0; };
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
       .fields = {required_field<Event>("time_s", &Event::time_s, number(at_least(0)), "Time, s.")},
       .choice_key = "type",
       .alternatives = {
           alternative(ReleaseEvent{}, "release", "Lets held bodies go.", {bodies}),
           alternative(
               RemoveEvent{}, "remove", "Takes bodies out of the scene.",
               {in_group("bodies", unless(bodies, is_by_height)),
                in_group("bodies",
                         unless(required_field<Event>(
                                    "highest", highest, integer(1, kMostBodies),
                                    "Instead of bodies: so many of the dynamic bodies that are in "
                                    "the scene then, those whose centres are highest."),
                                std::not_fn(is_by_height)))}),
           alternative(
               ImpulseEvent{}, "impulse", "Applies an impulse to dynamic bodies.",
               {bodies,
                required_field<Event>("impulse", impulse, vector3(),
                                      "Impulse on each body, N s, world frame."),
                optional_field<Event>("point", point, vector3(),
                                      "Point at which it acts, m, world frame. Default: the "
                                      "centre of mass.")}),
       }});
}

}  // namespace pilesim

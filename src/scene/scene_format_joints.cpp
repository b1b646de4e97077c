#include "core/rotation.h"
#include "json/object_codec.h"
#include "scene/scene_format.h"

namespace pilesim {
namespace {

Codec<HingeMotor> motor_codec() {
  return object<HingeMotor>(
      {.noun = "a motor",
       .fields = {
           required_field<HingeMotor>("turns_per_s", &HingeMotor::turns_per_s,
                                      number(between(-1000, 1000)),
                                      "Speed that it drives body a at, against b."),
           required_field<HingeMotor>("torque_nm", &HingeMotor::torque_nm, number(at_least(0)),
                                      "The most that it drives and brakes with, N m."),
       }});
}

}  // namespace

Codec<Joint> joint_codec() {
  return object<Joint>(
      {.noun = "a joint",
       .fields = {
           required_field<Joint>("type", &Joint::kind,
                                 enumeration<JointKind>({{"ball", JointKind::ball},
                                                         {"hinge", JointKind::hinge},
                                                         {"fixed", JointKind::fixed}}),
                                 "ball: both turn freely about the point; hinge: about the axis; "
                                 "fixed: they move as one."),
           required_field<Joint>("a", &Joint::a, text(), "Name of a dynamic body."),
           optional_field<Joint>("b", &Joint::b, text(),
                                 "Name of another body. Default: the world."),
           required_field<Joint>("point", &Joint::point, vector3(),
                                 "Where they are joined, m, world frame at the start."),
           optional_field<Joint>("axis", &Joint::axis, direction(),
                                 "Hinge: its axis, world frame at the start."),
           optional_field<Joint>(
               "limits_deg", &Joint::limits,
               two_numbers(between(-180, 180), "[least, most]", degrees(1)),
               "Hinge: how far a may turn against b, right-handed about the axis; "
               "0 is the start."),
           optional_field<Joint>("motor", &Joint::motor, motor_codec(), "Hinge: what turns it."),
           optional_field<Joint>("breaking_force_n", &Joint::breaking_force_n, number(above(0)),
                                 "A joint that carries more breaks, N. Default: none does."),
           optional_field<Joint>(
               "collide", &Joint::collide, boolean(),
               "Whether a and b collide with each other. Default: where the joint "
               "can break."),
       }});
}

Codec<Chain> chain_codec() {
  return object<Chain>(
      {.noun = "a chain",
       .fields = {
           derived_field<Chain>("name", &Chain::name, text(),
                                "Its links are \"name/0\" and so on. Default: \"chain/0\" for the "
                                "first."),
           required_field<Chain>("shape", &Chain::shape, text(),
                                 "Name of the links' shape. Its y axis lies along the chain."),
           required_field<Chain>("material", &Chain::material, text(), "Name of a material."),
           required_field<Chain>("count", &Chain::count, integer(1, 10000), "Links."),
           required_field<Chain>("from", &Chain::from, vector3(), "Where it begins, m."),
           required_field<Chain>("to", &Chain::to, vector3(), "Where it ends, m."),
           optional_field<Chain>("start", &Chain::start, text(),
                                 "The body that its beginning hangs on, or \"world\". Default: "
                                 "nothing."),
           optional_field<Chain>("end", &Chain::end, text(), "The same for its end."),
           optional_field<Chain>("breaking_force_n", &Chain::breaking_force_n, number(above(0)),
                                 "A joint that carries more breaks, N. Default: none does."),
           optional_field<Chain>("colour", &Chain::colour, colour(),
                                 "\"#rrggbb\" in sRGB. Default: from the palette."),
       }});
}

}  // namespace pilesim

#include "json/object_codec.h"
#include "scene/pose_fields.h"
#include "scene/scene_format.h"

namespace pilesim {

namespace {

Fields<Guide> shape_fields() {
  return Fields<Guide>{
             in_group("guide",
                      optional_field<Guide>(
                          "file", &Guide::file, file_path(),
                          "Mesh file, relative to the scene file, made solid as a body's mesh. "
                          "Bodies with their centre of mass inside are controlled. Default: all "
                          "bodies.")),
             in_group("guide", optional_field<Guide>("shape", &Guide::shape, text(),
                                                     "Name of a shape of the scene, instead of a "
                                                     "file: a text, a cone, a compound, ...")),
             field<Guide>("scale", &Guide::scale, number(above(0)), "Metres per unit of the file."),
         } +
         pose_fields<Guide>(&Guide::pose, "the mesh");
}

Fields<Guide> control_fields() {
  using G = Guide;
  return {
      field<G>("control", &G::control, boolean(),
               "Hold bodies that can stand. False: only analyse and measure."),
      field<G>(
          "hold", &G::hold,
          enumeration<HoldKind>(
              {{"glue", HoldKind::glue}, {"freeze", HoldKind::freeze}, {"nail", HoldKind::nail}}),
          "glue: the whole pile is held by the least glue at its contacts with which it stands; "
          "freeze: bodies that can stand are held still; nail: bodies are nailed to their "
          "neighbours as in section 6.2 of the dissertation."),
      field<G>("alpha", &G::alpha, number(at_least(0)),
               "Nails: least area of the contacts by (6.2), in squares of the bounding radius."),
      optional_field<G>("max_glue", &G::max_glue, number(at_least(0)),
                        "Most glue, in the pile's weight; 0 is none. A pile that needs more slumps "
                        "until it stands. Default: no limit."),
      field<G>("period_steps", &G::period_steps, integer(1, 100000),
               "Steps between two control steps."),
      field<G>("least_normal_up", &G::least_normal_up, number(between(-1, 1)),
               "Contacts count as support if the upward part of their unit normal exceeds this. 0 "
               "is the dissertation's conservative rule, -1 takes nearly all contacts."),
      field<G>("kinetic_share", &G::kinetic_share, number(between(0, 1)),
               "Share of the friction at which a body must stand to be held."),
      field<G>("least_contacts", &G::least_contacts, integer(1, 1000),
               "Fewest supporting contacts of a body that is held."),
      field<G>("least_spread", &G::least_spread, number(at_least(0)),
               "Least spread of these contacts: twice the area of their largest triangle, in "
               "squares of the bounding radius."),
      field<G>("neighbours", &G::neighbours, boolean(),
               "Hold a body only if all bodies that touch it can be held, too."),
      field<G>("most_speed", &G::most_speed, number(above(0)),
               "Greatest speed at which a body may be held, in sqrt(g r), r its bounding radius."),
      field<G>("break_speed", &G::break_speed, number(above(0)),
               "A hit frees the mass that it could move at this speed, in sqrt(g r)."),
  };
}

}  // namespace

Codec<Guide> guide_codec() {
  return object<Guide>({.noun = "the guide", .fields = shape_fields() + control_fields()});
}

}  // namespace pilesim

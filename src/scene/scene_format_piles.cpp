#include "json/object_codec.h"
#include "scene/scene_format.h"

namespace pilesim {

namespace {

Codec<GroundPoint> ground_point() {
  Codec<GroundPoint> codec;
  codec.expected = "an array of 2 numbers, [x, z]";
  codec.schema = {
      {"type", "array"}, {"items", {{"type", "number"}}}, {"minItems", 2}, {"maxItems", 2}};
  codec.read = [expected = codec.expected](const Json& json, const Path& path, GroundPoint& value,
                                           ReadContext& context) {
    if (!json.is_array() || json.size() != 2) {
      context.log.report(path, describe_value(json), expected);
      return;
    }
    const Codec<double> coordinate = number();
    for (size_t i = 0; i < 2; ++i) {
      coordinate.read(json[i], path / i, value[static_cast<Eigen::Index>(i)], context);
    }
  };
  codec.write = [](const GroundPoint& value) { return Json{value.x(), value.y()}; };
  return codec;
}

Codec<PileBoundary> boundary_codec() {
  using B = PileBoundary;
  return object<B>(
      {.noun = "a pile's boundary",
       .fields = {
           required_field<B>("polygon", &B::polygon, list(ground_point(), 1),
                             "Corners [x, z] of the walls' inside, a convex polygon, m."),
           required_field<B>("rim_m", &B::rim_m, number(), "Height y of the walls' top, m."),
       }});
}

// Left out of the resolved scene where there is none: it excludes a centre.
Field<Pile> footprint_field() {
  Field<Pile> field = derived_field<Pile>(
      "footprint", &Pile::footprint, list(ground_point(), 1),
      "Instead of centre: two ends [x, z] of a line or the corners of a convex polygon, from which "
      "slopes fall on all sides.");
  field.write = [write = field.write](const Pile& pile) {
    return pile.footprint.empty() ? std::nullopt : write(pile);
  };
  return field;
}

}  // namespace

Codec<Pile> pile_codec() {
  using P = Pile;
  return object<P>(
      {.noun = "a pile",
       .fields = {
           required_field<P>("angle_deg", &P::angle,
                             angle_deg({.minimum = 0, .maximum = 80, .excludes_minimum = true}),
                             "Angle of repose, degrees."),
           field<P>("tau", &P::tau,
                    number({.minimum = 0,
                            .maximum = 1,
                            .excludes_minimum = true,
                            .excludes_maximum = true}),
                    "Sleep score above which bodies in the pile sleep; lower: earlier."),
           field<P>("method", &P::method, method_codec(),
                    "pilesim's own method, or dissertation, section 5.2 as it is written, to "
                    "compare with."),
           field<P>("base_m", &P::base_m, number(), "Height y of the pile's base, m."),
           in_group("place", optional_field<P>("centre", &P::centre, ground_point(),
                                               "Middle [x, z] of the pile, m. Without centre and "
                                               "footprint: where the first bodies land.")),
           in_group("place", footprint_field()),
           optional_field<P>("boundary", &P::boundary, boundary_codec(),
                             "Walls that the pile grows against."),
       }});
}

}  // namespace pilesim

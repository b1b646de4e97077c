#include <algorithm>
#include <cmath>

#include "json/object_codec.h"
#include "scene/looks.h"
#include "scene/motion_fields.h"
#include "scene/pose_fields.h"
#include "scene/scene_format.h"
#include "scene/variant_fields.h"

namespace pilesim {

namespace {

Field<Emitter> rate_field() {
  return field<Emitter>("rate_hz", &Emitter::rate_hz, number(at_least(0)),
                        "Bodies a second, one by one from start_s on; 0: all at start_s.");
}

// Where all bodies start in one place, they must not start at one time.
Field<Emitter> required_rate_field() {
  return required_field<Emitter>("rate_hz", &Emitter::rate_hz, number(above(0)),
                                 "Bodies a second, one by one from start_s on.");
}

Codec<UntilFull> box_codec() {
  return object<UntilFull>(
      {.noun = "a box",
       .fields = {required_field<UntilFull>("min", &UntilFull::min, vector3(),
                                            "Its least corner, m, world frame."),
                  required_field<UntilFull>("max", &UntilFull::max, vector3(),
                                            "Its greatest corner, m, world frame.")},
       .finish = [](const Json&, const Path& path, UntilFull& box, ReadContext& context) {
         const Path max = path / "max";
         if (!context.log.is_sound(path)) return;
         for (int k = 0; k < 3; ++k) {
           if (box.max[k] > box.min[k]) continue;
           context.log.report(max / static_cast<size_t>(k), "is " + number_text(box.max[k]),
                              "more than " + number_text(box.min[k]) + ", that of \"min\"");
         }
       }});
}

Field<Emitter> until_field() {
  const auto self = [](auto& until) -> auto& { return until; };
  const Codec<UntilFull> until = object<UntilFull>(
      {.noun = "the end of an emitter",
       .fields = {required_field<UntilFull>(
           "full", self, box_codec(),
           "A box, such as the top of a container. Full: a body lies with its centre in it, "
           "asleep or slow for a while.")}});
  return optional_field<Emitter>("until", &Emitter::until, until,
                                 "When the emitter stops before its end: bodies that have not "
                                 "started by then never do.");
}

// Keys of emitters whose bodies may start one by one until a time.
Fields<Emitter> stream_fields(const Field<Emitter>& rate) {
  return {derived_field<Emitter>("count", &Emitter::count, integer(1, kMostBodies),
                                 "Number of bodies. Default: all that start before end_s."),
          rate,
          optional_field<Emitter>("end_s", &Emitter::end_s, number(above(0)),
                                  "When no more bodies start, s. Default: after count."),
          until_field()};
}

bool has_stream_fields(const Emitter& emitter) {
  return std::holds_alternative<DiskSource>(emitter.source) ||
         std::holds_alternative<LineSource>(emitter.source) ||
         std::holds_alternative<PointSource>(emitter.source);
}

// `count` of those that start before end_s, or less where it is given.
void count_to_end(const Path& path, bool is_counted, Emitter& emitter, ReadContext& context) {
  const double end_s = *emitter.end_s;
  if (end_s <= emitter.start_s) {
    context.log.report(path / "end_s", "is " + number_text(end_s),
                       "more than " + number_text(emitter.start_s) + ", its start_s");
    return;
  }
  constexpr double kRounding = 1e-6;  // of a body
  const double count =
      std::max(1.0, std::ceil((end_s - emitter.start_s) * emitter.rate_hz - kRounding));
  if (!is_counted && count > kMostBodies) {
    context.log.report(path / "end_s", "gives " + number_text(count) + " bodies",
                       "at most " + std::to_string(kMostBodies));
    return;
  }
  emitter.count = static_cast<int>(is_counted ? std::min<double>(count, emitter.count) : count);
}

// Motion keys place the nozzle, so its position would be ignored.
void check_nozzle(const Json& json, const Path& path, const Emitter& emitter,
                  ReadContext& context) {
  require_motion(json, path, context);
  const auto* stream = std::get_if<PointSource>(&emitter.source);
  if (stream == nullptr || stream->motion.empty() || !json.contains("position")) return;
  context.log.report_key(
      path / "position", R"(stands beside "motion", which places the nozzle)", "one of the two",
      R"(Write the positions into the keys of "motion", and take this one away)");
}

void finish_emitter(const Json& json, const Path& path, Emitter& emitter, ReadContext& context) {
  check_nozzle(json, path, emitter, context);
  const bool is_counted = json.contains("count");
  const bool has_rate = context.log.is_sound_itself(path) && context.log.is_sound(path / "rate_hz");
  if (has_stream_fields(emitter) && !is_counted && !json.contains("end_s")) {
    context.log.report(path, "has no \"count\" or \"end_s\"",
                       "the number of bodies, or the time from which none starts");
  }
  if (!has_rate || !context.log.is_sound(path / "count")) return;
  if (emitter.rate_hz == 0) {
    const auto refuse = [&](bool is_given, const char* key) {
      if (!is_given) return;
      context.log.report_key(path / key, "stands without a rate: all bodies start at once",
                             "\"rate_hz\" above 0");
    };
    refuse(emitter.end_s.has_value(), "end_s");
    refuse(emitter.until.has_value(), "until");
  } else if (emitter.end_s && context.log.is_sound(path / "end_s") &&
             context.log.is_sound(path / "start_s")) {
    count_to_end(path, is_counted, emitter, context);
  }
}

// "shape": "rabbit" for "shapes": ["rabbit"].
Codec<std::vector<std::string>> single_shape() {
  Codec<std::vector<std::string>> codec;
  const Codec<std::string> name = text();
  codec.expected = name.expected;
  codec.schema = name.schema;
  codec.read = [name](const Json& json, const Path& path, std::vector<std::string>& shapes,
                      ReadContext& context) {
    shapes.resize(1);
    name.read(json, path, shapes.front(), context);
  };
  codec.write = [](const std::vector<std::string>&) { return Json(); };
  return codec;
}

Codec<Sizes> sizes_codec() {
  using enum SizeDistribution;
  return object<Sizes>(
      {.noun = "sizes",
       .fields = {
           required_field<Sizes>("from", &Sizes::from, number({.minimum = 1e-3, .maximum = 1e3}),
                                 "Smallest size, times the shape's own."),
           required_field<Sizes>("to", &Sizes::to, number({.minimum = 1e-3, .maximum = 1e3}),
                                 "Largest size, times the shape's own."),
           field<Sizes>("steps", &Sizes::steps, integer(2, 64), "Number of sizes, with these two."),
           field<Sizes>(
               "distribution", &Sizes::distribution,
               enumeration<SizeDistribution>(
                   {{"uniform", uniform}, {"log_uniform", log_uniform}, {"normal", normal}}),
               "uniform: evenly spaced, equally likely. log_uniform: in equal ratios, equally "
               "likely. normal: evenly spaced, by a bell curve whose ends are at two standard "
               "deviations."),
       }});
}

// Weights, materials and other keys of an emitter with several shapes.
Fields<Emitter> mix_fields() {
  using E = Emitter;
  return {
      unless(derived_field<E>("weights", &E::weights, list(number(at_least(0)), 1),
                              "A weight for each of shapes, by which they are drawn. Without "
                              "weights they are taken in turn."),
             [](const E& e) { return e.weights.empty(); }),
      in_group("material", unless(required_field<E>("materials", &E::materials, list(text(), 1),
                                                    "Instead of material: one for each of shapes."),
                                  [](const E& e) { return e.materials.empty(); })),
      optional_field<E>("sizes", &E::sizes, sizes_codec(),
                        "Range of sizes, one of which is drawn for each body."),
      unless(derived_field<E>("palette", &E::palette, list(colour(), 1),
                              "Colours \"#rrggbb\", one drawn for each body, instead of colour."),
             [](const E& e) { return e.palette.empty(); }),
      optional_field<E>("look", &E::look, look_codec(),
                        "Look of every body in pictures, by name. Default: the material's."),
      optional_field<E>("roughness", &E::roughness, two_numbers(between(0, 1), "[least, most]"),
                        "Range from which a value is drawn for each body, instead of the look's."),
      optional_field<E>("clear_coat", &E::clear_coat, two_numbers(between(0, 1), "[least, most]"),
                        "Range from which a value is drawn for each body, instead of the look's."),
  };
}

Fields<Emitter> common_fields() {
  using E = Emitter;
  return {
      derived_field<E>("name", &E::name, text(),
                       "Unique name; its bodies are \"name/0\", \"name/1\", ... Default: "
                       "\"emitter/3\" for the fourth."),
      in_group("shapes", required_field<E>("shapes", &E::shapes, list(text(), 1),
                                           "Names of the shapes, taken in turn.")),
      in_group("shapes",
               input_only(required_field<E>("shape", &E::shapes, single_shape(),
                                            "Instead of shapes: the name of the only one."))),
      in_group("material",
               unless(required_field<E>("material", &E::material, text(), "Name of a material."),
                      [](const E& e) { return !e.materials.empty(); })),
      field<E>("start_s", &E::start_s, number(at_least(0)), "When the first body appears, s."),
      field<E>("asleep", &E::asleep, boolean(),
               "Every body begins asleep and wakes when something hits it or its support."),
      field<E>("preference", &E::preference, preference_codec(), kPreferenceText),
      field<E>("linear_velocity", &E::linear_velocity, vector3(), "Velocity of every body, m/s."),
      field<E>("angular_velocity", &E::angular_velocity, vector3(),
               "Angular velocity of every body, rad/s."),
      field<E>("position_jitter_m", &E::position_jitter_m, number(at_least(0)),
               "Each position is moved at random in a cube of this half width, m."),
      field<E>("linear_velocity_jitter", &E::linear_velocity_jitter, number(at_least(0)),
               "Each velocity is changed at random in a ball of this radius, m/s."),
      field<E>("angular_velocity_jitter", &E::angular_velocity_jitter, number(at_least(0)),
               "Each angular velocity is changed at random in a ball of this radius, rad/s."),
      in_group("orientation", optional_field<E>("orientation", &E::orientation, quaternion(),
                                                "Orientation of every body: a unit quaternion [w, "
                                                "x, y, z]. Default: uniformly random.")),
      in_group("orientation",
               input_only(optional_field<E>("rotation_deg", &E::orientation, rotation_deg(),
                                            "Instead of orientation: " + kRotationText + "."))),
      optional_field<E>("colour", &E::colour, colour(),
                        "\"#rrggbb\" in sRGB for every body. Default: the look's, or from the "
                        "palette."),
  };
}

Alternative<Emitter> grid() {
  return alternative<Emitter, GridSource>(
      "grid", "A three-dimensional grid, bottom layer first.",
      {field<Emitter>("centre", of(&GridSource::centre), vector3(), "Centre of the grid, m."),
       required_field<Emitter>("count", of(&GridSource::count),
                               integers<3>(1, kMostBodies, "[x, y, z]"),
                               "Bodies along x, y and z."),
       required_field<Emitter>("spacing", of(&GridSource::spacing), vector3(above(0)),
                               "Distances between neighbours along x, y and z, m."),
       rate_field(), until_field()});
}

Alternative<Emitter> disk() {
  return alternative<Emitter, DiskSource>(
      "disk",
      "Uniformly random in an upright cylinder. Bodies that start together keep clear of one "
      "another while there is room.",
      Fields<Emitter>{field<Emitter>("centre", of(&DiskSource::centre), vector3(),
                                     "Centre of the cylinder, m."),
                      required_field<Emitter>("radius", of(&DiskSource::radius), number(above(0)),
                                              "Radius, m."),
                      field<Emitter>("height", of(&DiskSource::height), number(at_least(0)),
                                     "Full height, m.")} +
          stream_fields(rate_field()));
}

Alternative<Emitter> line() {
  return alternative<Emitter, LineSource>(
      "line", "A point that moves from one end of a line to the other and back.",
      Fields<Emitter>{
          required_field<Emitter>("from", of(&LineSource::from), vector3(),
                                  "First end of the line, m."),
          required_field<Emitter>("to", of(&LineSource::to), vector3(),
                                  "Second end of the line, m."),
          required_field<Emitter>("period_s", of(&LineSource::period_s), number(above(0)),
                                  "Time from the first end to the second and back, "
                                  "s.")} +
          stream_fields(required_rate_field()));
}

Alternative<Emitter> stream() {
  Fields<Emitter> motion = motion_fields<Emitter>(of(&PointSource::motion), "the nozzle");
  for (Field<Emitter>& each : motion) {
    each = unless(each, [](const Emitter& e) {
      const Motion& nozzle = std::get<PointSource>(e.source).motion;
      return nozzle.empty() && nozzle.motors.empty();
    });
  }
  return alternative<Emitter, PointSource>(
      "stream",
      "One by one from a nozzle. Where it turns, so do the velocities and a given orientation of "
      "its bodies.",
      Fields<Emitter>{unless(
          field<Emitter>("position", of(&PointSource::position), vector3(),
                         "The nozzle, m, where it has no motion keys."),
          [](const Emitter& e) { return !std::get<PointSource>(e.source).motion.empty(); })} +
          stream_fields(required_rate_field()) + motion);
}

Alternative<Emitter> volume() {
  const auto pose = [](auto& emitter) -> auto& {
    return std::get<VolumeSource>(emitter.source).pose;
  };
  return alternative<Emitter, VolumeSource>(
      "volume", "A lattice inside a closed mesh, filled from the bottom up.",
      Fields<Emitter>{required_field<Emitter>("file", of(&VolumeSource::file), file_path(),
                                              "Mesh file, relative to the scene file."),
                      field<Emitter>("scale", of(&VolumeSource::scale), number(above(0)),
                                     "Metres per unit of the file.")} +
          pose_fields<Emitter>(pose, "the mesh's own frame", "mesh_") +
          Fields<Emitter>{
              required_field<Emitter>("spacing", of(&VolumeSource::spacing), number(above(0)),
                                      "Distance between neighbours in the lattice, m."),
              field<Emitter>("count", &Emitter::count, integer(0, kMostBodies),
                             "Greatest number of bodies; 0: as many as fit."),
              rate_field(), until_field()});
}

Alternative<Emitter> guide() {
  return alternative<Emitter, GuideSource>(
      "upside_down",
      "Fills the guide upside down: bodies drop in through its base, then it is turned back. The "
      "bodies are released from the bottom up, from start_s on. With glue it is a mould.",
      {field<Emitter>("count", &Emitter::count, integer(0, kMostBodies),
                      "Greatest number of bodies; 0: as many as fit."),
       field<Emitter>("rate_hz", &Emitter::rate_hz, number(at_least(0)),
                      "Releases a second; 0: all at start_s.")});
}

Alternative<Emitter> mould() {
  return alternative<Emitter, MouldSource>(
      "mould",
      "Fills the guide like a closed mould of any shape: bodies appear wherever there is room and "
      "fall, until no more fit.",
      {field<Emitter>("count", &Emitter::count, integer(0, kMostBodies),
                      "Greatest number of bodies; 0: as many as fit.")});
}

}  // namespace

Codec<Emitter> emitter_codec() {
  return object<Emitter>(
      {.noun = "an emitter",
       .fields = common_fields() + mix_fields(),
       .choice_key = "type",
       .alternatives = {grid(), disk(), line(), stream(), volume(), guide(), mould()},
       .finish = finish_emitter});
}

}  // namespace pilesim

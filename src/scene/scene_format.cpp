#include "scene/scene_format.h"

#include "json/object_codec.h"
#include "scene/looks.h"
#include "scene/picture_limits.h"

namespace pilesim {

namespace {

// A key that says the same in every scene.
Field<Scene> version_field() {
  const std::string expected = std::to_string(kSceneVersion);
  Field<Scene> field;
  field.key = {.name = "version", .expected = expected, .is_required = true};
  field.read = [expected](const Json& json, const Path& path, Scene&, ReadContext& context) {
    if (json.is_number() && json.get<double>() == kSceneVersion) return;
    context.log.report(path, describe_value(json), expected);
  };
  field.write = [](const Scene&) { return std::optional<Json>(kSceneVersion); };
  field.schema = described({{"const", kSceneVersion}}, "The version of the scene format.");
  return field;
}

Field<Scene> ignored_schema_field() {
  Field<Scene> field;
  field.key.name = "$schema";
  field.read = [](const Json&, const Path&, Scene&, ReadContext&) {};
  field.write = [](const Scene&) { return std::optional<Json>(); };
  field.schema = described({{"type", "string"}}, "For editors; pilesim ignores it.");
  return field;
}

// Used up before the scene is read.
Field<Scene> used_up_field(const std::string& name, const Json& schema,
                           const std::string& description) {
  Field<Scene> field;
  field.key.name = name;
  field.read = [](const Json&, const Path&, Scene&, ReadContext&) {};
  field.write = [](const Scene&) { return std::optional<Json>(); };
  field.schema = described(schema, description);
  return field;
}

Fields<Scene> document_fields() {
  const Json name = {{"type", "string"}};
  return {
      ignored_schema_field(),
      used_up_field("include",
                    {{"oneOf", Json::array({name, {{"type", "array"}, {"items", name}}})}},
                    "Scene files that are read before this one, relative to it."),
      used_up_field("variables", {{"type", "object"}},
                    "Values by name, for {\"var\": NAME} in place of any value."),
      version_field(),
  };
}

Codec<std::string> any_text() {
  Codec<std::string> codec = text();
  codec.expected = "a string";
  codec.schema = {{"type", "string"}};
  codec.read = [](const Json& json, const Path& path, std::string& value, ReadContext& context) {
    if (!json.is_string()) {
      context.log.report(path, describe_value(json), "a string");
      return;
    }
    value = json.get<std::string>();
  };
  return codec;
}

// Left out of the resolved scene where it is the default, which is older than the key.
template <class T>
Field<T> newer(Field<T> field) {
  field.write = [write = field.write, plain = field.write(T{})](const T& object) {
    const std::optional<Json> value = write(object);
    return value == plain ? std::nullopt : value;
  };
  return field;
}

// A name that stands for many values: keys after it change some, and the resolved scene has all.
template <class T, class Access, class M>
Field<T> by_name(std::string key, Access access, const Codec<M>& codec,
                 const std::string& description) {
  return input_only(derived_field<T>(std::move(key), access, codec, description));
}

// `M::*`: a member of a material's look.
template <class M>
auto of_look(M Look::*member) {
  return [member](auto& material) -> auto& { return material.look.*member; };
}

Fields<Material> look_fields() {
  using M = Material;
  return {
      by_name<M>("look", &M::look, look_codec(),
                 "Look in pictures by name. Keys below change parts of it."),
      optional_field<M>("colour", of_look(&Look::colour), colour(),
                        "\"#rrggbb\" in sRGB of bodies that have none of their own. Default: that "
                        "of the mesh file, or from the palette."),
      newer(field<M>("roughness", of_look(&Look::roughness), number(between(0, 1)),
                     "Roughness of the surface in pictures: 0 polished, 1 matt.")),
      newer(field<M>(
          "clear_coat", of_look(&Look::clear_coat), number(between(0, 1)),
          "Share of a clear, polished layer over the surface in pictures: 0 none, 1 full.")),
      newer(field<M>("metallic", of_look(&Look::metallic), number(between(0, 1)),
                     "Share of the surface that mirrors in its own colour, as metals do.")),
      newer(field<M>("transmission", of_look(&Look::transmission), number(between(0, 1)),
                     "Share of the light that goes through, as through glass. White light that "
                     "has crossed the body where it is widest has the body's colour.")),
      newer(field<M>("emission", of_look(&Look::emission), number(between(0, kMostEmission)),
                     "Light that the surface sends, in its colour: 1 is as bright as a white "
                     "surface in the usual light.")),
      newer(field<M>("pattern", of_look(&Look::pattern),
                     enumeration<Pattern>({{"none", Pattern::none},
                                           {"checker", Pattern::checker},
                                           {"concrete", Pattern::concrete},
                                           {"planks", Pattern::planks}}),
                     "Pattern in the surface's colour, by place on the body.")),
      newer(field<M>("pattern_m", of_look(&Look::pattern_m), number(between(1e-4, 1e4)),
                     "Length of the pattern, m: a square's edge, a plank's width, a slab's side.")),
  };
}

Codec<Material> material_codec() {
  return object<Material>(
      {.noun = "a material",
       .fields =
           Fields<Material>{
               field<Material>("restitution", &Material::restitution, number(between(0, 1)),
                               "Bounce: 0 none, 1 elastic. A pair has the product's square root."),
               field<Material>("friction", &Material::friction, number(at_least(0)),
                               "Coulomb friction. A pair has the product's square root."),
               field<Material>("density_kg_m3", &Material::density_kg_m3,
                               number(at_least(kLeastDensity)), "Density, kg/m^3."),
               field<Material>(
                   "rolling_friction", &Material::rolling_friction, number(at_least(0)),
                   "Tangent of the steepest slope on which a ball stays. A pair has the "
                   "product's square root. Solved contacts only."),
               field<Material>("spinning_friction", &Material::spinning_friction,
                               number(at_least(0)),
                               "As rolling_friction, for turning about the contact's normal."),
           } +
           look_fields()});
}

Codec<RaySettings> rays_codec() {
  using R = RaySettings;
  return object<R>(
      {.noun = "the settings of rays",
       .fields = {
           field<R>("quality", &R::quality,
                    enumeration<RayQuality>({{"preview", RayQuality::preview},
                                             {"good", RayQuality::good},
                                             {"final", RayQuality::final}}),
                    "preview: 1 sample a pixel, no indirect light; good: 4 samples; final: 16 "
                    "samples, 2 bounces of indirect light."),
           optional_field<R>("samples", &R::samples, integer(1, kMostRaySamples),
                             "Samples a pixel. Default: by quality."),
           optional_field<R>("bounces", &R::bounces, integer(0, kMostRayBounces),
                             "Bounces of indirect light. Default: by quality."),
           field<R>("denoise", &R::denoise, boolean(), "Remove the noise of few samples."),
           field<R>("sun_angle_deg", &R::sun_angle, angle_deg(between(0, 90)),
                    "Angular size of the sun: 0 casts hard shadows; the real sun has 0.53."),
           field<R>("shutter", &R::shutter, number(between(0, 1)),
                    "Time of exposure about a frame's time, in frames: 0.5 is a film camera's 180 "
                    "degrees; 0: no motion blur."),
           field<R>("lens_diameter_m", &R::lens_diameter_m, number(at_least(0)),
                    "Diameter of the lens's opening, m. 0: all depths are sharp."),
           optional_field<R>("focus_distance_m", &R::focus_distance_m, number(above(0)),
                             "Distance of sharp focus along the optical axis, m. Default: that of "
                             "the camera's target."),
       }});
}

Codec<Light> light_codec() {
  using L = Light;
  return object<L>(
      {.noun = "the light",
       .fields =
           {
               by_name<L>(
                   "name", [](auto& light) -> auto& { return light; },
                   enumeration<L>(named_lights()),
                   "Light by name. Keys below change parts of it. Default: studio."),
               field<L>("azimuth_deg", &L::azimuth, angle_deg(between(-3600, 3600)),
                        "Direction of the sun: 0 is towards z, 90 towards x."),
               field<L>("elevation_deg", &L::elevation, angle_deg(between(5, 89)),
                        "Height of the sun, degrees."),
               field<L>("sun", &L::sun, number(between(0, 10)),
                        "Brightness of the sun, times the usual; 0: no shadows."),
               field<L>("sky", &L::sky, number(between(0, 10)),
                        "Brightness of the sky, times the usual."),
               field<L>("sun_colour", &L::sun_colour, colour(),
                        "Colour that multiplies the sun's light, which is a little warm."),
               newer(field<L>("sky_colour", &L::sky_colour, colour(),
                              "Colour that multiplies the sky's light.")),
               optional_field<L>("horizon_colour", &L::horizon_colour, colour(),
                                 "Colour behind everything at the horizon, at a sky of "
                                 "1. Default: almost white."),
               optional_field<L>("zenith_colour", &L::zenith_colour, colour(),
                                 "Colour behind everything above, at a sky of 1. "
                                 "Default: pale blue."),
               optional_field<L>(
                   "sky_file", &L::sky_file, file_path(),
                   "Picture of the sky in all directions, .hdr or .exr, twice as wide "
                   "as high. Its light is the sky's, and the sun is 0 unless it is "
                   "given."),
               newer(field<L>("sky_turn_deg", &L::sky_turn, angle_deg(between(-3600, 3600)),
                              "Turn of that picture. At 0 its middle is towards z; to 90 it turns "
                              "towards x.")),
           },
       .finish = [](const Json& json, const Path&, L& light, ReadContext&) {
         if (light.sky_file && !json.contains("sun")) light.sun = 0;
       }});
}

Codec<RenderSettings> render_codec() {
  using R = RenderSettings;
  return object<R>(
      {.noun = "the render settings",
       .fields =
           {
               field<R>("size", &R::size,
                        integers<2>(kSmallestSide, kLargestSide, "[width, height]"),
                        "Width and height of a frame, pixels: at most " +
                            std::to_string(kMostPixels) + " in all."),
               field<R>("samples", &R::samples, integer_choice({1, 2, 4, 8}),
                        "Samples a pixel, against jagged edges; for rays see rays/samples."),
               field<R>("analysis", &R::analysis, boolean(),
                        "Colour the bodies of a directed pile by their equilibrium: cyan "
                        "passed, blue filtered, red failed."),
               newer(field<R>(
                   "renderer", &R::renderer,
                   enumeration<Renderer>({{"raster", Renderer::raster}, {"rays", Renderer::rays}}),
                   "raster: fast; rays: slow, with full meshes and indirect light.")),
               newer(field<R>("rays", &R::rays, rays_codec(), "Settings of the renderer rays.")),
               newer(field<R>("light", &R::light, light_codec(), "Sun and sky.")),
               newer(field<R>("exposure", &R::exposure, number(between(-10, 10)),
                              "Exposure in stops: each doubles the brightness of the picture. At 0 "
                              "a surface that faces the usual light has the colour of the scene.")),
           },
       .finish = [](const Json&, const Path& path, R& settings, ReadContext& context) {
         const auto [width, height] = settings.size;
         if (int64_t{width} * height <= kMostPixels) return;
         context.log.report(path / "size",
                            "is " + std::to_string(width) + " x " + std::to_string(height) + ", " +
                                std::to_string(int64_t{width} * height) + " pixels",
                            "at most " + std::to_string(kMostPixels) + " pixels");
       }});
}

Codec<Finish> finish_codec() {
  const Codec<Finish> settings = object<Finish>(
      {.noun = "finish",
       .fields = {
           optional_field<Finish>("longest_s", &Finish::longest_s, number(above(0)),
                                  "Longest simulated time in which bodies come to rest, s. "
                                  "Default: a hundred times sqrt(r / g) of the smallest body."),
           newer(field<Finish>(
               "visible_only", &Finish::visible_only, boolean(),
               "Leave overlaps of bodies that lie too deep in the pile to be seen."))}});
  Codec<Finish> codec;
  codec.expected = "true, false or " + settings.expected;
  codec.schema = {{"oneOf", {boolean().schema, settings.schema}}};
  codec.read = [settings](const Json& json, const Path& path, Finish& finish,
                          ReadContext& context) {
    if (json.is_boolean()) {
      finish.when = json.get<bool>() ? Finishing::always : Finishing::never;
      return;
    }
    settings.read(json, path, finish, context);
    finish.when = Finishing::always;
  };
  codec.write = [settings](const Finish& finish) {
    return finish.when == Finishing::always ? settings.write(finish) : Json(false);
  };
  return codec;
}

// Left out of the resolved scene where the mode decides.
Field<Scene> finish_field() {
  Field<Scene> field = derived_field<Scene>(
      "finish", &Scene::finish, finish_codec(),
      "Take overlaps out of the pile at the end, with the exact engine. true, or an object of "
      "settings: always; false: never. Default: in the statistical and the mixed mode, unless the "
      "pile is directed, the method is the dissertation's, or more than a tenth of the bodies "
      "still move.");
  field.write = [write = field.write](const Scene& scene) {
    return scene.finish.when == Finishing::by_mode ? std::nullopt : write(scene);
  };
  return field;
}

// Left out of the resolved scene where it is the default, which is older than the key.
Field<Scene> until_field() {
  Field<Scene> field = pilesim::field<Scene>(
      "until", &Scene::until,
      enumeration<Until>({{"duration", Until::duration}, {"settled", Until::settled}}),
      "End of the run. duration: after duration_s; settled: once all bodies are at rest, after "
      "duration_s at the latest.");
  field.write = [write = field.write](const Scene& scene) {
    return scene.until == Until::duration ? std::nullopt : write(scene);
  };
  return field;
}

Codec<std::optional<double>> step_codec() {
  const Codec<double> seconds = number(between(1e-6, 1));
  Codec<std::optional<double>> codec;
  codec.expected = "\"auto\" or " + seconds.expected;
  codec.schema = {{"oneOf", {{{"const", "auto"}}, seconds.schema}}};
  codec.read = [seconds, expected = codec.expected](const Json& json, const Path& path,
                                                    std::optional<double>& value,
                                                    ReadContext& context) {
    if (json.is_number()) {
      double number_s = 0;
      seconds.read(json, path, number_s, context);
      value = number_s;
    } else if (json.is_string() && json.get<std::string>() == "auto") {
      value.reset();
    } else {
      context.log.report(path, describe_value(json), expected);
    }
  };
  codec.write = [](const std::optional<double>& value) {
    return value ? Json(*value) : Json("auto");
  };
  return codec;
}

Fields<Scene> setting_fields() {
  return {
      field<Scene>("name", &Scene::name, any_text(), "Name of the scene in reports."),
      field<Scene>("seed", &Scene::seed, unsigned_integer(),
                   "Seed of all random numbers. The same seed gives the same bytes."),
      field<Scene>("duration_s", &Scene::duration_s,
                   number({.minimum = 0, .maximum = 1e6, .excludes_minimum = true}),
                   "Simulated time, s."),
      until_field(),
      field<Scene>("frame_rate", &Scene::frame_rate, number(between(0.001, 100000)),
                   "Frames that are stored and drawn a second."),
      field<Scene>(
          "step_s", &Scene::step_s, step_codec(),
          "Longest time step, s: a frame takes the fewest equal steps within it. \"auto\": the "
          "impulse mode chooses each step from the state, long while the pile rests and short "
          "while bodies that may touch move fast; other modes take 1/240 s, or less "
          "for bodies below 5 mm."),
      field<Scene>("accuracy", &Scene::accuracy, number(between(1e-5, 0.1)),
                   "Penetration at rest that automatic steps and the solver's substeps allow, as a "
                   "share of a body's size; 20 times that at an impact."),
      field<Scene>("gravity", &Scene::gravity, vector3(), "Acceleration of gravity, m/s^2."),
  };
}

Fields<Scene> content_fields() {
  return {
      field<Scene>("materials", &Scene::materials, named(material_codec()), "Materials by name."),
      field<Scene>("shapes", &Scene::shapes, named(shape_codec()), "Shapes by name."),
      field<Scene>("bodies", &Scene::bodies, list(body_codec()), "Single bodies."),
      field<Scene>("emitters", &Scene::emitters, list(emitter_codec()), "Sources of many bodies."),
      newer(field<Scene>("joints", &Scene::joints, list(joint_codec()),
                         "Bodies that are joined to each other or to the world.")),
      newer(field<Scene>("chains", &Scene::chains, list(chain_codec()),
                         "Rows of links that are joined end to end.")),
      field<Scene>("events", &Scene::events, list(event_codec()),
                   "Changes to bodies at given times."),
      field<Scene>("simulator", &Scene::simulator, simulator_codec(),
                   "Settings of the simulation."),
      optional_field<Scene>("guide", &Scene::guide, guide_codec(),
                            "Keeps a pile in a shape, for pilesim direct-pile."),
      field<Scene>("piles", &Scene::piles, list(pile_codec()),
                   "Piles with an angle of repose, for pilesim direct-pile."),
      finish_field(),
      field<Scene>("render", &Scene::render, render_codec(), "Settings of pictures."),
  };
}

// Left out of the resolved scene where there is none: the renderer frames the action then.
Field<Scene> camera_field() {
  Field<Scene> field = derived_field<Scene>("camera", &Scene::camera, camera_codec(),
                                            "A fixed camera, or {\"keys\": [...]} for a moving "
                                            "one. Default: a view of all moving bodies.");
  field.write = [write = field.write](const Scene& scene) {
    return scene.camera.keys.empty() ? std::nullopt : write(scene);
  };
  return field;
}

// Left out where there are none, as in scenes that are older than the key.
Field<Scene> cameras_field() {
  Field<Scene> field = pilesim::field<Scene>("cameras", &Scene::cameras, list(named_camera_codec()),
                                             "Other cameras, for pilesim render --camera.");
  field.write = [write = field.write](const Scene& scene) {
    return scene.cameras.empty() ? std::nullopt : write(scene);
  };
  return field;
}

}  // namespace

const Codec<Scene>& scene_codec() {
  static const Codec<Scene> codec =
      object<Scene>({.noun = "a scene",
                     .fields = document_fields() + setting_fields() + content_fields() +
                               Fields<Scene>{camera_field(), cameras_field()},
                     .finish = [](const Json&, const Path&, Scene& scene, ReadContext&) {
                       // Only here the index of a body is known.
                       for (size_t i = 0; i < scene.bodies.size(); ++i) {
                         std::string& name = scene.bodies[i].name;
                         if (name.empty()) name = "body/" + std::to_string(i);
                       }
                       for (size_t i = 0; i < scene.emitters.size(); ++i) {
                         std::string& name = scene.emitters[i].name;
                         if (name.empty()) name = "emitter/" + std::to_string(i);
                       }
                       for (size_t i = 0; i < scene.chains.size(); ++i) {
                         std::string& name = scene.chains[i].name;
                         if (name.empty()) name = "chain/" + std::to_string(i);
                       }
                       apply_focal_lengths(scene);
                       choose_collisions(scene);
                     }});
  return codec;
}

}  // namespace pilesim

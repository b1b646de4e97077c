#include <cmath>

#include "json/object_codec.h"
#include "scene/scene_format.h"

namespace pilesim {

namespace {

// Left out of the resolved scene where it is the default, which is older than the key.
template <class T>
Field<T> if_changed(Field<T> field) {
  field.write = [write = field.write, initial = field.default_value(T{})](const T& object) {
    std::optional<Json> json = write(object);
    return json == initial ? std::nullopt : json;
  };
  return field;
}

Codec<double> view_angle() {
  return angle_deg(
      {.minimum = 0, .maximum = 180, .excludes_minimum = true, .excludes_maximum = true});
}

// The view angle, by the field of view or by the lens.
Fields<CameraKey> lens_fields() {
  using K = CameraKey;
  Field<K> view = field<K>("field_of_view_deg", &K::field_of_view, view_angle(),
                           "Vertical field of view, degrees.");
  view.write = [write = view.write](const K& key) {
    return key.focal_length_mm ? std::nullopt : write(key);
  };
  return {
      in_group("lens", view),
      in_group("lens", optional_field<K>("focal_length_mm", &K::focal_length_mm, number(above(0)),
                                         "Focal length of the lens, mm.")),
      if_changed(field<K>("sensor_width_mm", &K::sensor_width_mm, number(above(0)),
                          "Width of the sensor, which is as wide as the picture, mm.")),
      if_changed(field<K>("lens_shift", &K::lens_shift,
                          two_numbers(between(-10, 10), "[right, up]"),
                          "Distance of the picture from the optical axis, to the right and "
                          "upwards, in widths of the picture.")),
  };
}

Codec<CameraKey> key_codec() {
  using K = CameraKey;
  return object<K>(
      {.noun = "a camera key",
       .fields =
           Fields<K>{
               field<K>("time_s", &K::time_s, number(at_least(0)), "Time of a moving camera, s."),
               required_field<K>("position", &K::position, vector3(), "Position of the camera, m."),
               required_field<K>("target", &K::target, vector3(),
                                 "Point that the camera looks at, m."),
           } +
           lens_fields() +
           Fields<K>{if_changed(field<K>(
               "roll_deg", &K::roll, angle_deg(between(-3600, 3600)),
               "Roll about the optical axis, clockwise as seen from behind the camera."))}});
}

Field<Camera> keys_field() {
  return required_field<Camera>(
      "keys", &Camera::keys, list(key_codec(), 1),
      "Views at ascending times; the camera moves smoothly between them.");
}

// One key, as the path of a camera that stands.
Codec<Camera> view_codec() {
  const Codec<CameraKey> key = key_codec();
  Codec<Camera> codec;
  codec.expected = key.expected;
  codec.schema = key.schema;
  codec.read = [key](const Json& json, const Path& path, Camera& camera, ReadContext& context) {
    key.read(json, path, camera.keys.emplace_back(), context);
  };
  codec.write = [key](const Camera& camera) { return key.write(camera.keys.front()); };
  return codec;
}

// Several keys, as the path.
Codec<Camera> keys_codec() {
  const Field<Camera> keys = keys_field();
  Codec<Camera> codec;
  codec.expected = keys.key.expected;
  codec.schema = keys.schema;
  codec.read = keys.read;
  codec.write = [keys](const Camera& camera) { return *keys.write(camera); };
  return codec;
}

Codec<CameraOrbit> orbit_codec() {
  using O = CameraOrbit;
  return object<O>(
      {.noun = "an orbit",
       .fields =
           {
               optional_field<O>("target", &O::target, vector3(),
                                 "Point that the camera looks at, m. Default: the middle of the "
                                 "moving bodies in the last frame."),
               required_field<O>("distance_m", &O::distance_m, number(above(0)),
                                 "Distance from the target, m."),
               field<O>("elevation_deg", &O::elevation,
                        angle_deg({.minimum = -90,
                                   .maximum = 90,
                                   .excludes_minimum = true,
                                   .excludes_maximum = true}),
                        "Height above the target, degrees."),
               field<O>("azimuth_deg", &O::azimuth, angle_deg(between(-3600, 3600)),
                        "Direction at the start: 0 is towards z, 90 towards x."),
               required_field<O>("period_s", &O::period_s, number(),
                                 "Time of a turn, s; negative: clockwise as seen from above."),
           },
       .finish = [](const Json&, const Path& path, O& orbit, ReadContext& context) {
         if (orbit.period_s != 0) return;
         context.log.report(path / "period_s", "is 0", "a number other than 0");
       }});
}

Codec<RandomViews> random_views_codec() {
  using V = RandomViews;
  return object<V>(
      {.noun = "random views",
       .fields = {
           required_field<V>("count", &V::count, integer(1, 1000), "Number of views."),
           optional_field<V>("target", &V::target, vector3(),
                             "Point that the cameras look at, m. Default: the middle of the moving "
                             "bodies in the last frame."),
           required_field<V>("distance_m", &V::distance_m, two_numbers(above(0), "[least, most]"),
                             "Distance from the target, m."),
           field<V>("elevation_deg", &V::elevation,
                    two_numbers(between(-90, 90), "[least, most]", degrees(1)),
                    "Height above the target, degrees."),
       }});
}

}  // namespace

Codec<std::array<double, 2>> two_numbers(Range range, const std::string& meaning, double scale) {
  const Codec<double> element = number(range);
  Codec<std::array<double, 2>> codec;
  codec.expected = "an array " + meaning + " of two numbers";
  codec.schema = {{"type", "array"}, {"items", element.schema}, {"minItems", 2}, {"maxItems", 2}};
  codec.read = [element, scale, expected = codec.expected](const Json& json, const Path& path,
                                                           std::array<double, 2>& values,
                                                           ReadContext& context) {
    if (!json.is_array() || json.size() != 2) {
      context.log.report(path, describe_value(json), expected);
      return;
    }
    for (size_t i = 0; i < 2; ++i) {
      double value = scale * values[i];
      element.read(json[i], path / i, value, context);
      values[i] = value / scale;
    }
  };
  codec.write = [scale](const std::array<double, 2>& values) {
    return Json{scale * values[0], scale * values[1]};
  };
  return codec;
}

Codec<Camera> camera_codec() {
  const Codec<Camera> view = view_codec();
  const Codec<Camera> keyed = object<Camera>({.noun = "a moving camera", .fields = {keys_field()}});
  Codec<Camera> codec;
  codec.expected = view.expected;
  codec.schema = {{"oneOf", Json::array({view.schema, keyed.schema})}};
  codec.read = [view, keyed](const Json& json, const Path& path, Camera& camera,
                             ReadContext& context) {
    const bool is_keyed = json.is_object() && json.contains("keys");
    (is_keyed ? keyed : view).read(json, path, camera, context);
  };
  codec.write = keyed.write;
  return codec;
}

Codec<NamedCamera> named_camera_codec() {
  using C = NamedCamera;
  const auto place = [](Field<C> field) {
    field.key.is_required = true;
    return in_group("place", std::move(field));
  };
  return object<C>(
      {.noun = "a camera of several",
       .fields = {
           required_field<C>("name", &C::name, text(), "Name for --camera."),
           place(input_only(optional_field<C>("view", &C::path, view_codec(), "A fixed camera."))),
           place(optional_field<C>(
               "keys", &C::path, keys_codec(),
               "Views at ascending times; the camera moves smoothly between them.")),
           place(optional_field<C>("orbit", &C::orbit, orbit_codec(),
                                   "A camera that circles a point.")),
           place(optional_field<C>(
               "random_views", &C::random_views, random_views_codec(),
               "Fixed cameras, drawn by the scene's seed from a part of a hemisphere.")),
           if_changed(field<C>("field_of_view_deg", &C::field_of_view, view_angle(),
                               "Vertical field of view of an orbit and of random views, "
                               "degrees.")),
       }});
}

void apply_focal_lengths(Scene& scene) {
  const int width = scene.render.size[0], height = scene.render.size[1];
  const auto apply = [&](Camera& camera) {
    for (CameraKey& key : camera.keys) {
      if (!key.focal_length_mm) continue;
      const double sensor_height_mm = key.sensor_width_mm * height / width;
      key.field_of_view = 2 * std::atan(sensor_height_mm / (2 * *key.focal_length_mm));
    }
  };
  apply(scene.camera);
  for (NamedCamera& camera : scene.cameras) {
    if (camera.path) apply(*camera.path);
  }
}

}  // namespace pilesim

#include "model/model.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>
#include <utility>

#include "core/error.h"
#include "core/parallel_for.h"
#include "core/rotation.h"
#include "core/text.h"
#include "geometry/cache_file.h"
#include "geometry/inside_test.h"
#include "json/codec.h"
#include "model/clear_starts.h"
#include "model/emitters.h"
#include "model/model_shapes.h"
#include "model/rooms.h"
#include "scene/scene_format.h"

namespace pilesim {

namespace {

// Muted, well apart in hue and near in lightness, so that neighbours in a pile tell apart.
constexpr std::array<Colour, 8> kPalette = {{{214, 107, 78},
                                             {232, 176, 84},
                                             {128, 164, 103},
                                             {84, 151, 158},
                                             {93, 122, 173},
                                             {151, 114, 163},
                                             {205, 134, 146},
                                             {224, 206, 170}}};
constexpr Colour kFixedColour = {176, 172, 165};
constexpr Colour kGroundColour = {232, 230, 226};  // of planes

// The problems of several shapes and emitters, thrown together at the end.
class ProblemCollector {
 public:
  template <class Work>
  void attempt(const Work& work) {
    try {
      work();
    } catch (const Error& error) {
      if (error.kind() != ErrorKind::input && error.kind() != ErrorKind::io) throw;
      if (problems_.empty()) kind_ = error.kind();
      for (const Problem& problem : error.problems()) {
        // A faulty part is met again in every compound that has it.
        const bool is_known = std::any_of(
            problems_.begin(), problems_.end(),
            [&](const Problem& known) { return to_string(known) == to_string(problem); });
        if (!is_known) problems_.push_back(problem);
      }
    }
  }
  void throw_if_any() {
    if (!problems_.empty()) throw Error(kind_, std::move(problems_));
  }

 private:
  ErrorKind kind_ = ErrorKind::input;
  std::vector<Problem> problems_;
};

// The volume that only one of the two encloses, as a share of the solid's. It counts the middles of
// cells, kCells along the longest side, and errs by about a tenth of a per cent.
double volume_error(const TriangleMesh& mesh, const TriangleMesh& solid) {
  constexpr double kCells = 64;
  Bounds bounds = mesh.bounds();
  bounds.extend(solid.bounds());
  const double cell = bounds.sizes().maxCoeff() / kCells;
  const Vec3 counts = (bounds.sizes() / cell).array().ceil().max(1);
  const InsideTest in_mesh(mesh), in_solid(solid);
  std::vector<double> other(static_cast<size_t>(counts.x())), all(other.size());
  parallel_for(other.size(), 1, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) {
      for (double j = 0.5; j < counts.y(); ++j) {
        for (double k = 0.5; k < counts.z(); ++k) {
          const Vec3 point = bounds.min() + cell * Vec3(static_cast<double>(i) + 0.5, j, k);
          // Surfaces that face inward enclose, too.
          const bool in = std::abs(in_mesh.winding_number(point)) > 0.5;
          const bool is_solid = in_solid.contains(point);
          other[i] += in != is_solid ? 1 : 0;
          all[i] += is_solid ? 1 : 0;
        }
      }
    }
  });
  return std::reduce(other.begin(), other.end()) /
         std::max(1.0, std::reduce(all.begin(), all.end()));
}

class ModelBuilder {
 public:
  explicit ModelBuilder(const Scene& scene) : scene_(scene) {}

  Model build() {
    for (const auto& [name, material] : scene_.materials) {
      material_index_[name] = static_cast<uint32_t>(model_.materials.size());
      model_.materials.push_back(material);
    }
    build_shapes();
    for (size_t i = 0; i < scene_.emitters.size(); ++i) {
      problems_.attempt([&] { check_volume(scene_.emitters[i], i); });
    }
    problems_.throw_if_any();
    load_guide();
    for (const Body& body : scene_.bodies) add_body(body);
    for (size_t i = 0; i < scene_.emitters.size(); ++i) {
      problems_.attempt([&] { add_emitter(scene_.emitters[i], i); });
    }
    for (size_t i = 0; i < scene_.chains.size(); ++i) {
      problems_.attempt([&] { add_chain(scene_.chains[i], i); });
    }
    for (const Joint& joint : scene_.joints) add_joint(joint);
    std::ranges::sort(model_.kept_apart);
    problems_.throw_if_any();
    check_moving_shapes();
    problems_.throw_if_any();
    clear_starts(scene_, rows_, model_);
    open_rooms(model_);
    check_guide_size();
    for (size_t i = 0; i < scene_.events.size(); ++i) {
      problems_.attempt([&] { add_event(scene_.events[i], i); });
    }
    const std::vector<PairRule>& rules = scene_.simulator.detail.pairs;
    for (size_t i = 0; i < rules.size(); ++i) {
      problems_.attempt([&] { add_pair_rule(rules[i], i); });
    }
    problems_.throw_if_any();
    return std::move(model_);
  }

 private:
  void build_shapes() {
    for (const auto& [name, shape] : scene_.shapes) {
      shape_index_[name] = static_cast<uint32_t>(model_.shapes.size());
      problems_.attempt([&, &name = name] {
        model_.shapes.push_back(build_shape(scene_, name, meshes_));
        count_triangles(model_.shapes.back());
      });
    }
  }

  // Those of a shape that is there, or is to be.
  void count_triangles(const ModelShape& shape) {
    triangles_ += triangles_of(shape);
    if (triangles_ > kMostTriangles) throw too_many_triangles(shape_pointer(shape.source));
  }

  // That bodies which move have masses that numbers can hold.
  void check_moving_shapes() {
    std::vector<uint8_t> moves(model_.shapes.size(), 0);
    for (const ModelBody& body : model_.bodies) {
      if (body.role == Role::dynamic) moves[body.shape] = 1;
    }
    for (size_t i = 0; i < model_.shapes.size(); ++i) {
      if (moves[i] != 0) problems_.attempt([&] { check_moving(model_.shapes[i]); });
    }
  }

  static void check_moving(const ModelShape& shape) {
    // The sides of the box that is as heavy to turn.
    const Vec3 moments = principal_inertia(shape.mass.inertia_m5).moments / shape.mass.volume_m3;
    const Vec3 sides = (6 * (moments.sum() - 2 * moments.array())).max(0).sqrt();
    const double longest = sides.maxCoeff(), shortest = sides.minCoeff();
    // Room for the rounding of sizes at a bound.
    constexpr double kSpare = 0.5;
    if (longest * kSpare <= kLargestMoving && shortest >= kSpare * kSmallestLength &&
        shortest >= kSpare * kThinnestMoving * longest) {
      return;
    }
    const auto metres = [](double length) { return with_digits(length, 3) + " m"; };
    throw Error(ErrorKind::input,
                Problem{.pointer = shape_pointer(shape.source),
                        .found = "is as heavy to turn as a box with sides from " +
                                 metres(shortest) + " to " + metres(longest),
                        .expected = "of a body that moves, sides from " + metres(kSmallestLength) +
                                    " to " + metres(kLargestMoving) + ", the shortest at least " +
                                    with_digits(kThinnestMoving, 3) + " of the longest",
                        .remedy = "Scale it, or make it thicker"});
  }

  // That the mesh of a volume has an inside.
  void check_volume(const Emitter& emitter, size_t index) {
    const auto* volume = std::get_if<VolumeSource>(&emitter.source);
    if (volume != nullptr) inside_of(volume->file, volume->scale, emitter_pointer(index));
  }

  // The solid of the mesh of `file`, which has no "solid" or "thickness_m" to set.
  const Solid& inside_of(const std::filesystem::path& file, double scale,
                         const std::string& pointer) {
    try {
      return meshes_.load_solid(file, scale);
    } catch (const Error& error) {
      std::vector<Problem> problems = in_file(error, file.string()).problems();
      if (error.kind() == ErrorKind::input && !problems.back().remedy.empty()) {
        problems.back().remedy = "Close its surface: its inside is not clear";
      }
      throw at_pointer(Error(error.kind(), std::move(problems)), pointer);
    }
  }

  // The solid of the mesh of a shape, in the shape's own frame.
  Solid inside_of_shape(const std::string& name) {
    ModelShape shape = build_shape(scene_, name, meshes_);
    count_triangles(shape);
    for (Vec3& vertex : shape.mesh.vertices) vertex += shape.origin_offset;
    shape.mesh.groups.clear();
    const auto* mesh = std::get_if<MeshShape>(&scene_.shapes.at(name));
    try {
      return make_solid(shape.mesh, mesh != nullptr ? solid_options(*mesh) : SolidOptions(),
                        user_cache_directory());
    } catch (const Error& error) {
      throw at_pointer(error, kGuidePointer);
    }
  }

  void load_guide() {
    const std::optional<Guide>& guide = scene_.guide;
    if (!guide || guide->is_everywhere()) return;
    const Solid solid = guide->file ? inside_of(*guide->file, guide->scale, kGuidePointer)
                                    : inside_of_shape(*guide->shape);
    model_.guide = solid.mesh;
    for (Vec3& vertex : model_.guide.vertices) vertex = guide->pose.apply(vertex);
    const Vec3 size = model_.guide.bounds().sizes();
    model_.guide_report = "guide: " + with_digits(size.x(), 3) + " x " + with_digits(size.y(), 3) +
                          " x " + with_digits(size.z(), 3) + " m, " +
                          with_digits(mass_properties(model_.guide).volume_m3, 3) + " m3";
    if (solid.way == SolidWay::as_it_is) return;
    const TriangleMesh given = guide->file ? meshes_.load(*guide->file, guide->scale)
                                           : build_shape(scene_, *guide->shape, meshes_).mesh;
    model_.guide_report += "; solid: " + solid.note + ", volume error " +
                           with_digits(100 * volume_error(given, solid.mesh), 2) + " %";
  }

  // That it can hold something.
  void check_guide_size() {
    if (model_.guide.triangles.empty()) return;
    double largest = 0;
    for (const ModelBody& body : model_.bodies) {
      if (body.role != Role::dynamic) continue;
      largest = std::max(largest, model_.shapes[body.shape].bounding_radius);
    }
    const double size = model_.guide.bounds().sizes().maxCoeff();
    if (size >= 2 * largest) return;
    throw Error(ErrorKind::input,
                Problem{.file = scene_.guide->file_name(),
                        .pointer = kGuidePointer,
                        .found = "is smaller than a body: " + std::to_string(size) + " m against " +
                                 std::to_string(2 * largest) + " m",
                        .expected = "a mesh that holds bodies",
                        .remedy = "Check its unit; \"scale\" is metres per unit"});
  }

  static constexpr const char* kGuidePointer = "/guide";
  static std::string emitter_pointer(size_t index) { return "/emitters/" + std::to_string(index); }

  static Error at_pointer(const Error& error, const std::string& pointer) {
    std::vector<Problem> problems = error.problems();
    for (Problem& problem : problems) problem.pointer = pointer;
    return {error.kind(), std::move(problems)};
  }

  // Palette, mass and index of a body whose shape, material and role are set.
  void append(ModelBody body, const std::optional<Colour>& colour) {
    const ModelShape& shape = model_.shapes[body.shape];
    const bool is_dynamic = body.role == Role::dynamic;
    const Colour& default_colour = is_dynamic ? kPalette[model_.bodies.size() % kPalette.size()]
                                   : shape.is_plane ? kGroundColour
                                                    : kFixedColour;
    const std::optional<Colour>& asked = colour ? colour : body.look.colour;
    body.is_painted = !asked && !shape.mesh.colours.empty();
    body.colour = body.is_painted ? shape.mean_colour : asked.value_or(default_colour);
    if (is_dynamic) {
      body.mass_kg = shape.mass.volume_m3 * model_.materials[body.material].density_kg_m3;
    }
    model_.bodies.push_back(std::move(body));
  }

  // The pose of the body frame where the shape's own frame is at `pose`.
  static Pose body_frame(const ModelShape& shape, const Pose& pose) {
    return {pose.apply(shape.origin_offset), pose.orientation};
  }

  void add_body(const Body& source) {
    ModelBody body;
    body.name = source.name;
    body.shape = shape_index_.at(source.shape);
    body.material = material_index_.at(source.material);
    const ModelShape& shape = model_.shapes[body.shape];
    body.motion = source.motion;
    if (!body.motion.motors.empty() && body.motion.empty()) {
      body.motion.push_back({.pose = source.pose});
    }
    body.pose = body_frame(shape, source.motion.empty() ? source.pose : source.motion.front().pose);
    body.surface_velocity = source.surface_velocity;
    body.linear_velocity = source.linear_velocity;
    body.angular_velocity = source.angular_velocity;
    body.role = source.role;
    body.held = source.held;
    body.asleep = source.asleep && scene_.simulator.sleeping;
    body.preference = source.preference;
    body.hinge = source.hinge;
    body.look = source.look.value_or(model_.materials[body.material].look);
    append(std::move(body), source.colour);
  }

  // Glue holds bodies that lie as gravity left them; bodies that were turned over lie otherwise,
  // and slump.
  bool fills_as_mould(const Emitter& emitter) const {
    return std::holds_alternative<MouldSource>(emitter.source) ||
           scene_.guide->hold == HoldKind::glue;
  }

  // A guide's emitter may drop as many bodies as there are with the guide's volume: they cannot all
  // fit.
  Emitter with_count(const Emitter& emitter) const {
    Emitter counted = emitter;
    if (!fills_guide(emitter)) return counted;
    if (fills_as_mould(emitter)) counted.rate_hz = 0;  // glue holds the whole, not one by one
    double volume_m3 = 0;
    for (const std::string& name : emitter.shapes) {
      volume_m3 += model_.shapes[shape_index_.at(name)].mass.volume_m3;
    }
    if (emitter.sizes) volume_m3 *= std::pow(emitter.sizes->from, 3);
    const double most = std::floor(mass_properties(model_.guide).volume_m3 / volume_m3 *
                                   static_cast<double>(emitter.shapes.size()));
    const double limit = emitter.count > 0 ? emitter.count : kMostBodies + 1.0;
    counted.count = static_cast<int>(std::min(most, limit));
    return counted;
  }

  void add_emitter(const Emitter& source, size_t index) {
    const Emitter emitter = with_count(source);
    const std::string pointer = emitter_pointer(index);
    double radius = 0;
    for (const std::string& name : emitter.shapes) {
      radius = std::max(radius, model_.shapes[shape_index_.at(name)].bounding_radius);
    }
    if (emitter.sizes) radius *= emitter.sizes->to;
    std::vector<EmittedBody> emitted;
    try {
      const auto* volume = std::get_if<VolumeSource>(&emitter.source);
      const TriangleMesh* mesh =
          volume == nullptr ? nullptr : &meshes_.load_solid(volume->file, volume->scale).mesh;
      emitted = unroll(emitter, index, scene_.seed, radius, mesh);
    } catch (const Error& error) {
      throw at_pointer(error, pointer);
    }
    check_emitted(emitter, pointer, emitted.size());
    first_body_[emitter.name] = {static_cast<uint32_t>(model_.bodies.size()),
                                 static_cast<uint32_t>(emitted.size())};
    rows_.push_back({first_body_[emitter.name].first, first_body_[emitter.name].second,
                     static_cast<uint32_t>(index)});
    if (fills_guide(emitter)) {
      model_.guide_fill = {first_body_[emitter.name].first, first_body_[emitter.name].second,
                           static_cast<uint32_t>(index), fills_as_mould(emitter)};
    }
    if (emitter.until || emitter.end_s) {
      EmitterStop& stop = model_.stops.emplace_back();
      stop.first = first_body_[emitter.name].first;
      stop.count = first_body_[emitter.name].second;
      stop.emitter = emitter.name;
      if (emitter.until) stop.full = Bounds(emitter.until->min, emitter.until->max);
      stop.end_s = emitter.end_s;
    }
    for (size_t i = 0; i < emitted.size(); ++i) {
      const EmittedBody& start = emitted[i];
      ModelBody body;
      body.name = emitter.name + '/' + std::to_string(i);
      body.shape = in_size(shape_index_.at(emitter.shapes[start.shape]), start.size);
      body.material = material_index_.at(
          emitter.materials.empty() ? emitter.material : emitter.materials[start.shape]);
      body.pose = start.pose;
      body.linear_velocity = start.linear_velocity;
      body.angular_velocity = start.angular_velocity;
      body.start_s = start.start_s > 0 ? start.start_s : kFromTheStart;
      body.asleep = emitter.asleep && scene_.simulator.sleeping;
      body.preference = emitter.preference;
      body.look = emitter.look.value_or(model_.materials[body.material].look);
      body.look.roughness = start.roughness.value_or(body.look.roughness);
      body.look.clear_coat = start.clear_coat.value_or(body.look.clear_coat);
      append(std::move(body), start.colour ? start.colour : emitter.colour);
    }
  }

  uint32_t body_called(const std::string& name) const {
    const auto found = std::ranges::find(model_.bodies, name, &ModelBody::name);
    return static_cast<uint32_t>(found - model_.bodies.begin());
  }

  void add_joint(const Joint& source) {
    const uint32_t b = source.b ? body_called(*source.b) : ModelJoint::kWorld;
    join(source, body_called(source.a), b);
  }

  // Joins the bodies a and b, whatever `source` calls them.
  void join(const Joint& source, uint32_t a, uint32_t b) {
    model_.joints.push_back(joint_between(source, model_.bodies, a, b));
    if (b == ModelJoint::kWorld) return;
    // A body that can come loose, or that could fall through a plane, collides unless told not to.
    const bool is_plane = model_.shapes[model_.bodies[b].shape].is_plane;
    const bool collide = source.collide.value_or(is_plane || source.breaking_force_n.has_value());
    if (!collide) model_.kept_apart.push_back(pair_key(a, b));
  }

  void add_chain(const Chain& chain, size_t index) {
    if (model_.bodies.size() + static_cast<size_t>(chain.count) > size_t{kMostBodies}) {
      throw Error(
          ErrorKind::input,
          Problem{.pointer = "/chains/" + std::to_string(index) + "/count",
                  .found = "is " + std::to_string(chain.count),
                  .expected = "at most " + std::to_string(kMostBodies) + " bodies in the scene"});
    }
    const auto first = static_cast<uint32_t>(model_.bodies.size());
    const Vec3 link_m = (chain.to - chain.from) / chain.count;
    const Quat along = rotation_between(Vec3::UnitY(), link_m);
    for (int i = 0; i < chain.count; ++i) {
      Body link;
      link.name = chain.name + '/' + std::to_string(i);
      link.shape = chain.shape;
      link.material = chain.material;
      link.pose = {chain.from + (i + 0.5) * link_m, along};
      link.preference = Preference::must_impulse;
      link.colour = chain.colour;
      add_body(link);
    }
    Joint joint{.point = chain.from, .breaking_force_n = chain.breaking_force_n};
    // Links of a chain that can break do not collide with their neighbours either: they overlap.
    joint.collide = false;
    const auto end_at = [&](const std::optional<std::string>& name, uint32_t link) {
      if (name) join(joint, link, *name == kWorldName ? ModelJoint::kWorld : body_called(*name));
    };
    end_at(chain.start, first);
    for (int i = 1; i < chain.count; ++i) {
      joint.point = chain.from + i * link_m;
      const auto link = first + static_cast<uint32_t>(i);
      join(joint, link, link - 1);
    }
    joint.point = chain.to;
    end_at(chain.end, first + static_cast<uint32_t>(chain.count) - 1);
  }

  // The index of the shape in this size: bodies of one size share one.
  uint32_t in_size(uint32_t shape, double size) {
    if (size == 1) return shape;
    const auto [found, is_new] =
        sized_.try_emplace({shape, size}, static_cast<uint32_t>(model_.shapes.size()));
    if (is_new) {
      count_triangles(model_.shapes[shape]);
      model_.shapes.push_back(resized(ModelShape(model_.shapes[shape]), size));
    }
    return found->second;
  }

  // Checks that need the mesh of a volume or a guide.
  void check_emitted(const Emitter& emitter, const std::string& pointer, size_t count) const {
    if (count == 0) {
      throw Error(ErrorKind::input,
                  Problem{.pointer = pointer,
                          .found = "emits no body: no lattice point or no body fits into the mesh",
                          .expected = "bodies and a spacing that suit the size of the mesh"});
    }
    const auto most = static_cast<size_t>(kMostBodies);
    if (model_.bodies.size() + count > most) {
      // unroll() stops there.
      const std::string emitted =
          count > most ? "more than " + std::to_string(most) : std::to_string(count);
      throw Error(ErrorKind::input,
                  Problem{.pointer = pointer,
                          .found = "\"" + emitter.name + "\" emits " + emitted + " bodies",
                          .expected = "at most " + std::to_string(kMostBodies) + " in the scene"});
    }
  }

  void add_event(const Event& source, size_t index) {
    ModelEvent event{.time_s = source.time_s, .kind = ModelEvent::Kind::release};
    if (const auto* removal = std::get_if<RemoveEvent>(&source.action)) {
      event.kind = ModelEvent::Kind::remove;
      event.highest = static_cast<uint32_t>(removal->highest);
    }
    if (const auto* hit = std::get_if<ImpulseEvent>(&source.action)) {
      event.kind = ModelEvent::Kind::impulse;
      event.impulse = hit->impulse;
      event.point = hit->point;
    }
    const auto& names = std::visit(
        [](const auto& action) -> const auto& { return action.bodies; }, source.action);
    const std::string pointer = "/events/" + std::to_string(index) + "/bodies";
    for (const std::string& name : names) add_targets(name, pointer, event.bodies);
    if (event.kind == ModelEvent::Kind::impulse) check_impulse(event, index);
    model_.events.push_back(std::move(event));
  }

  // That it gives no body a speed that no body may begin with.
  void check_impulse(const ModelEvent& event, size_t index) const {
    for (const uint32_t target : event.bodies) {
      const ModelBody& body = model_.bodies[target];
      const double speed = event.impulse.norm() / body.mass_kg;
      if (speed <= kLargestNumber) continue;
      throw Error(ErrorKind::input,
                  Problem{.pointer = "/events/" + std::to_string(index) + "/impulse",
                          .found = "gives '" + body.name + "', of " + with_digits(body.mass_kg, 3) +
                                   " kg, " + with_digits(speed, 3) + " m/s",
                          .expected = "at most 1e9 m/s"});
    }
  }

  void add_pair_rule(const PairRule& source, size_t index) {
    const std::string pointer = "/simulator/level_of_detail/pairs/" + std::to_string(index);
    ModelPairRule rule{.method = source.method};
    add_targets(source.a, pointer + "/a", rule.a);
    add_targets(source.b, pointer + "/b", rule.b);
    model_.pair_rules.push_back(std::move(rule));
  }

  // Appends the bodies that `name` means: a body, an emitter's, or one of an emitter's.
  void add_targets(const std::string& name, const std::string& pointer,
                   std::vector<uint32_t>& targets) {
    if (const auto emitter = first_body_.find(name); emitter != first_body_.end()) {
      const auto [first, count] = emitter->second;
      for (uint32_t i = 0; i < count; ++i) targets.push_back(first + i);
      return;
    }
    if (body_index_.empty()) {
      for (uint32_t i = 0; i < model_.bodies.size(); ++i) body_index_[model_.bodies[i].name] = i;
    }
    const auto body = body_index_.find(name);
    if (body == body_index_.end()) {
      throw Error(ErrorKind::input,
                  Problem{.pointer = pointer,
                          .found = "names \"" + name + "\", which its emitter does not reach",
                          .expected = "a body that exists"});
    }
    targets.push_back(body->second);
  }

  const Scene& scene_;
  Model model_;
  MeshLibrary meshes_;
  ProblemCollector problems_;
  size_t triangles_ = 0;  // of all shapes
  std::map<std::string, uint32_t> shape_index_, material_index_, body_index_;
  std::map<std::pair<uint32_t, double>, uint32_t> sized_;  // index into shapes
  std::vector<EmittedRow> rows_;
  std::map<std::string, std::pair<uint32_t, uint32_t>> first_body_;  // of an emitter, and how many
};

}  // namespace

double mean_diameter_m(const Model& model) {
  double sum_m = 0;
  uint64_t dynamic = 0;
  for (const ModelBody& body : model.bodies) {
    if (body.role != Role::dynamic) continue;
    ++dynamic;
    sum_m += 2 * model.shapes[body.shape].bounding_radius;
  }
  return dynamic > 0 ? sum_m / static_cast<double>(dynamic) : 0;
}

double least_radius_m(const Model& model) {
  double least_m = std::numeric_limits<double>::infinity();
  for (const ModelBody& body : model.bodies) {
    if (body.role != Role::dynamic) continue;
    least_m = std::min(least_m, model.shapes[body.shape].bounding_radius);
  }
  return least_m;
}

void choose_fixed_step(Scene& scene, const Model& model) {
  const double gravity = scene.gravity.norm();
  if (scene.step_s || scene.simulator.mode == SimulatorMode::impulse || gravity == 0) return;
  // In sqrt(r / g): with longer ones a body at rest falls, in a step, as fast as bodies collide
  // (sphere_constants.h).
  constexpr double kLongestStep = 0.25;
  const double longest_s = kLongestStep * std::sqrt(least_radius_m(model) / gravity);
  if (longest_s < Scene::kFixedStep) scene.step_s = longest_s;
}

ModelJoint joint_between(const Joint& source, std::span<const ModelBody> bodies, uint32_t a,
                         uint32_t b) {
  const Pose pose_a = bodies[a].pose;
  const Pose pose_b = b == ModelJoint::kWorld ? Pose{} : bodies[b].pose;
  const Quat to_a = pose_a.orientation.conjugate(), to_b = pose_b.orientation.conjugate();
  const Vec3 axis = source.axis.value_or(Vec3::UnitY());  // only hinges ask
  return {.kind = source.kind,
          .a = a,
          .b = b,
          .point_a = to_a * (source.point - pose_a.position),
          .point_b = to_b * (source.point - pose_b.position),
          .axis_a = to_a * axis,
          .axis_b = to_b * axis,
          .attitude = to_a * pose_b.orientation,
          .limits = source.limits,
          .motor = source.motor,
          .breaking_force_n = source.breaking_force_n};
}

SurfaceVelocity world_surface_velocity(const Model& model, uint32_t body, const Quat& orientation) {
  const SurfaceVelocity& own = *model.bodies[body].surface_velocity;
  const Vec3& centre = model.shapes[model.bodies[body].shape].origin_offset;
  return {orientation * (own.linear + own.angular.cross(centre)), orientation * own.angular};
}

Model build_model(const Scene& scene) { return ModelBuilder(scene).build(); }

}  // namespace pilesim

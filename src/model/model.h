// Input of simulators: the scene with geometry loaded, mass computed and emitters unrolled into a
// flat list of bodies. Const during a simulation.
#pragma once

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/round_surface.h"
#include "geometry/mass_properties.h"
#include "geometry/mesh.h"
#include "geometry/round_sector.h"
#include "geometry/sphere_fit.h"
#include "scene/scene.h"

namespace pilesim {

struct Signature;

// One convex piece of a collision shape, in the body frame (origin at the centre of mass).
struct CollisionPiece {
  enum class Kind { hull, box, sphere, round } kind;
  Pose pose;                 // of the primitive in the body frame; identity for a hull
  Vec3 size = Vec3::Zero();  // box: full edges; sphere: (r, r, r); m
  TriangleMesh hull;         // for hulls only
  RoundSector round = {};    // for round ones only
};

// A shape ready for use. Everything is in the body frame: origin at the centre of mass, axes of the
// mesh file, turned where its z is up. A plane has no pieces, no mass and no mesh.
struct ModelShape {
  std::string name;
  std::string source;  // of the scene's shapes; `name` is another where an emitter has sizes
  double size = 1;     // times that one
  bool is_plane = false;
  TriangleMesh mesh;                     // drawn, and collided with where collides_as_mesh
  std::vector<RoundSurface> round;       // what its triangles stand for, where that is round
  Colour mean_colour{};                  // of mesh.colours, where there are any
  std::vector<CollisionPiece> pieces;    // union; empty where collides_as_mesh or is_plane
  bool collides_as_mesh = false;         // concave, static or kinematic only
  bool solid_behind = false;             // of a mesh that need not be closed: behind all triangles
  MassProperties mass;                   // of unit density; centre_of_mass is zero here
  Vec3 origin_offset = Vec3::Zero();     // the centre of mass in the shape's own frame, m
  double bounding_radius = 0;            // about the centre of mass, m
  double smallest_extent = 0;            // of the bounding box, m: scales margins
  std::string mesh_hash;                 // of the mesh as it was imported; empty for primitives
  std::filesystem::path signature_file;  // empty: it is measured
  double file_scale = 1;         // metres per unit of the mesh file; of a stretched one the mean
  UpAxis file_up = UpAxis::y;    // of the mesh file
  std::string collision_report;  // "decomposition: 24 pieces, volume error 3.1 %, ..."
};

inline constexpr double kFromTheStart = -std::numeric_limits<double>::infinity();

struct ModelBody {
  std::string name;                        // "rabbits/17" for the 18th of an emitter
  uint32_t shape = 0;                      // index into shapes
  uint32_t material = 0;                   // index into materials
  Pose pose;                               // of the body frame (centre of mass) at its start
  Vec3 linear_velocity, angular_velocity;  // m/s, rad/s, world frame
  Role role = Role::dynamic;
  bool held = false;
  bool asleep = false;
  Preference preference = Preference::prefer_statistical;
  double start_s = kFromTheStart;  // appears at the first step at or after this
  std::optional<Hinge> hinge;
  Motion motion;  // poses of the shape's own frame; with motors at least one
  std::optional<SurfaceVelocity> surface_velocity;
  Colour colour;
  bool is_painted = false;  // drawn in the colours of its shape's file; `colour` is their mean
  Look look;                // its own, the emitter's or the material's, or drawn for it
  double mass_kg = 0;       // 0 for fixed and kinematic bodies
};

// It never moves.
inline bool stands_still(const ModelBody& body) {
  return body.role == Role::fixed || (body.role == Role::kinematic && body.motion.empty());
}

struct ModelEvent {
  double time_s;
  enum class Kind { release, remove, impulse } kind;
  std::vector<uint32_t> bodies;
  Vec3 impulse = Vec3::Zero();  // N s
  std::optional<Vec3> point;
  uint32_t highest = 0;  // of remove, without bodies: so many that are there, from the top
};

// A joint of the scene, or of a chain.
struct ModelJoint {
  static constexpr uint32_t kWorld = ~uint32_t{0};
  JointKind kind = JointKind::ball;
  uint32_t a = 0, b = kWorld;                   // bodies, a dynamic; b may be the world
  Vec3 point_a, point_b;                        // m, in their frames
  Vec3 axis_a, axis_b;                          // unit, in their frames
  Quat attitude;                                // of b in a's frame, at the start
  std::optional<std::array<double, 2>> limits;  // rad, of a's turn against b
  std::optional<HingeMotor> motor;
  std::optional<double> breaking_force_n;
};

// A rule of the mixed mode for pairs of two sets of bodies.
struct ModelPairRule {
  std::vector<uint32_t> a, b;
  PairMethod method;
};

// A range of Model::bodies.
struct BodyRange {
  uint32_t first = 0, count = 0;
  bool contains(uint32_t body) const { return body - first < count; }
};

// Bodies that are to fill the guide, in the order of their release (start_s is its time). Where
// they lie is not known until fill_guide() (pile/guide/upside_down.h) has been called.
struct GuideFill : BodyRange {
  uint32_t emitter = 0;   // index into Scene::emitters: keys random numbers
  bool is_mould = false;  // not upside down
};

// Bodies of an emitter that stops once a body rests with its centre in `full` (m, world), or at
// `end_s`: those that others have kept waiting until then do not come.
struct EmitterStop : BodyRange {
  std::string emitter;
  std::optional<Bounds> full;
  std::optional<double> end_s;
};

// Two bodies that start inside one another.
struct StartOverlap {
  uint32_t a = 0, b = 0;  // in Model::bodies, a < b
  double depth_m = 0;     // the shortest way that parts them
};

// A shape and a material of it: indices into Model::shapes and Model::materials.
using ObjectKey = std::pair<uint32_t, uint32_t>;

struct Model {
  std::vector<Material> materials;
  std::vector<ModelShape> shapes;
  std::vector<ModelBody> bodies;  // in the order of the file, then emitter by emitter
  std::vector<ModelJoint> joints;
  std::vector<uint64_t> kept_apart;  // pairs that never collide, by pair_key(), ascending
  std::vector<ModelEvent> events;    // ordered by time
  std::vector<ModelPairRule> pair_rules;
  TriangleMesh guide;  // in the world; empty: none
  // Its size, and the repairs of its mesh: "guide: 1 x 2 x 1 m, ..."; empty: none.
  std::string guide_report;
  std::optional<GuideFill> guide_fill;
  std::optional<BodyRange> moulded;          // those that a mould was filled with
  std::vector<StartOverlap> start_overlaps;  // those that are left (model/clear_starts.h)
  bool crowded = false;       // bodies appear in their time, even in others that move
  uint32_t starts_moved = 0;  // bodies drawn again, so as not to start in others
  // Signatures of objects whose shape names no file, where the mode needs it; null: not measured
  // yet.
  std::map<ObjectKey, std::shared_ptr<const Signature>> signatures;
  std::vector<EmitterStop> stops;  // of emitters that stop before all have come
};

// Joins the bodies a and b where they start, whatever `source` calls them; `b` may be
// ModelJoint::kWorld.
ModelJoint joint_between(const Joint& source, std::span<const ModelBody> bodies, uint32_t a,
                         uint32_t b);

inline uint64_t pair_key(uint32_t a, uint32_t b) {
  return uint64_t{std::min(a, b)} << 32 | std::max(a, b);
}
inline bool may_collide(const Model& model, uint32_t a, uint32_t b) {
  return model.kept_apart.empty() || !std::ranges::binary_search(model.kept_apart, pair_key(a, b));
}

// Loads meshes and builds collision shapes (solids and decompositions are cached under the user's
// cache directory). Deterministic in scene.seed. Throws Error(input) naming the mesh file and the
// shape's JSON pointer.
Model build_model(const Scene& scene);

// The surface velocity of a body that has one, when it is turned so: at its centre of mass and
// about it, world axes.
SurfaceVelocity world_surface_velocity(const Model& model, uint32_t body, const Quat& orientation);

// Mean diameter of the dynamic bodies' bounding spheres about the centre of mass, m; 0 without any.
double mean_diameter_m(const Model& model);
// Radius of the smallest of them, m; infinite without any.
double least_radius_m(const Model& model);

// If steps have one length and the scene names none: one that is short for its smallest body, too.
void choose_fixed_step(Scene& scene, const Model& model);

}  // namespace pilesim

#include "render/rays/ray_scene.h"

#include <embree3/rtcore.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "core/error.h"
#include "core/parallel_for.h"
#include "geometry/round_crossings.h"
#include "render/rays/round_geometry.h"

namespace pilesim {
namespace {

// Eight wide on every machine: pilesim itself needs AVX2, and packets of sixteen under AVX-512 do
// not end in Embree 3.13.5. Threads are the caller's.
constexpr const char* kDeviceSettings = "isa=avx2,max_isa=avx2";
constexpr size_t kLanes = 8;
constexpr uint32_t kTimeSteps = 3;  // before, at and after the frame's time
// Numbers of the geometries of a shape.
constexpr uint32_t kTriangles = 0, kRound = 1;

// Owns what Embree counts references of.
template <class Handle, void (*release)(Handle)>
class Owned {
 public:
  explicit Owned(Handle handle = nullptr) : handle_(handle) {}
  ~Owned() {
    if (handle_ != nullptr) release(handle_);
  }
  Owned(Owned&& other) noexcept : handle_(std::exchange(other.handle_, nullptr)) {}
  Owned& operator=(Owned&& other) noexcept {
    std::swap(handle_, other.handle_);
    return *this;
  }
  Handle get() const { return handle_; }
  explicit operator bool() const { return handle_ != nullptr; }

 private:
  Handle handle_;
};
using Device = Owned<RTCDevice, rtcReleaseDevice>;
using TracedScene = Owned<RTCScene, rtcReleaseScene>;
using Geometry = Owned<RTCGeometry, rtcReleaseGeometry>;

struct Placement {
  Vec3f position = Vec3f::Zero();
  Quatf orientation{Quatf::Identity()};
  bool operator==(const Placement& other) const {
    return position == other.position && orientation.coeffs() == other.orientation.coeffs();
  }
};

Placement placement(const RenderScene& scene, const TrajectoryFrame& frame, size_t body) {
  return {scene.place(frame, body), frame.orientation[body]};
}

// The short way round.
Placement between(const Placement& a, const Placement& b, float share) {
  return {a.position + share * (b.position - a.position),
          a.orientation.slerp(share, b.orientation).normalized()};
}

RTCQuaternionDecomposition decomposition(const Placement& place, const Quatf& nearby) {
  RTCQuaternionDecomposition result;
  rtcInitQuaternionDecomposition(&result);
  // Embree turns from one quaternion to the next as they stand.
  const float sign = place.orientation.dot(nearby) < 0 ? -1.0f : 1.0f;
  result.quaternion_r = sign * place.orientation.w();
  result.quaternion_i = sign * place.orientation.x();
  result.quaternion_j = sign * place.orientation.y();
  result.quaternion_k = sign * place.orientation.z();
  result.translation_x = place.position.x();
  result.translation_y = place.position.y();
  result.translation_z = place.position.z();
  return result;
}

// An infinite plane that is seen from its front.
struct TracedPlane {
  uint32_t body;
  Vec3f point, normal;
  Placement frame;
};

// Triangles and round surfaces of a shape, shared with Embree.
struct TracedMesh {
  std::vector<RenderVertex> vertices;
  std::vector<uint32_t> indices;
  TracedScene scene;
};

struct alignas(32) Packet {
  int valid[kLanes];
  RTCRayHit8 rays;

  void set(size_t lane, const Ray& ray) {
    valid[lane] = -1;
    RTCRay8& r = rays.ray;
    r.org_x[lane] = ray.origin.x();
    r.org_y[lane] = ray.origin.y();
    r.org_z[lane] = ray.origin.z();
    r.dir_x[lane] = ray.direction.x();
    r.dir_y[lane] = ray.direction.y();
    r.dir_z[lane] = ray.direction.z();
    r.tnear[lane] = ray.nearest;
    r.tfar[lane] = ray.farthest;
    r.time[lane] = ray.time;
    r.mask[lane] = ~0u;
    r.id[lane] = 0;
    r.flags[lane] = 0;
    rays.hit.geomID[lane] = RTC_INVALID_GEOMETRY_ID;
    rays.hit.instID[0][lane] = RTC_INVALID_GEOMETRY_ID;
  }
  // Lanes without a ray repeat the first one, switched off.
  void fill(std::span<const Ray> some) {
    for (size_t lane = 0; lane < kLanes; ++lane) {
      set(lane, some[lane < some.size() ? lane : 0]);
      if (lane >= some.size()) valid[lane] = 0;
    }
  }
};

RTCIntersectContext context_of(bool coherent) {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags =
      coherent ? RTC_INTERSECT_CONTEXT_FLAG_COHERENT : RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
  return context;
}

void find_blocked(const TracedScene& scene, std::span<const Ray> rays, std::span<uint8_t> result,
                  bool coherent) {
  RTCIntersectContext context = context_of(coherent);
  Packet packet;
  for (size_t first = 0; first < rays.size(); first += kLanes) {
    const auto some = rays.subspan(first, std::min(kLanes, rays.size() - first));
    packet.fill(some);
    rtcOccluded8(packet.valid, scene.get(), &context, &packet.rays.ray);
    for (size_t lane = 0; lane < some.size(); ++lane) {
      result[first + lane] = packet.rays.ray.tfar[lane] < 0 ? 1 : 0;
    }
  }
}

Vec3f at(const std::array<float, 3>& v) { return {v[0], v[1], v[2]}; }

// Colour of a triangle's texture over a spot `width_m` wide.
Vec3f shown(const MipMap& texture, const std::array<const RenderVertex*, 3>& corner,
            const std::array<float, 3>& weight, float width_m) {
  std::array<Eigen::Vector2f, 3> uv;
  Eigen::Vector2f place = Eigen::Vector2f::Zero();
  for (size_t k = 0; k < 3; ++k) {
    uv[k] = {corner[k]->uv[0], corner[k]->uv[1]};
    place += weight[k] * uv[k];
  }
  const Vec3f origin = at(corner[0]->position);
  const float area =
      (at(corner[1]->position) - origin).cross(at(corner[2]->position) - origin).norm();
  const Eigen::Vector2f side = uv[1] - uv[0], other = uv[2] - uv[0];
  const float texels = std::abs(side.x() * other.y() - side.y() * other.x()) *
                       static_cast<float>(texture.full().width) *
                       static_cast<float>(texture.full().height);
  return texture.at(place, area > 0 ? width_m * std::sqrt(texels / area) : 0);
}

}  // namespace

struct RayScene::State {
  const RenderScene& scene;
  Device device;
  std::vector<TracedMesh> meshes;                         // (shape)
  std::vector<Geometry> instances;                        // (body) made when the body first appears
  std::vector<std::array<Placement, kTimeSteps>> placed;  // (body) as Embree has it
  std::vector<uint8_t> steps;                             // (body) 0: not in the scene, 1 or 3
  TracedScene top, alone;
  std::vector<TracedPlane> planes;

  explicit State(const RenderScene& drawn) : scene(drawn), device(rtcNewDevice(kDeviceSettings)) {
    require(static_cast<bool>(device));
    for (size_t shape = 0; shape < scene.meshes.size(); ++shape) add_mesh(shape);
    instances.resize(scene.shape.size());
    placed.resize(scene.shape.size());
    steps.resize(scene.shape.size());
    top = TracedScene(rtcNewScene(device.get()));
    // LOW builds the top level slower than MEDIUM.
    rtcSetSceneBuildQuality(top.get(), RTC_BUILD_QUALITY_MEDIUM);
  }

  void require(bool good) const {
    const RTCError error = rtcGetDeviceError(device.get());
    if (good && error == RTC_ERROR_NONE) return;
    throw Error(
        ErrorKind::internal,
        Problem{.found = "Embree failed with its error " + std::to_string(error),
                .remedy = "Draw with --renderer raster, and without passes and annotations"});
  }

  void add_mesh(size_t shape) {
    TracedMesh& mesh = meshes.emplace_back();
    const RenderMesh& source = scene.meshes[shape];
    if (scene.is_plane[shape] != 0) return;
    const bool has_triangles = source.levels.front().index_count > 0;
    if (!has_triangles && source.round.empty()) return;
    mesh.scene = TracedScene(rtcNewScene(device.get()));
    rtcSetSceneFlags(mesh.scene.get(), RTC_SCENE_FLAG_ROBUST);
    rtcSetSceneBuildQuality(mesh.scene.get(), RTC_BUILD_QUALITY_HIGH);
    if (has_triangles) add_triangles(source, mesh);
    if (!source.round.empty()) add_round(source, mesh);
    on_one_thread([&] { rtcJoinCommitScene(mesh.scene.get()); });
    require(true);
  }

  void add_triangles(const RenderMesh& source, TracedMesh& mesh) {
    const MeshLevel& full = source.levels.front();
    const auto first = source.indices.begin() + full.first_index;
    mesh.indices.assign(first, first + full.index_count);
    const uint32_t last = *std::max_element(mesh.indices.begin(), mesh.indices.end());
    const auto vertex = source.vertices.begin() + full.first_vertex;
    mesh.vertices.assign(vertex, vertex + last + 1);

    const Geometry geometry(rtcNewGeometry(device.get(), RTC_GEOMETRY_TYPE_TRIANGLE));
    rtcSetSharedGeometryBuffer(geometry.get(), RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                               mesh.vertices.data(), offsetof(RenderVertex, position),
                               sizeof(RenderVertex), mesh.vertices.size());
    rtcSetSharedGeometryBuffer(geometry.get(), RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                               mesh.indices.data(), 0, 3 * sizeof(uint32_t),
                               mesh.indices.size() / 3);
    rtcCommitGeometry(geometry.get());
    rtcAttachGeometryByID(mesh.scene.get(), geometry.get(), kTriangles);
  }

  void add_round(const RenderMesh& source, TracedMesh& mesh) {
    const Geometry geometry(new_round_geometry(device.get(), source.round));
    rtcAttachGeometryByID(mesh.scene.get(), geometry.get(), kRound);
  }

  void remove(uint32_t body) {
    if (steps[body] == 0) return;
    rtcDisableGeometry(instances[body].get());
    rtcCommitGeometry(instances[body].get());
    steps[body] = 0;
  }

  void put(uint32_t body, const std::array<Placement, kTimeSteps>& places) {
    const bool moves = places[0] != places[1] || places[1] != places[2];
    const uint8_t count = moves ? kTimeSteps : 1;
    if (steps[body] == count && placed[body] == places) return;
    Geometry& instance = instances[body];
    if (!instance) {
      instance = Geometry(rtcNewGeometry(device.get(), RTC_GEOMETRY_TYPE_INSTANCE));
      rtcSetGeometryInstancedScene(instance.get(), meshes[scene.shape[body]].scene.get());
      rtcAttachGeometryByID(top.get(), instance.get(), body);
    } else if (steps[body] == 0) {
      rtcEnableGeometry(instance.get());
    }
    rtcSetGeometryTimeStepCount(instance.get(), count);
    for (uint32_t step = 0; step < count; ++step) {
      const auto value = decomposition(moves ? places[step] : places[1], places[1].orientation);
      if (moves) {
        rtcSetGeometryTransformQuaternion(instance.get(), step, &value);
        continue;
      }
      Eigen::Matrix<float, 3, 4> matrix;
      matrix << places[1].orientation.toRotationMatrix(), places[1].position;
      rtcSetGeometryTransform(instance.get(), 0, RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR, matrix.data());
    }
    rtcCommitGeometry(instance.get());
    placed[body] = places;
    steps[body] = count;
  }

  Placement now(uint32_t body, float time) const {
    const auto& places = placed[body];
    if (steps[body] < kTimeSteps) return places[1];
    return time < 0.5f ? between(places[0], places[1], 2 * time)
                       : between(places[1], places[2], 2 * time - 1);
  }

  const TracedPlane& plane(uint32_t body) const {
    return *std::ranges::find(planes, body, &TracedPlane::body);
  }

  RaySurface on_round(const Ray& ray, const RayHit& hit, RaySurface result, float rounding) const;

  // Planes are no part of Embree's scene, which has to end somewhere.
  void meet_planes(const Ray& ray, RayHit& hit) const {
    for (const TracedPlane& plane : planes) {
      const float falling = plane.normal.dot(ray.direction);
      if (falling >= 0) continue;
      const float height = plane.normal.dot(ray.origin - plane.point);
      const float distance = height > 0 ? -height / falling : std::numeric_limits<float>::min();
      if (height <= -ray.below || distance <= ray.nearest || distance >= hit.distance) continue;
      hit = {.distance = distance, .body = plane.body};
    }
  }
};

// Exact as it is, it needs nothing that keeps the edges of triangles from showing.
RaySurface RayScene::State::on_round(const Ray& ray, const RayHit& hit, RaySurface result,
                                     float rounding) const {
  const RenderMesh& mesh = scene.meshes[scene.shape[hit.body]];
  const Placement body = now(hit.body, ray.time);
  const Quatf from_world = body.orientation.conjugate();
  const Vec3f place = from_world * (result.position - body.position);
  const Vec3f seen_from = from_world * -ray.direction;
  Vec3f normal = outward_normal(mesh.round[hit.triangle], place.cast<double>()).cast<float>();
  const bool is_inside = normal.dot(seen_from) < 0;
  if (is_inside) normal = -normal;
  result.closed = mesh.closed;
  result.inside = is_inside && result.closed;
  if (!scene.pattern.empty()) {
    result.pattern =
        pattern_factor(scene.pattern[hit.body], place, normal,
                       spot_width(-seen_from.normalized(), normal, ray.spread * hit.distance));
  }
  result.geometric_normal = result.normal = body.orientation * normal;
  result.off_m = rounding + 1e-5f * scene.radius(hit.body);
  result.start = result.position + result.off_m * result.normal;
  return result;
}

RayScene::RayScene(const RenderScene& scene) : state_(std::make_unique<State>(scene)) {}
RayScene::~RayScene() = default;

void RayScene::place(const TrajectoryFrame& frame, const Shutter& shutter) {
  State& s = *state_;
  s.alone = TracedScene();
  s.planes.clear();
  const auto neighbour = [&](const TrajectoryFrame* other, uint32_t body) {
    Placement here = placement(s.scene, frame, body);
    if (!shutter.moves() || other == nullptr || (other->state[body] & kPresent) == 0) return here;
    const Placement there = placement(s.scene, *other, body);
    return there == here ? here : between(here, there, 0.5f * shutter.share);
  };
  for (uint32_t body = 0; body < s.scene.shape.size(); ++body) {
    const uint32_t shape = s.scene.shape[body];
    if (s.scene.is_plane[shape] != 0) {
      if ((frame.state[body] & kPresent) == 0) continue;
      s.planes.push_back({body,
                          s.scene.place(frame, body),
                          frame.orientation[body] * Vec3f(0, 1, 0),
                          {s.scene.anchor(frame, body), frame.orientation[body]}});
    } else if (!s.scene.drawn(frame, body) || !s.meshes[shape].scene) {
      s.remove(body);
    } else {
      s.put(body, {neighbour(shutter.before, body), placement(s.scene, frame, body),
                   neighbour(shutter.after, body)});
    }
  }
  // On one thread: on several the tree depends on their number, and with it which of two surfaces
  // at the same place is met.
  on_one_thread([&] { rtcJoinCommitScene(s.top.get()); });
  s.require(true);
}

void RayScene::closest(std::span<const Ray> rays, std::span<RayHit> hits, bool coherent) const {
  const State& s = *state_;
  RTCIntersectContext context = context_of(coherent);
  Packet packet;
  for (size_t first = 0; first < rays.size(); first += kLanes) {
    const auto some = rays.subspan(first, std::min(kLanes, rays.size() - first));
    packet.fill(some);
    rtcIntersect8(packet.valid, s.top.get(), &context, &packet.rays);
    for (size_t lane = 0; lane < some.size(); ++lane) {
      RayHit& hit = hits[first + lane];
      hit = {};
      const RTCHit8& met = packet.rays.hit;
      if (met.geomID[lane] != RTC_INVALID_GEOMETRY_ID) {
        hit.distance = packet.rays.ray.tfar[lane];
        hit.body = met.instID[0][lane];
        hit.triangle = met.primID[lane];
        hit.is_round = met.geomID[lane] == kRound;
        hit.u = met.u[lane];
        hit.v = met.v[lane];
      }
      s.meet_planes(some[lane], hit);
    }
  }
}

void RayScene::blocked(std::span<const Ray> rays, std::span<uint8_t> result, bool coherent) const {
  find_blocked(state_->top, rays, result, coherent);
}

void RayScene::single_out(uint32_t body) {
  State& s = *state_;
  s.alone = TracedScene();
  if (s.steps[body] == 0) return;
  s.alone = TracedScene(rtcNewScene(s.device.get()));
  // Its one box is met whenever the body is.
  rtcSetSceneFlags(s.alone.get(), RTC_SCENE_FLAG_ROBUST);
  rtcAttachGeometry(s.alone.get(), s.instances[body].get());
  on_one_thread([&] { rtcJoinCommitScene(s.alone.get()); });
  s.require(true);
}

void RayScene::meets(std::span<const Ray> rays, std::span<uint8_t> result) const {
  if (state_->alone) {
    find_blocked(state_->alone, rays, result, true);
  } else {
    std::fill(result.begin(), result.end(), uint8_t{0});
  }
}

RaySurface RayScene::surface(const Ray& ray, const RayHit& hit) const {
  const State& s = *state_;
  RaySurface result;
  result.position = ray.origin + hit.distance * ray.direction;
  // Rounding of floats at positions of this size.
  const float rounding =
      4e-6f * (result.position.cwiseAbs().maxCoeff() + ray.origin.cwiseAbs().maxCoeff());
  const uint32_t shape = s.scene.shape[hit.body];
  const float across_m = ray.spread * hit.distance;
  if (s.scene.is_plane[shape] != 0) {
    const TracedPlane& plane = s.plane(hit.body);
    result.geometric_normal = result.normal = plane.normal;
    if (!s.scene.pattern.empty()) {
      const Quatf from_world = plane.frame.orientation.conjugate();
      const Vec3f across =
          spot_width(from_world * ray.direction.normalized(), Vec3f::UnitY(), across_m);
      result.pattern = pattern_factor(s.scene.pattern[hit.body],
                                      from_world * (result.position - plane.frame.position),
                                      Vec3f::UnitY(), across);
    }
    result.start = result.position + rounding * result.normal;
    result.off_m = rounding;
    return result;
  }
  if (hit.is_round) return s.on_round(ray, hit, std::move(result), rounding);
  const TracedMesh& mesh = s.meshes[shape];
  std::array<const RenderVertex*, 3> vertex;
  std::array<Vec3f, 3> corner, normal;
  for (size_t k = 0; k < 3; ++k) {
    vertex[k] = &mesh.vertices[mesh.indices[size_t{3} * hit.triangle + k]];
    corner[k] = at(vertex[k]->position);
    normal[k] = at(vertex[k]->normal);
  }
  const std::array<float, 3> weight = {1 - hit.u - hit.v, hit.u, hit.v};
  result.paint = vertex[0]->texture == 0
                     ? albedo_of(vertex[0]->paint)
                     : shown(*s.scene.meshes[shape].textures[vertex[0]->texture - 1], vertex,
                             weight, across_m);
  const Vec3f place = weight[0] * corner[0] + weight[1] * corner[1] + weight[2] * corner[2];
  const Placement body = s.now(hit.body, ray.time);
  const Vec3f seen_from = body.orientation.conjugate() * -ray.direction;
  Vec3f flat = (corner[1] - corner[0]).cross(corner[2] - corner[0]).normalized();
  Vec3f smooth = weight[0] * normal[0] + weight[1] * normal[1] + weight[2] * normal[2];
  const float side = flat.dot(seen_from) < 0 ? -1.0f : 1.0f;
  result.closed = s.scene.meshes[shape].closed;
  result.inside = side < 0 && result.closed;
  flat *= side;
  smooth *= side;
  Vec3f lift = Vec3f::Zero();
  for (size_t k = 0; k < 3; ++k) {
    const Vec3f up = side * normal[k];
    lift -= weight[k] * std::min(0.0f, (place - corner[k]).dot(up)) * up;
  }
  if (!s.scene.pattern.empty()) {
    result.pattern = pattern_factor(s.scene.pattern[hit.body], place, flat,
                                    spot_width(-seen_from.normalized(), flat, across_m));
  }
  const Eigen::Matrix3f rotation = body.orientation.toRotationMatrix();
  result.geometric_normal = rotation * flat;
  // Seen at a glancing angle smooth normals may turn away.
  const float toward = smooth.dot(seen_from);
  if (toward <= 0) smooth -= 1.001f * toward / seen_from.squaredNorm() * seen_from;
  smooth = smooth.squaredNorm() > 1e-12f ? Vec3f(smooth.normalized()) : flat;
  result.normal = rotation * smooth;
  if (s.steps[hit.body] < kTimeSteps) result.position = body.position + rotation * place;
  result.off_m = rounding + 1e-5f * s.scene.radius(hit.body);
  result.start = result.position + rotation * (lift + result.off_m * flat);
  return result;
}

uint32_t RayScene::plane_before(const Ray& ray) const {
  RayHit hit;
  state_->meet_planes(ray, hit);
  return hit.body;
}

Vec3f RayScene::plane_normal(uint32_t body) const { return state_->plane(body).normal; }

}  // namespace pilesim

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "batch/plan.h"
#include "batch/record.h"
#include "batch/steps.h"
#include "core/hash.h"
#include "core/printable.h"
#include "core/utf8.h"
#include "geometry/decomposition_cache.h"
#include "geometry/height_field.h"
#include "geometry/mesh_bounds.h"
#include "geometry/mesh_import.h"
#include "geometry/primitives.h"
#include "geometry/solid_cache.h"
#include "job/simulation_checkpoint.h"
#include "json/cbor.h"
#include "pile/guide/guided_simulator.h"
#include "pile/repose/repose_director.h"
#include "render/forces_overlay.h"
#include "render/guide_overlay.h"
#include "render/pile_overlay.h"
#include "render/sky_file.h"
#include "scene/scene_loader.h"
#include "signature/measured_collisions.h"
#include "signature/response_model.h"
#include "signature/signature_document.h"
#include "signature/signature_file.h"
#include "signature/signature_summary.h"
#include "simulate/modes/make_simulator.h"
#include "target_support.h"
#include "targets.h"

namespace pilesim::fuzz {
namespace {

void scene(std::string_view bytes) {
  accept_errors([&] {
    const LoadedScene loaded = parse_scene(std::string(bytes), "scene.json", {});
    try {
      parse_scene(loaded.resolved, "scene.json", {});
    } catch (const Error&) {
      std::abort();  // the scene stored in a trajectory must be valid
    }
  });
}

// As a value of --set.
void override_value(std::string_view bytes) {
  accept_errors([&] {
    const std::vector<std::string> overrides = {"/gravity=" + std::string(bytes)};
    parse_scene("{\"version\": 1}", "scene.json", overrides);
  });
}

template <int kFormat>
void mesh(std::string_view bytes) {
  constexpr std::array kExtensions = {"obj", "ply", "stl", "gltf", "glb", "fbx", "dae", "off"};
  accept_errors([&] {
    const std::string name = std::string("mesh.") + kExtensions[kFormat];
    const TriangleMesh read = import_mesh(file_of(name, bytes));
    for (const Triangle& triangle : read.triangles) {
      if (std::ranges::max(triangle) >= read.vertices.size()) std::abort();
    }
  });
}

void use(const Signature& signature) {
  summary_text(signature);
  const ResponseModel model(signature);
  Vector6 mean;
  SpreadFactor factor;
  for (const float at : {-10.0F, 0.0F, 0.7F, 100.0F})
    model.evaluate({at, at, at, at}, mean, factor);
  collision_height(signature.heights, static_cast<float>(signature.body.gyration_m), Vec3f::UnitY(),
                   Vec3f(0.3F, -1, 0), Vec3f(1, 2, 3));
}

// As it is, and as a document without its checksum.
void signature(std::string_view bytes) {
  const fs::path file = file_of("any.sig", bytes);
  accept_errors([&] { use(read_signature(file)); });
  constexpr size_t kSealBytes = 17;
  const std::string_view document =
      bytes.substr(0, bytes.size() > kSealBytes ? bytes.size() - kSealBytes : bytes.size());
  accept_errors([&] {
    try {
      use(signature_of(parse_cbor(document)));
    } catch (const nlohmann::json::exception&) {
      // read_signature() turns it into an Error
    }
  });
}

void partial_signature(std::string_view bytes) {
  accept_errors([&] { read_partial_sampling(file_of("any.sig.partial", bytes)); });
}

// Tables as well: their input is finite, their results may not be.
void collisions(std::string_view bytes) {
  static const ResponseTable empty = make_table(TableLayout::scale_free, 0.1);
  accept_errors([&] {
    const CollisionFile read = read_collisions(file_of("drops.csv", bytes));
    for (const PlaneCollision& collision : read.collisions) {
      if (!(collision.velocity_before.dot(collision.normal) < 0)) std::abort();
    }
    const ResponseTable table = table_of(read.collisions, {}, 0.1, empty, 2);
    for (const float mean : table.mean) {
      if (!std::isfinite(mean)) std::abort();
    }
  });
}

void piles(std::string_view bytes) {
  accept_errors([&] { PileOverlay overlay(file_of("piles.json", bytes)); });
}

void guide(std::string_view bytes) {
  accept_errors([&] { GuideOverlay overlay(file_of("guide.json", bytes)); });
  accept_errors([&] { ForcesOverlay overlay(file_of("guide.json", bytes)); });
}

// With the correct digest, without which every input would fail.
template <typename Cache>
void cached(std::string_view bytes) {
  static const TriangleMesh box = box_mesh({1, 1, 1});
  const Cache cache(scratch() / "cache", box, {});
  fs::create_directories(cache.file().parent_path());
  const std::string content(bytes);
  write_file_atomically(cache.file(), content_hash(content) + content);
  cache.load();
}

void height_field(std::string_view bytes) {
  accept_errors([&] {
    const TriangleMesh read = height_field_mesh(file_of("field.png", bytes), 1, 1, 0, 1);
    for (const Vec3& vertex : read.vertices) {
      if (!(vertex.cwiseAbs().maxCoeff() <= 1)) std::abort();
    }
  });
}

void sky(std::string_view bytes) {
  accept_errors([&] {
    const SkyImage read = read_sky(file_of("sky.hdr", bytes));
    for (const Vec3f& pixel : read.pixels) {
      if (!(pixel.minCoeff() >= 0 && pixel.maxCoeff() < 1e10f)) std::abort();
    }
  });
}

// A plan beside a scene, its first and last job, and the output paths of their steps.
void batch_plan(std::string_view bytes) {
  static const fs::path scene = file_of("scene.json", R"({"version": 1})");
  accept_errors([&] {
    const BatchPlan plan = load_batch_plan(file_of("a.plan.json", bytes));
    for (const uint64_t index : {uint64_t{0}, plan.jobs() - 1}) {
      const BatchJob job = batch_job(plan, index);
      for (size_t step = 0; step < plan.steps.size(); ++step) {
        const auto words = step_words(plan, job, step, 1, 1);
        accept_errors([&] { require_inside(words, plan.steps[step], scratch() / ""); });
      }
    }
  });
}

// The checks before a mesh reader is called. The first byte selects the format.
void mesh_bounds(std::string_view bytes) {
  constexpr std::array kNames = {"a.obj", "a.stl", "a.ply", "a.OBJ"};
  if (bytes.empty()) return;
  fault_of_faces(kNames[static_cast<uint8_t>(bytes[0]) % kNames.size()], bytes.substr(1));
}

// As printed, and as a body's name.
void names(std::string_view bytes) {
  const std::string shown = printable(bytes);
  const auto is_control = [](unsigned char c) { return c < 0x20 || c == 0x7F; };
  if (!is_utf8(shown) || std::ranges::any_of(shown, is_control)) std::abort();
  if (printable(shown) != shown) std::abort();
  constexpr size_t kShort = 20, kDots = 3;
  if (shortened(shown, kShort).size() > kShort + kDots) std::abort();
  if (shell_word(bytes).empty()) std::abort();
  if (!is_utf8(bytes)) return;
  accept_errors([&] {
    const Json body = {{"name", std::string(bytes)}, {"shape", "s"}, {"material", "m"}};
    const Json document = {{"version", 1},
                           {"materials", {{"m", Json::object()}}},
                           {"shapes", {{"s", {{"type", "sphere"}, {"radius", 1}}}}},
                           {"bodies", Json::array({body})}};
    build_model(parse_scene(document.dump(), "scene.json", {}).scene);
  });
}

// As a file, and as a line of a shard.
void job_record(std::string_view bytes) {
  accept_errors([&] { read_job_record(file_of("job.json", bytes)); });
  accept_errors([&] { record_line(parse_record(std::string(bytes), "shard.jsonl")); });
}

// A scene of a few bodies without other files, and its checkpoint after some frames.
class SmallRun {
 public:
  explicit SmallRun(const std::vector<std::string>& overrides)
      : scene_(parse_scene(R"({
          "version": 1, "duration_s": 1, "frame_rate": 30, "step_s": 0.0166,
          "materials": {"wood": {"restitution": 0, "friction": 0.6, "density_kg_m3": 700}},
          "shapes": {"ground": {"type": "plane"}, "ball": {"type": "sphere", "radius": 0.1},
                     "box": {"type": "box", "size": [0.2, 0.2, 0.2]}},
          "bodies": [{"shape": "ground", "material": "wood", "role": "static"},
                     {"shape": "ball", "material": "wood", "position": [-1, 0.2, 0],
                      "linear_velocity": [3, 0, 0]}],
          "emitters": [{"name": "tower", "type": "grid", "shape": "box", "material": "wood",
                        "rotation_deg": [0, 0, 0], "centre": [0, 0.4, 0], "count": [2, 2, 1],
                        "spacing": [0.3, 0.2, 0.2]}],
          "events": [{"type": "remove", "time_s": 0.5, "bodies": ["tower/1"]}]})",
                           "scene.json", overrides)
                   .scene),
        model_(build_model(scene_)) {
    const auto [director, simulator] = begin();
    for (int frame = 0; frame < 8; ++frame) simulator->step_frame();
    const RunProgress progress{.rows = std::vector<FrameRow>(2), .inspections = {{}}};
    write_run_checkpoint(scratch() / "", {}, "scene.json", progress, *simulator);
    const Checkpoint written(scratch() / kCheckpointFile);
    state_.assign(written.state().begin(), written.state().end());
  }

  const std::vector<std::byte>& state() const { return state_; }

  // Continues from the present checkpoint.
  void resume() const {
    const RunCheckpoint checkpoint(scratch() / "");
    if (checkpoint.is_done()) return;
    const auto [director, simulator] = begin();
    checkpoint.load(*simulator);
    simulator->statistics();
    StateWriter writer;
    simulator->save(writer);
  }

 private:
  struct Running {
    std::unique_ptr<ReposeDirector> director;
    std::unique_ptr<Simulator> simulator;
  };
  Running begin() const {
    if (scene_.guide) return {nullptr, std::make_unique<GuidedSimulator>(scene_, model_)};
    if (scene_.piles.empty()) return {nullptr, make_simulator(scene_, model_)};
    auto director = std::make_unique<ReposeDirector>(scene_, model_);
    auto simulator = make_directed_simulator(scene_, model_, *director);
    return {std::move(director), std::move(simulator)};
  }

  Scene scene_;
  Model model_;
  std::vector<std::byte> state_;
};

// As a file, and as changes to a valid one with a corrected checksum. The first byte selects the
// run. Each three bytes give a position (two bytes) and its new value; the value 0 cuts off the
// rest.
void checkpoint(std::string_view bytes) {
  static const std::vector<std::unique_ptr<SmallRun>> runs = [] {
    const std::string mode = "/simulator/mode=";
    const std::vector<std::vector<std::string>> overrides = {
        {},
        {mode + "particle"},
        {mode + "mixed",
         "/simulator/level_of_detail={\"levels\": [{\"near_near\": \"impulse\", \"near_far\": "
         "\"particle\", \"far_far\": \"particle\"}]}"},
        {"/guide={}"},
        {"/guide={\"hold\": \"nail\"}"},
        {"/piles=[{\"angle_deg\": 35}]"}};
    std::vector<std::unique_ptr<SmallRun>> made;
    for (const auto& each : overrides) made.push_back(std::make_unique<SmallRun>(each));
    return made;
  }();
  if (bytes.empty()) return;
  const SmallRun& run = *runs[static_cast<uint8_t>(bytes[0]) % runs.size()];
  const fs::path file = file_of(kCheckpointFile, bytes);
  accept_errors([&] { run.resume(); });
  std::vector<std::byte> state = run.state();
  for (size_t i = 1; i + 2 < bytes.size() && !state.empty(); i += 3) {
    const size_t at =
        (static_cast<uint8_t>(bytes[i]) | static_cast<uint8_t>(bytes[i + 1]) << 8) * state.size() >>
        16;
    const auto change = static_cast<std::byte>(bytes[i + 2]);
    state[at] ^= change;
    if (change == std::byte{0}) state.resize(at);
  }
  write_checkpoint(file, {}, state);
  accept_errors([&] { run.resume(); });
}

}  // namespace

std::span<const Target> program_targets() {
  static constexpr std::array kTargets = {Target{"scene", scene},
                                          Target{"override_value", override_value},
                                          Target{"mesh_obj", mesh<0>},
                                          Target{"mesh_ply", mesh<1>},
                                          Target{"mesh_stl", mesh<2>},
                                          Target{"mesh_gltf", mesh<3>},
                                          Target{"mesh_glb", mesh<4>},
                                          Target{"mesh_fbx", mesh<5>},
                                          Target{"mesh_dae", mesh<6>},
                                          Target{"mesh_off", mesh<7>},
                                          Target{"signature", signature},
                                          Target{"partial_signature", partial_signature},
                                          Target{"collisions", collisions},
                                          Target{"piles", piles},
                                          Target{"guide", guide},
                                          Target{"decomposition", cached<DecompositionCache>},
                                          Target{"solid", cached<SolidCache>},
                                          Target{"height_field", height_field},
                                          Target{"sky", sky},
                                          Target{"batch_plan", batch_plan},
                                          Target{"mesh_bounds", mesh_bounds},
                                          Target{"names", names},
                                          Target{"job_record", job_record},
                                          Target{"checkpoint", checkpoint}};
  return kTargets;
}

}  // namespace pilesim::fuzz

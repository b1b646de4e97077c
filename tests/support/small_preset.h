// A preset reduced to a few seconds of one processor: fewer bodies, less time. One rule serves all,
// so that a new preset needs nothing here. Its results are overrides of the scene, as for --set.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <vector>

namespace pilesim::test {

using PresetJson = nlohmann::ordered_json;

// The size that the rule gives a preset.
struct PresetSize {
  size_t bodies = 24;        // of all emitters together, and as many bodies of the scene
  double simulated_s = 1;    // of half the run
  size_t spheres = 1600;     // replaces `bodies` if all are spheres: enough for several threads
  int most_pieces = 4;       // of a decomposition
  bool as_hulls = false;     // for meshes that are slow to wrap
  size_t fewest_frames = 4;  // of half the run
};

struct SmallPreset {
  std::vector<std::string> overrides;
  size_t half = 0;  // of the frames
  bool is_directed = false;
};

// `count` of a grid: decrements its largest dimension until there are few enough.
inline std::array<size_t, 3> fewer(std::array<size_t, 3> count, size_t most) {
  while (count[0] * count[1] * count[2] > most) --*std::ranges::max_element(count);
  return count;
}

class PresetShrinker {
 public:
  PresetShrinker(const std::filesystem::path& file, const PresetSize& size)
      : scene_(PresetJson::parse(std::ifstream(file), nullptr, true, /*ignore_comments=*/true)),
        size_(size) {
    const std::string mode = scene_.value("/simulator/mode"_json_pointer, "impulse");
    most_ = mode == "statistical" || mode == "particle" ? size.spheres : size.bodies;
    const double rate = scene_.value("frame_rate", 60.0);
    preset_.half =
        std::max(size.fewest_frames, static_cast<size_t>(std::ceil(size.simulated_s * rate)));
    const double whole_s = 2 * static_cast<double>(preset_.half) / rate;
    faster_ = std::max(1.0, scene_.value("duration_s", 5.0) / whole_s);
    preset_.is_directed = scene_.contains("guide") || scene_.contains("piles");
    set("/duration_s", whole_s);
    drop_bodies();
    drop_joints();
    shrink_emitters();
    hasten_events();
    coarsen_shapes();
  }

  SmallPreset result() const { return preset_; }

 private:
  void set(const std::string& pointer, const PresetJson& value) {
    preset_.overrides.push_back(pointer + "=" + value.dump());
  }

  // Keeps the first ones, and all that do not move freely.
  void drop_bodies() {
    PresetJson kept = PresetJson::array();
    size_t dynamic = 0;
    for (PresetJson body : list("bodies")) {
      if (body.value("role", "dynamic") == "dynamic" && ++dynamic > size_.bodies) {
        gone_.insert(body.value("name", ""));
        continue;
      }
      for (PresetJson& key : body["motion"]) hasten(key["time_s"]);
      if (body["motion"].is_null()) body.erase("motion");
      kept.push_back(std::move(body));
    }
    set("/bodies", kept);
  }

  // Those of bodies that are gone.
  void drop_joints() {
    PresetJson joints = list("joints");
    std::erase_if(joints.get_ref<PresetJson::array_t&>(), [&](const PresetJson& joint) {
      return gone_.contains(joint.value("a", "")) || gone_.contains(joint.value("b", ""));
    });
    if (scene_.contains("joints")) set("/joints", joints);
  }

  // Each keeps its share of the total time.
  void shrink_emitters() {
    const PresetJson emitters = list("emitters");
    const size_t most = std::max<size_t>(2, most_ / std::max<size_t>(1, emitters.size()));
    for (size_t i = 0; i < emitters.size(); ++i) {
      const PresetJson& emitter = emitters[i];
      const std::string at = "/emitters/" + std::to_string(i);
      double before = 0, after = 0;
      if (emitter["type"] == "grid") {
        const auto count = emitter["count"].get<std::array<size_t, 3>>();
        const auto less = fewer(count, most);
        set(at + "/count", less);
        before = static_cast<double>(count[0] * count[1] * count[2]);
        after = static_cast<double>(less[0] * less[1] * less[2]);
      } else {
        const size_t count = emitter.value("count", size_t{0});  // 0: as many as fit
        const size_t less = count == 0 ? most : std::min(count, most);
        set(at + "/count", less);
        before = static_cast<double>(count == 0 ? less : count);
        after = static_cast<double>(less);
      }
      for (size_t body = static_cast<size_t>(after); body < static_cast<size_t>(before); ++body) {
        gone_.insert(emitter.value("name", "") + "/" + std::to_string(body));
      }
      if (const double rate = emitter.value("rate_hz", 0.0); rate > 0) {
        set(at + "/rate_hz", rate * after / before * faster_);
      }
      for (const char* key : {"start_s", "end_s"}) {
        if (emitter.contains(key)) set(at + '/' + key, hastened(emitter[key]));
      }
      PresetJson motion = emitter.value("motion", PresetJson::array());
      for (PresetJson& key : motion) hasten(key["time_s"]);
      if (!motion.empty()) set(at + "/motion", motion);
    }
  }

  void hasten_events() {
    PresetJson events = list("events");
    for (PresetJson& event : events) {
      hasten(event["time_s"]);
      if (event.contains("highest")) continue;
      PresetJson kept = PresetJson::array();
      for (const PresetJson& name : event["bodies"]) {
        if (!gone_.contains(name.get<std::string>())) kept.push_back(name);
      }
      event["bodies"] = kept;
    }
    std::erase_if(events.get_ref<PresetJson::array_t&>(), [](const PresetJson& event) {
      return event.contains("bodies") && event["bodies"].empty();
    });
    set("/events", events);
  }

  void coarsen_shapes() {
    for (const auto& [name, shape] : scene_["shapes"].items()) {
      if (shape.value("collision", "hull") == "decomposition") {
        if (size_.as_hulls) {
          set("/shapes/" + name + "/collision", "hull");
          set("/shapes/" + name + "/solid", "hull");
        } else {
          set("/shapes/" + name + "/decomposition_max_pieces", size_.most_pieces);
        }
      }
    }
  }

  PresetJson list(const char* name) const { return scene_.value(name, PresetJson::array()); }
  double hastened(const PresetJson& time_s) const { return time_s.get<double>() / faster_; }
  void hasten(PresetJson& time_s) const { time_s = hastened(time_s); }

  PresetJson scene_;
  PresetSize size_;
  size_t most_ = 0;             // bodies of all emitters
  double faster_ = 1;           // by this factor
  std::set<std::string> gone_;  // names of bodies
  SmallPreset preset_;
};

}  // namespace pilesim::test

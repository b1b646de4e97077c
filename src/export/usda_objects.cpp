#include <algorithm>

#include "export/export_text.h"
#include "export/usda_bodies.h"
#include "export/usda_text.h"

namespace pilesim {
namespace {

// The part of `track` in these frames, with a key at the first one.
ExportTrack part_of(const ExportTrack& track, const FrameSpan& span) {
  ExportTrack part;
  for (size_t i = 0; i < track.key.size() && track.key[i] <= span.last; ++i) {
    // Up to the next key it rests, or moves linearly to its neighbour.
    const bool is_before = track.key[i] <= span.first;
    if (is_before && i > 0) part = {};
    part.key.push_back(is_before ? static_cast<uint32_t>(span.first) : track.key[i]);
    part.position.push_back(track.position[i]);
    part.orientation.push_back(track.orientation[i]);
  }
  for (const uint32_t toggle : track.toggles) {
    if (toggle > span.first && toggle <= span.last) part.toggles.push_back(toggle);
  }
  return part;
}

bool is_present_at(const ExportBody& body, const ExportTrack& track, size_t frame) {
  const auto passed = std::ranges::count_if(track.toggles, [&](uint32_t t) { return t <= frame; });
  return (passed % 2 == 0) == body.starts_present;
}

class UsdaObjects : public UsdaBodies {
 public:
  UsdaObjects(ExportSource& source, const UsdaPrims& prims)
      : source_(source), prims_(prims), tracks_(read_tracks(source)) {}

  void count_poses(std::vector<uint64_t>& poses) const override {
    for (const ExportTrack& track : tracks_) {
      if (track.key.size() == 1) continue;
      for (const uint32_t k : track.key) ++poses[k];
    }
  }

  void write(ExportFile& file, bool has_clips) override {
    const std::vector<std::string> names = object_names();
    for (size_t i = 0; i < tracks_.size(); ++i) {
      const ExportBody& body = source_.bodies()[i];
      std::string text =
          "    def Mesh \"" + names[i] + '"' + prims_.mesh_metadata(body.shape, "    ");
      text += "        custom int pilesim:id = " + std::to_string(body.id);
      text += "\n        custom string pilesim:name = " + usda_string(body.name);
      text += "\n        " + prims_.binding(body.shape, body.look);
      const ExportTrack& track = tracks_[i];
      const UsdaPlace place = has_clips ? UsdaPlace::declared : UsdaPlace::scene;
      append_pose(text, source_, track, track.key.size() > 1 ? place : UsdaPlace::scene);
      text += kXformOrder;
      if (body.ever_absent) append_visibility(text, track, body.starts_present, 0, place);
      text += '\n' + prims_.subset_bindings(body.shape, body.look, "        ");
      write_line(file, text + "    }");
    }
  }

  void write_clip(ExportFile& file, const FrameSpan& clip) override {
    write_motion(file, UsdaPlace::clip, clip);
  }
  void write_manifest(ExportFile& file) override {
    write_motion(file, UsdaPlace::declared, {0, source_.frame_count() - 1});
  }

 private:
  // Names of objects, by body.
  std::vector<std::string> object_names() const {
    UsdaNames names;
    names("materials");
    names("camera");
    std::vector<std::string> result;
    for (size_t i = 0; i < tracks_.size(); ++i) result.push_back(names(source_.bodies()[i].name));
    return result;
  }

  // Motion in these frames of bodies that move, appear or vanish.
  void write_motion(ExportFile& file, UsdaPlace place, const FrameSpan& span) {
    const std::vector<std::string> names = object_names();
    for (size_t i = 0; i < tracks_.size(); ++i) {
      const ExportBody& body = source_.bodies()[i];
      const ExportTrack& track = tracks_[i];
      if (body.last_change == 0) continue;
      const ExportTrack part = part_of(track, span);
      std::string text = "    over \"" + names[i] + "\"\n    {";
      if (track.key.size() > 1) append_pose(text, source_, part, place);
      if (body.ever_absent) {
        append_visibility(text, part, is_present_at(body, track, span.first), span.first, place);
      }
      write_line(file, text + "\n    }");
    }
  }

  void append_visibility(std::string& text, const ExportTrack& track, bool present, size_t first,
                         UsdaPlace place) {
    text += "\n        token visibility";
    if (place == UsdaPlace::declared) return;
    const auto word = [&] { return present ? "\"inherited\"" : "\"invisible\""; };
    text += ".timeSamples = {" + time_code(source_, first) + ": " + word();
    for (const uint32_t toggle : track.toggles) {
      present = !present;
      text += ", " + time_code(source_, toggle) + ": " + word();
    }
    text += '}';
  }

  ExportSource& source_;
  const UsdaPrims& prims_;
  std::vector<ExportTrack> tracks_;  // by body
};

}  // namespace

std::unique_ptr<UsdaBodies> usda_objects(ExportSource& source, const UsdaPrims& prims) {
  return std::make_unique<UsdaObjects>(source, prims);
}

}  // namespace pilesim

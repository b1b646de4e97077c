#include <algorithm>
#include <array>
#include <map>

#include "export/export_text.h"
#include "export/unit_halves.h"
#include "export/usda_bodies.h"
#include "export/usda_text.h"

namespace pilesim {
namespace {

// Bodies are sorted into instancers by the quarters of the time in which their motion begins and
// ends, so that frames of rest take no space.
constexpr size_t kShares = 4;

// Rotations are halves in older USD, with slightly more than 4 digits; velocities, in m/s, serve
// motion blur.
constexpr int kDecimalsOfHalf = 5, kDecimalsOfFloat = 7, kDecimalsOfVelocity = 3;

void append_rotation(std::string& text, const std::array<float, 4>& wxyz, int decimals) {
  text += '(';
  for (const float value : wxyz) {
    if (text.back() != '(') text += ", ";
    append_rounded(text, value, decimals);
  }
  text += ')';
}

void append_velocity(std::string& text, const Vec3f& v) {
  text += '(';
  for (const float value : v) {
    if (text.back() != '(') text += ", ";
    append_rounded(text, value, kDecimalsOfVelocity);
  }
  text += ')';
}

// Bodies that change within the same part of the time.
struct Group {
  std::string name;
  std::vector<uint32_t> bodies;  // indices into ExportSource::bodies()
  size_t first = 0, last = 0;    // first and last sample, in frames from 0; equal: at rest
  bool comes_and_goes = false;   // one of its bodies appears or vanishes
};

std::vector<Group> groups_of(const ExportSource& source) {
  const size_t frames = source.frame_count();
  std::map<std::array<size_t, 2>, Group> found;
  for (uint32_t i = 0; i < source.bodies().size(); ++i) {
    const ExportBody& body = source.bodies()[i];
    std::array<size_t, 2> key = {kShares, 0};  // of bodies at rest
    std::string name = "resting";
    if (body.last_change > 0) {
      key = {body.first_change * kShares / frames, body.last_change * kShares / frames};
      name = "moving_" + std::to_string(key[0]) + '_' + std::to_string(key[1]);
    }
    Group& group = found[key];
    if (group.bodies.empty()) group.first = body.first_change;
    group.name = name;
    group.bodies.push_back(i);
    group.first = std::min<size_t>(group.first, body.first_change);
    group.last = std::max<size_t>(group.last, body.last_change);
    group.comes_and_goes |= body.ever_absent;
  }
  std::vector<Group> result;
  for (auto& [key, group] : found) result.push_back(std::move(group));
  return result;
}

class UsdaInstancers : public UsdaBodies {
 public:
  UsdaInstancers(ExportSource& source, const UsdaPrims& prims)
      : source_(source), prims_(prims), groups_(groups_of(source)) {}

  void count_poses(std::vector<uint64_t>& poses) const override {
    for (const Group& group : groups_) {
      if (group.first == group.last) continue;
      for (size_t k = group.first; k <= group.last; ++k) poses[k] += group.bodies.size();
    }
  }
  void write(ExportFile& file, bool has_clips) override {
    for (const Group& group : groups_) write_instancer(file, group, has_clips);
  }
  void write_clip(ExportFile& file, const FrameSpan& clip) override {
    for (const Group& group : groups_) write_group_motion(file, group, clip);
  }
  void write_manifest(ExportFile& file) override {
    for (const Group& group : groups_) declare_group(file, group);
  }

 private:
  void write_instancer(ExportFile& file, const Group& group, bool has_clips) {
    const std::vector<ExportBody>& bodies = source_.bodies();
    const size_t count = group.bodies.size();
    const auto body = [&](size_t i) -> const ExportBody& { return bodies[group.bodies[i]]; };
    // A prototype is a shape with a look.
    std::vector<std::array<uint32_t, 2>> prototypes;
    std::vector<size_t> prototype;
    for (size_t i = 0; i < count; ++i) {
      const std::array key = {body(i).shape, body(i).look};
      if (prototypes.empty() || prototypes.back() != key) prototypes.push_back(key);
      prototype.push_back(prototypes.size() - 1);
    }
    const std::string path = "/pile/" + group.name;
    const auto prototype_name = [&](size_t p) {
      return prims_.mesh[prototypes[p][0]] + "__" + prims_.look[prototypes[p][1]];
    };
    write_line(file, "    def PointInstancer \"" + group.name + "\"\n    {");
    std::string extent = "        float3[] extent = [";
    append_tuple(extent, source_.bounds().min());
    extent += ", ";
    append_tuple(extent, source_.bounds().max());
    write_line(file, extent + ']');
    file.write("        int64[] ids = ");
    write_list(file, count, [&](std::string& text, size_t i) { append_number(text, body(i).id); });
    file.write("\n        custom string[] pilesim:name = ");
    write_list(file, count,
               [&](std::string& text, size_t i) { text += usda_string(body(i).name); });
    file.write("\n        int[] protoIndices = ");
    write_list(file, count,
               [&](std::string& text, size_t i) { append_number(text, prototype[i]); });
    file.write("\n        rel prototypes = [");
    for (size_t p = 0; p < prototypes.size(); ++p) {
      file.write((p > 0 ? ", <" : "<") + path + "/prototypes/" + prototype_name(p) + '>');
    }
    file.write("]\n        float3[] scales = ");
    write_list(file, count, [](std::string& text, size_t) { text += "(1, 1, 1)"; });
    file.write("\n");
    if (!has_clips || group.first == group.last) {
      write_motion(file, group, all_, UsdaPlace::scene);
    } else {
      declare_motion(file, group);
    }
    write_line(file, "\n        def Scope \"prototypes\"\n        {");
    for (size_t p = 0; p < prototypes.size(); ++p) {
      const auto [shape, look] = prototypes[p];
      const std::string indent = "                ";
      file.write("            def Mesh \"" + prototype_name(p) + '"' +
                 prims_.mesh_metadata(shape, "            "));
      write_line(file, indent + prims_.binding(shape, look) + '\n' +
                           prims_.subset_bindings(shape, look, indent) + "            }");
    }
    write_line(file, "        }\n    }");
  }

  static constexpr char kAbsent[] = "        int64[] invisibleIds",
                        kPositions[] = "        point3f[] positions",
                        kOrientations[] = "        quath[] orientations",
                        kFloatOrientations[] = "        quatf[] orientationsf",
                        kVelocities[] = "        vector3f[] velocities";

  void declare_motion(ExportFile& file, const Group& group) {
    if (group.comes_and_goes) write_line(file, kAbsent);
    for (const char* name : {kPositions, kOrientations, kFloatOrientations, kVelocities})
      write_line(file, name);
  }

  void declare_group(ExportFile& file, const Group& group) {
    if (group.first == group.last) return;
    write_line(file, "    over \"" + group.name + "\"\n    {");
    declare_motion(file, group);
    write_line(file, "    }");
  }

  void write_group_motion(ExportFile& file, const Group& group, const FrameSpan& clip) {
    if (group.first == group.last) return;
    write_line(file, "    over \"" + group.name + "\"\n    {");
    write_motion(file, group, clip, UsdaPlace::clip);
    write_line(file, "    }");
  }

  // Samples in `span`: its first frame, and all frames in which the group moves.
  void write_motion(ExportFile& file, const Group& group, const FrameSpan& span, UsdaPlace place) {
    if (group.comes_and_goes) write_absent(file, group, span);
    write_samples(file, group, span, place, kPositions, [&](std::string& text, size_t, size_t i) {
      append_tuple(text, source_.place(poses_, group.bodies[i]));
    });
    write_samples(file, group, span, place, kOrientations,
                  [&](std::string& text, size_t, size_t i) {
                    const Quatf& q = poses_.orientation[group.bodies[i]];
                    append_rotation(text, unit_halves(q), kDecimalsOfHalf);
                  });
    // Readers that support floats prefer them to halves.
    write_samples(file, group, span, place, kFloatOrientations,
                  [&](std::string& text, size_t, size_t i) {
                    const Quatf& q = poses_.orientation[group.bodies[i]];
                    append_rotation(text, {q.w(), q.x(), q.y(), q.z()}, kDecimalsOfFloat);
                  });
    if (group.first == group.last) return;
    // From each sample to the next, so that extrapolation reaches the next one.
    write_samples(
        file, group, span, place, kVelocities, [&](std::string& text, size_t k, size_t i) {
          const uint32_t b = group.bodies[i];
          const bool rests = k < group.first || k >= group.last;
          const Vec3f step =
              rests ? Vec3f::Zero().eval() : (next_.position[b] - poses_.position[b]).cast<float>();
          const double seconds = rests ? 1 : source_.time_s(k + 1) - source_.time_s(k);
          append_velocity(text, step / static_cast<float>(seconds));
        });
  }

  // The first sample is written even if the group moves later: readers extrapolate forwards with a
  // sample's velocities, and backwards with those of the first.
  static std::vector<size_t> sampled(const Group& group, const FrameSpan& span) {
    std::vector<size_t> frames = {span.first};
    for (size_t k = std::max(group.first, span.first + 1); k <= std::min(group.last, span.last);
         ++k) {
      frames.push_back(k);
    }
    return frames;
  }

  // append(text, k, i) writes the value of the i-th body in frame k, from poses_; for kVelocities
  // next_ holds the following frame.
  template <class Append>
  void write_samples(ExportFile& file, const Group& group, const FrameSpan& span, UsdaPlace place,
                     const char* name, const Append& append) {
    file.write(name);
    const bool is_constant = place == UsdaPlace::scene && group.first == group.last;
    const bool looks_ahead = name == kVelocities;
    file.write(is_constant ? " = " : ".timeSamples = {");
    size_t ahead = 0;  // number of the frame in next_; 0: none
    for (const size_t k : sampled(group, span)) {
      if (ahead > 0 && ahead == k) {
        std::swap(poses_, next_);
      } else {
        source_.read(k, poses_);
      }
      if (looks_ahead && k < group.last) source_.read(ahead = k + 1, next_);
      if (!is_constant) file.write("\n            " + time_code(source_, k) + ": ");
      write_list(file, group.bodies.size(),
                 [&](std::string& text, size_t i) { append(text, k, i); });
      file.write(is_constant ? "\n" : ",");
    }
    if (!is_constant) write_line(file, "\n        }");
  }

  // invisibleIds, with a sample wherever they change.
  void write_absent(ExportFile& file, const Group& group, const FrameSpan& span) {
    std::vector<uint32_t> coming_and_going;
    for (const uint32_t b : group.bodies) {
      if (source_.bodies()[b].ever_absent) coming_and_going.push_back(b);
    }
    file.write(kAbsent);
    file.write(".timeSamples = {");
    std::vector<uint32_t> before;
    for (const size_t k : sampled(group, span)) {
      source_.read(k, poses_);
      std::vector<uint32_t> absent;
      for (const uint32_t b : coming_and_going) {
        if ((poses_.state[b] & kPresent) == 0) absent.push_back(source_.bodies()[b].id);
      }
      if (k > span.first && absent == before) continue;
      file.write("\n            " + time_code(source_, k) + ": ");
      write_list(file, absent.size(),
                 [&](std::string& text, size_t i) { append_number(text, absent[i]); });
      file.write(",");
      before = std::move(absent);
    }
    write_line(file, "\n        }");
  }

  ExportSource& source_;
  const UsdaPrims& prims_;
  const FrameSpan all_{0, source_.frame_count() - 1};
  std::vector<Group> groups_;
  TrajectoryFrame poses_, next_;  // scratch
};

}  // namespace

std::unique_ptr<UsdaBodies> usda_instancers(ExportSource& source, const UsdaPrims& prims) {
  return std::make_unique<UsdaInstancers>(source, prims);
}

}  // namespace pilesim

// Layout:
//   /meshes (class)     a Mesh a shape
//   /pile               materials, camera, and
//     few bodies:       a Mesh a body, which refers to that of its shape, with keys where it moves
//     many bodies:      PointInstancers: one of what never moves, others by when their bodies move
// Where what moves takes much space it lies in value clips, files of a part of the time each; a
// manifest names the attributes that are there.
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>
#include <span>

#include "core/parallel_for.h"
#include "export/export_text.h"
#include "export/formats.h"

namespace pilesim {
namespace fs = std::filesystem;

namespace {

// Bodies are sorted into instancers by the quarters of the time in which they begin and cease to
// move, so that frames in which they rest take no space.
constexpr size_t kParts = 4;
constexpr size_t kGrain = 4096;  // bodies that one thread writes at a time

// Readers load a clip when its time comes, as a whole.
constexpr uint64_t kBytesOfClip = uint64_t{1} << 28;
constexpr uint64_t kBytesOfPose = 100;  // as text, with velocity

// Rotations are halves in USD: 4 digits and some; velocities serve motion blur, in m/s.
constexpr int kDecimalsOfRotation = 5, kDecimalsOfVelocity = 3;

std::string quoted(const std::string& text) {
  std::string result = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') result += '\\';
    if (static_cast<unsigned char>(c) < 0x20) {
      result += ' ';
    } else {
      result += c;
    }
  }
  return result + '"';
}

// Names of prims: letters, digits and _, not the same twice.
class PrimNames {
 public:
  std::string operator()(const std::string& name) {
    std::string word;
    for (const char c : name) {
      const bool fits = (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z');
      word += fits ? c : '_';
    }
    if (word.empty() || (word[0] >= '0' && word[0] <= '9')) word = '_' + word;
    std::string result = word;
    for (int i = 2; !taken_.insert(result).second; ++i) result = word + '_' + std::to_string(i);
    return result;
  }

 private:
  std::set<std::string> taken_;
};

void append_tuple(std::string& text, const Vec3f& v) {
  text += '(';
  append_vector(text, v);
  text += ')';
}

void append_rotation(std::string& text, const Quatf& q) {
  text += '(';
  for (const float value : {q.w(), q.x(), q.y(), q.z()}) {
    if (text.back() != '(') text += ", ";
    append_rounded(text, value, kDecimalsOfRotation);
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

// "[a, b, ...]" of `count` values, each of which append(text, i) writes.
template <class Append>
void write_list(ExportFile& file, size_t count, const Append& append) {
  std::vector<std::string> parts((count + kGrain - 1) / kGrain);
  parallel_for(count, kGrain, [&](size_t begin, size_t end) {
    std::string& text = parts[begin / kGrain];
    for (size_t i = begin; i < end; ++i) {
      if (i > 0) text += ", ";
      append(text, i);
    }
  });
  file.write("[");
  for (const std::string& part : parts) file.write(part);
  file.write("]");
}

// Frames, counted from 0, both inclusive.
struct Span {
  size_t first = 0, last = 0;
};

// What `track` is in these frames, with a key in the first one.
ExportTrack part_of(const ExportTrack& track, const Span& span) {
  ExportTrack part;
  for (size_t i = 0; i < track.key.size() && track.key[i] <= span.last; ++i) {
    // Up to the next key it rests, or moves straight to a neighbour.
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

class UsdaWriter {
 public:
  UsdaWriter(ExportSource& source, const ExportJob& job, ExportFiles& files)
      : source_(source), job_(job), files_(files), file_(&files[0]) {
    PrimNames mesh_names, look_names;
    for (const TrajectoryShape& shape : source.header().shapes) {
      mesh_.push_back(mesh_names(shape.name));
    }
    for (const ExportLook& look : source.looks()) look_.push_back(look_names(look.name));
  }

  void write(ExportForm form) {
    if (form == ExportForm::objects) {
      tracks_ = read_tracks(source_);
    } else {
      groups_ = groups();
    }
    choose_clips();
    write_head(all_);
    write_meshes();
    file_->write("\ndef Xform \"pile\" (\n");
    if (!clips_.empty()) write_clips();
    file_->write("    kind = \"assembly\"\n)\n{\n");
    write_looks();
    if (source_.has_camera()) write_camera();
    if (form == ExportForm::objects) {
      write_objects();
    } else {
      for (const Group& group : groups_) write_instancer(group);
    }
    file_->write("}\n");
  }

 private:
  // Of an attribute: what stands in the scene itself, only that it is there, or a clip's part of
  // it.
  enum class Place : uint8_t { scene, declared, clip };

  void line(const std::string& text) { file_->write(text + '\n'); }
  std::string time_code(size_t k) const { return std::to_string(source_.frame(k)); }

  void write_head(const Span& span) {
    std::string rate;
    append_number(rate, source_.header().frame_rate);
    line("#usda 1.0\n(\n    defaultPrim = \"pile\"");
    line("    doc = \"Written by pilesim. Time codes are frames of the trajectory.\"");
    line("    endTimeCode = " + time_code(span.last));
    line("    framesPerSecond = " + rate + "\n    metersPerUnit = 1");
    line("    startTimeCode = " + time_code(span.first));
    line("    timeCodesPerSecond = " + rate + "\n    upAxis = \"Y\"\n)");
  }

  // Where one clip ends the next one begins, in the same frame: clips do not interpolate to each
  // other.
  void choose_clips() {
    std::vector<uint64_t> poses(source_.frame_count());
    for (const ExportTrack& track : tracks_) {
      if (track.key.size() == 1) continue;
      for (const uint32_t k : track.key) ++poses[k];
    }
    for (const Group& group : groups_) {
      if (group.first == group.last) continue;
      for (size_t k = group.first; k <= group.last; ++k) poses[k] += group.bodies.size();
    }
    const uint64_t most = job_.part_bytes.value_or(kBytesOfClip) / kBytesOfPose;
    uint64_t sum = poses[0];
    size_t begin = 0;
    for (size_t k = 1; k < poses.size(); ++k) {
      sum += poses[k];
      if (sum <= most || k == all_.last) continue;
      clips_.push_back({begin, k});
      begin = k;
      sum = poses[k];
    }
    if (!clips_.empty()) clips_.push_back({begin, all_.last});
  }

  ExportFile& add_beside(const std::string& ending) {
    return files_.add(fs::path(job_.output).replace_extension(ending));
  }

  void write_clips() {
    ExportFile* const scene = file_;
    std::string active, paths;
    for (size_t c = 0; c < clips_.size(); ++c) {
      file_ = &add_beside(".clip." + std::to_string(c + 1) + ".usda");
      write_head(clips_[c]);
      write_over([&] {
        for (const Group& group : groups_) write_group_motion(group, clips_[c]);
        write_object_motion(Place::clip, clips_[c]);
      });
      const std::string comma = c > 0 ? ", " : "";
      active += comma + '(' + time_code(clips_[c].first) + ", " + std::to_string(c) + ')';
      paths += comma + asset(*file_);
    }
    file_ = &add_beside(".clips.usda");
    write_head(all_);
    write_over([&] {
      for (const Group& group : groups_) declare_group(group);
      write_object_motion(Place::declared, all_);
    });
    const std::string manifest = asset(*file_);
    file_ = scene;
    line("    clips = {\n        dictionary default = {");
    line("            double2[] active = [" + active + ']');
    line("            asset[] assetPaths = [" + paths + ']');
    line("            asset manifestAssetPath = " + manifest);
    line("            string primPath = \"/pile\"");
    line("            double2[] times = [(" + time_code(0) + ", " + time_code(0) + "), (" +
         time_code(all_.last) + ", " + time_code(all_.last) + ")]\n        }\n    }");
  }

  template <class Write>
  void write_over(const Write& write) {
    line("\nover \"pile\"\n{");
    write();
    line("}");
  }

  static std::string asset(const ExportFile& file) {
    const std::string name = file.path().filename().string();
    const std::string mark = name.find('@') == name.npos ? "@" : "@@@";
    return mark + "./" + name + mark;
  }

  void write_meshes() {
    line("\nclass \"meshes\"\n{");
    std::set<uint32_t> used;
    for (const ExportBody& body : source_.bodies()) used.insert(body.shape);
    for (const uint32_t shape : used) {
      const ExportMesh& mesh = source_.shapes()[shape];
      line("    def Mesh \"" + mesh_[shape] + "\"\n    {");
      Eigen::AlignedBox3f box;
      for (const Vec3f& point : mesh.points) box.extend(point);
      std::string extent = "        float3[] extent = [";
      if (!box.isEmpty()) {
        append_tuple(extent, box.min());
        extent += ", ";
        append_tuple(extent, box.max());
      }
      line(extent + ']');
      file_->write("        int[] faceVertexCounts = ");
      write_list(*file_, mesh.corners.size() / 3, [](std::string& text, size_t) { text += '3'; });
      file_->write("\n        int[] faceVertexIndices = ");
      write_list(*file_, mesh.corners.size(),
                 [&](std::string& text, size_t i) { append_number(text, mesh.corners[i]); });
      file_->write("\n        normal3f[] normals = ");
      write_list(*file_, mesh.split_corners.size(), [&](std::string& text, size_t i) {
        append_tuple(text, mesh.split_normals[mesh.split_corners[i]]);
      });
      file_->write(" (\n            interpolation = \"faceVarying\"\n        )\n");
      file_->write("        point3f[] points = ");
      write_list(*file_, mesh.points.size(),
                 [&](std::string& text, size_t i) { append_tuple(text, mesh.points[i]); });
      if (!mesh.colours.empty()) {
        file_->write("\n        color3f[] primvars:displayColor = ");
        write_list(*file_, mesh.colours.size(),
                   [&](std::string& text, size_t i) { text += linear_tuple(mesh.colours[i]); });
        file_->write(" (\n            interpolation = \"uniform\"\n        )");
      }
      line("\n        uniform token subdivisionScheme = \"none\"\n    }");
    }
    line("}");
  }

  static std::string linear_tuple(const Colour& colour) {
    std::string text = "(";
    for (size_t c = 0; c < 3; ++c) {
      if (c > 0) text += ", ";
      append_rounded(text, static_cast<float>(linear_from_srgb(colour[c])), 6);
    }
    return text + ')';
  }

  void write_looks() {
    line("    def Scope \"materials\"\n    {");
    for (size_t i = 0; i < look_.size(); ++i) {
      const std::string path = "/pile/materials/" + look_[i];
      const ExportLook& look = source_.looks()[i];
      line("        def Material \"" + look_[i] + "\"\n        {");
      line("            token outputs:surface.connect = <" + path + "/surface.outputs:surface>\n");
      line("            def Shader \"surface\"\n            {");
      line("                uniform token info:id = \"UsdPreviewSurface\"");
      if (look.is_painted) {
        line("                color3f inputs:diffuseColor.connect = <" + path +
             "/paint.outputs:result>");
      } else {
        line("                color3f inputs:diffuseColor = " + linear_tuple(look.colour));
      }
      line("                float inputs:roughness = 0.7");
      line("                token outputs:surface\n            }");
      if (look.is_painted) {
        line("\n            def Shader \"paint\"\n            {");
        line("                uniform token info:id = \"UsdPrimvarReader_float3\"");
        line("                string inputs:varname = \"displayColor\"");
        line("                float3 outputs:result\n            }");
      }
      line("        }");
    }
    line("    }");
  }

  void write_camera() {
    // Millimetres, of which only the ratio of focal length and aperture counts.
    constexpr double kApertureHigh = 24;
    const CameraKey first = source_.camera(0);
    std::string text =
        "    def Camera \"camera\"\n    {\n        float2 clippingRange = (0.01, 1000000)";
    const auto focal = [](const CameraKey& key) {
      return static_cast<float>(kApertureHigh / 2 / std::tan(key.field_of_view / 2));
    };
    text += "\n        float focalLength";
    if (!source_.camera_moves()) {
      text += " = ";
      append_number(text, focal(first));
    } else {
      text += ".timeSamples = {";
      for (size_t k = 0; k < source_.frame_count(); ++k) {
        text += (k > 0 ? ", " : "") + time_code(k) + ": ";
        append_number(text, focal(source_.camera(k)));
      }
      text += '}';
    }
    text += "\n        float horizontalAperture = ";
    append_number(text, static_cast<float>(kApertureHigh * job_.aspect));
    text += "\n        float verticalAperture = ";
    append_number(text, static_cast<float>(kApertureHigh));
    const size_t keys = source_.camera_moves() ? source_.frame_count() : 1;
    std::vector<uint32_t> key;
    std::vector<Vec3f> position;
    std::vector<Quatf> orientation;
    for (uint32_t k = 0; k < keys; ++k) {
      const CameraKey at = source_.camera(k);
      key.push_back(k);
      position.push_back(at.position.cast<float>());
      Quatf q = camera_orientation(at).cast<float>();
      if (k > 0 && q.dot(orientation.back()) < 0) q.coeffs() = -q.coeffs();
      orientation.push_back(q);
    }
    append_pose(text, {.key = key, .position = position, .orientation = orientation, .toggles = {}},
                Place::scene);
    line(text + kOrder + "\n    }");
  }

  static constexpr char kOrder[] =
      "\n        uniform token[] xformOpOrder = [\"xformOp:translate\", \"xformOp:orient\"]";

  // Translation and rotation with their keys: in full accuracy, quaternions of floats.
  void append_pose(std::string& text, const ExportTrack& track, Place place) {
    const auto& key = track.key;
    const auto append = [&](const char* name, const auto& append_value) {
      text += std::string("\n        ") + name;
      if (place == Place::declared) return;
      if (key.size() == 1 && place == Place::scene) {
        text += " = ";
        append_value(0);
        return;
      }
      text += ".timeSamples = {";
      for (size_t i = 0; i < key.size(); ++i) {
        text += (i > 0 ? ", " : "") + time_code(key[i]) + ": ";
        append_value(i);
      }
      text += '}';
    };
    append("float3 xformOp:translate", [&](size_t i) { append_tuple(text, track.position[i]); });
    append("quatf xformOp:orient", [&](size_t i) {
      const Quatf& q = track.orientation[i];
      text += '(';
      append_number(text, q.w());
      text += ", ";
      append_vector(text, q.vec());
      text += ')';
    });
  }

  void append_visibility(std::string& text, const ExportTrack& track, bool present, size_t first,
                         Place place) {
    text += "\n        token visibility";
    if (place == Place::declared) return;
    const auto word = [&] { return present ? "\"inherited\"" : "\"invisible\""; };
    text += ".timeSamples = {" + time_code(first) + ": " + word();
    for (const uint32_t toggle : track.toggles) {
      present = !present;
      text += ", " + time_code(toggle) + ": " + word();
    }
    text += '}';
  }

  std::string binding(uint32_t look) const {
    return "rel material:binding = </pile/materials/" + look_[look] + '>';
  }
  // What makes a prim the mesh of a shape.
  std::string mesh_metadata(uint32_t shape, const std::string& indent) const {
    return " (\n" + indent + "    prepend apiSchemas = [\"MaterialBindingAPI\"]\n" + indent +
           "    prepend references = </meshes/" + mesh_[shape] + ">\n" + indent + ")\n" + indent +
           "{\n";
  }

  // Names of objects, by body.
  std::vector<std::string> object_names() const {
    PrimNames names;
    names("materials");
    names("camera");
    std::vector<std::string> result;
    for (size_t i = 0; i < tracks_.size(); ++i) result.push_back(names(source_.bodies()[i].name));
    return result;
  }

  void write_objects() {
    const std::vector<std::string> names = object_names();
    for (size_t i = 0; i < tracks_.size(); ++i) {
      const ExportBody& body = source_.bodies()[i];
      std::string text = "    def Mesh \"" + names[i] + '"' + mesh_metadata(body.shape, "    ");
      text += "        custom int pilesim:id = " + std::to_string(body.id);
      text += "\n        custom string pilesim:name = " + quoted(body.name);
      text += "\n        " + binding(body.look);
      const ExportTrack& track = tracks_[i];
      const Place place = clips_.empty() ? Place::scene : Place::declared;
      append_pose(text, track, track.key.size() > 1 ? place : Place::scene);
      text += kOrder;
      if (body.ever_absent) append_visibility(text, track, body.starts_present, 0, place);
      line(text + "\n    }");
    }
  }

  // Of those that move or come and go, in these frames.
  void write_object_motion(Place place, const Span& span) {
    const std::vector<std::string> names = object_names();
    for (size_t i = 0; i < tracks_.size(); ++i) {
      const ExportBody& body = source_.bodies()[i];
      const ExportTrack& track = tracks_[i];
      if (body.last_change == 0) continue;
      const ExportTrack part = part_of(track, span);
      std::string text = "    over \"" + names[i] + "\"\n    {";
      if (track.key.size() > 1) append_pose(text, part, place);
      if (body.ever_absent) {
        append_visibility(text, part, is_present_at(body, track, span.first), span.first, place);
      }
      line(text + "\n    }");
    }
  }

  // Bodies whose changes lie in the same part of the time.
  struct Group {
    std::string name;
    std::vector<uint32_t> bodies;  // indices into source_.bodies()
    size_t first = 0, last = 0;    // frames from 0: of its samples; the same: it rests
    bool comes_and_goes = false;   // one of its bodies does
  };

  std::vector<Group> groups() const {
    const size_t frames = source_.frame_count();
    std::map<std::array<size_t, 2>, Group> found;
    for (uint32_t i = 0; i < source_.bodies().size(); ++i) {
      const ExportBody& body = source_.bodies()[i];
      std::array<size_t, 2> key = {kParts, 0};  // of what rests
      std::string name = "resting";
      if (body.last_change > 0) {
        key = {body.first_change * kParts / frames, body.last_change * kParts / frames};
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

  void write_instancer(const Group& group) {
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
      return mesh_[prototypes[p][0]] + "__" + look_[prototypes[p][1]];
    };
    line("    def PointInstancer \"" + group.name + "\"\n    {");
    std::string extent = "        float3[] extent = [";
    append_tuple(extent, source_.bounds().min());
    extent += ", ";
    append_tuple(extent, source_.bounds().max());
    line(extent + ']');
    file_->write("        int64[] ids = ");
    write_list(*file_, count,
               [&](std::string& text, size_t i) { append_number(text, body(i).id); });
    file_->write("\n        custom string[] pilesim:name = ");
    write_list(*file_, count, [&](std::string& text, size_t i) { text += quoted(body(i).name); });
    file_->write("\n        int[] protoIndices = ");
    write_list(*file_, count,
               [&](std::string& text, size_t i) { append_number(text, prototype[i]); });
    file_->write("\n        rel prototypes = [");
    for (size_t p = 0; p < prototypes.size(); ++p) {
      file_->write((p > 0 ? ", <" : "<") + path + "/prototypes/" + prototype_name(p) + '>');
    }
    file_->write("]\n        float3[] scales = ");
    write_list(*file_, count, [](std::string& text, size_t) { text += "(1, 1, 1)"; });
    file_->write("\n");
    if (clips_.empty() || group.first == group.last) {
      write_motion(group, all_, Place::scene);
    } else {
      declare_motion(group);
    }
    line("\n        def Scope \"prototypes\"\n        {");
    for (size_t p = 0; p < prototypes.size(); ++p) {
      file_->write("            def Mesh \"" + prototype_name(p) + '"' +
                   mesh_metadata(prototypes[p][0], "            "));
      line("                " + binding(prototypes[p][1]) + "\n            }");
    }
    line("        }\n    }");
  }

  static constexpr char kAbsent[] = "        int64[] invisibleIds",
                        kPositions[] = "        point3f[] positions",
                        kOrientations[] = "        quath[] orientations",
                        kVelocities[] = "        vector3f[] velocities";

  void declare_motion(const Group& group) {
    if (group.comes_and_goes) line(kAbsent);
    for (const char* name : {kPositions, kOrientations, kVelocities}) line(name);
  }

  void declare_group(const Group& group) {
    if (group.first == group.last) return;
    line("    over \"" + group.name + "\"\n    {");
    declare_motion(group);
    line("    }");
  }

  void write_group_motion(const Group& group, const Span& clip) {
    if (group.first == group.last) return;
    line("    over \"" + group.name + "\"\n    {");
    write_motion(group, clip, Place::clip);
    line("    }");
  }

  // Samples in `span`: of its first frame and of all in which the group moves.
  void write_motion(const Group& group, const Span& span, Place place) {
    if (group.comes_and_goes) write_absent(group, span);
    write_samples(group, span, place, kPositions, [&](std::string& text, size_t, size_t i) {
      append_tuple(text, poses_.position[group.bodies[i]]);
    });
    write_samples(group, span, place, kOrientations, [&](std::string& text, size_t, size_t i) {
      append_rotation(text, poses_.orientation[group.bodies[i]]);
    });
    if (group.first == group.last) return;
    // From each sample on to the next one, so that to go on with it meets the next.
    write_samples(group, span, place, kVelocities, [&](std::string& text, size_t k, size_t i) {
      const uint32_t b = group.bodies[i];
      const bool rests = k < group.first || k >= group.last;
      const Vec3f step =
          rests ? Vec3f::Zero().eval() : Vec3f(next_.position[b] - poses_.position[b]);
      const double seconds = rests ? 1 : source_.time_s(k + 1) - source_.time_s(k);
      append_velocity(text, step / static_cast<float>(seconds));
    });
  }

  // The first one is there also where the group moves later: readers go on by a sample's
  // velocities, and back by those of the first.
  static std::vector<size_t> sampled(const Group& group, const Span& span) {
    std::vector<size_t> frames = {span.first};
    for (size_t k = std::max(group.first, span.first + 1); k <= std::min(group.last, span.last);
         ++k) {
      frames.push_back(k);
    }
    return frames;
  }

  // append(text, k, i) writes the value of the i-th body in frame k, of poses_; next_ has the frame
  // after it for kVelocities.
  template <class Append>
  void write_samples(const Group& group, const Span& span, Place place, const char* name,
                     const Append& append) {
    file_->write(name);
    const bool is_constant = place == Place::scene && group.first == group.last;
    const bool looks_ahead = name == kVelocities;
    file_->write(is_constant ? " = " : ".timeSamples = {");
    size_t ahead = 0;  // the frame in next_; 0: none
    for (const size_t k : sampled(group, span)) {
      if (ahead > 0 && ahead == k) {
        std::swap(poses_, next_);
      } else {
        source_.read(k, poses_);
      }
      if (looks_ahead && k < group.last) source_.read(ahead = k + 1, next_);
      if (!is_constant) file_->write("\n            " + time_code(k) + ": ");
      write_list(*file_, group.bodies.size(),
                 [&](std::string& text, size_t i) { append(text, k, i); });
      file_->write(is_constant ? "\n" : ",");
    }
    if (!is_constant) line("\n        }");
  }

  // invisibleIds, a sample wherever they change.
  void write_absent(const Group& group, const Span& span) {
    std::vector<uint32_t> coming_and_going;
    for (const uint32_t b : group.bodies) {
      if (source_.bodies()[b].ever_absent) coming_and_going.push_back(b);
    }
    file_->write(kAbsent);
    file_->write(".timeSamples = {");
    std::vector<uint32_t> before;
    for (const size_t k : sampled(group, span)) {
      source_.read(k, poses_);
      std::vector<uint32_t> absent;
      for (const uint32_t b : coming_and_going) {
        if ((poses_.state[b] & kPresent) == 0) absent.push_back(source_.bodies()[b].id);
      }
      if (k > span.first && absent == before) continue;
      file_->write("\n            " + time_code(k) + ": ");
      write_list(*file_, absent.size(),
                 [&](std::string& text, size_t i) { append_number(text, absent[i]); });
      file_->write(",");
      before = std::move(absent);
    }
    line("\n        }");
  }

  ExportSource& source_;
  const ExportJob& job_;
  ExportFiles& files_;
  ExportFile* file_;  // that is being written
  const Span all_{0, source_.frame_count() - 1};
  std::vector<std::string> mesh_, look_;  // names of prims, by shape and by look
  std::vector<ExportTrack> tracks_;       // of objects, by body
  std::vector<Group> groups_;             // of instances
  std::vector<Span> clips_;               // none: all motion is in the scene itself
  TrajectoryFrame poses_, next_;          // scratch
};

}  // namespace

void write_usda(ExportSource& source, const ExportJob& job, ExportForm form, ExportFiles& files) {
  UsdaWriter(source, job, files).write(form);
}

}  // namespace pilesim

// Layout:
//   /meshes (class)     a Mesh a shape
//   /pile               materials, camera, and
//     few bodies:       a Mesh a body, which refers to that of its shape, with keys where it moves
//     many bodies:      PointInstancers: one of what never moves, others by when their bodies move
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
namespace {

// Bodies are sorted into instancers by the quarters of the time in which they begin and cease to
// move, so that frames in which they rest take no space.
constexpr size_t kParts = 4;
constexpr size_t kGrain = 4096;  // bodies that one thread writes at a time

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

class UsdaWriter {
 public:
  UsdaWriter(ExportSource& source, const ExportJob& job, ExportFile& file)
      : source_(source), job_(job), file_(file) {
    PrimNames mesh_names, look_names;
    for (const TrajectoryShape& shape : source.header().shapes) {
      mesh_.push_back(mesh_names(shape.name));
    }
    for (const ExportLook& look : source.looks()) look_.push_back(look_names(look.name));
  }

  void write(ExportForm form) {
    write_head();
    write_meshes();
    file_.write("\ndef Xform \"pile\" (\n    kind = \"assembly\"\n)\n{\n");
    write_looks();
    if (source_.has_camera()) write_camera();
    if (form == ExportForm::objects) {
      write_objects();
    } else {
      write_instancers();
    }
    file_.write("}\n");
  }

 private:
  void line(const std::string& text) { file_.write(text + '\n'); }
  std::string time_code(size_t k) const { return std::to_string(source_.frame(k)); }

  void write_head() {
    std::string rate;
    append_number(rate, source_.header().frame_rate);
    line("#usda 1.0\n(\n    defaultPrim = \"pile\"");
    line("    doc = \"Written by pilesim. Time codes are frames of the trajectory.\"");
    line("    endTimeCode = " + time_code(source_.frame_count() - 1));
    line("    framesPerSecond = " + rate + "\n    metersPerUnit = 1");
    line("    startTimeCode = " + time_code(0));
    line("    timeCodesPerSecond = " + rate + "\n    upAxis = \"Y\"\n)");
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
      file_.write("        int[] faceVertexCounts = ");
      write_list(file_, mesh.corners.size() / 3, [](std::string& text, size_t) { text += '3'; });
      file_.write("\n        int[] faceVertexIndices = ");
      write_list(file_, mesh.corners.size(),
                 [&](std::string& text, size_t i) { append_number(text, mesh.corners[i]); });
      file_.write("\n        normal3f[] normals = ");
      write_list(file_, mesh.split_corners.size(), [&](std::string& text, size_t i) {
        append_tuple(text, mesh.split_normals[mesh.split_corners[i]]);
      });
      file_.write(" (\n            interpolation = \"faceVarying\"\n        )\n");
      file_.write("        point3f[] points = ");
      write_list(file_, mesh.points.size(),
                 [&](std::string& text, size_t i) { append_tuple(text, mesh.points[i]); });
      if (!mesh.colours.empty()) {
        file_.write("\n        color3f[] primvars:displayColor = ");
        write_list(file_, mesh.colours.size(),
                   [&](std::string& text, size_t i) { text += linear_tuple(mesh.colours[i]); });
        file_.write(" (\n            interpolation = \"uniform\"\n        )");
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
    append_pose(text, key, position, orientation);
    line(text + "\n    }");
  }

  // Translation and rotation with their keys: in full accuracy, quaternions of floats.
  void append_pose(std::string& text, const std::vector<uint32_t>& key,
                   const std::vector<Vec3f>& position, const std::vector<Quatf>& orientation) {
    const auto append = [&](const char* name, const auto& append_value) {
      text += std::string("\n        ") + name;
      if (key.size() == 1) {
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
    append("float3 xformOp:translate", [&](size_t i) { append_tuple(text, position[i]); });
    append("quatf xformOp:orient", [&](size_t i) {
      const Quatf& q = orientation[i];
      text += '(';
      append_number(text, q.w());
      text += ", ";
      append_vector(text, q.vec());
      text += ')';
    });
    text += "\n        uniform token[] xformOpOrder = [\"xformOp:translate\", \"xformOp:orient\"]";
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

  void write_objects() {
    const std::vector<ExportTrack> tracks = read_tracks(source_);
    PrimNames names;
    names("materials");
    names("camera");
    for (size_t i = 0; i < tracks.size(); ++i) {
      const ExportBody& body = source_.bodies()[i];
      const ExportTrack& track = tracks[i];
      std::string text =
          "    def Mesh \"" + names(body.name) + '"' + mesh_metadata(body.shape, "    ");
      text += "        custom int pilesim:id = " + std::to_string(body.id);
      text += "\n        custom string pilesim:name = " + quoted(body.name);
      text += "\n        " + binding(body.look);
      append_pose(text, track.key, track.position, track.orientation);
      if (body.ever_absent) {
        bool present = body.starts_present;
        const auto word = [&] { return present ? "\"inherited\"" : "\"invisible\""; };
        text += "\n        token visibility.timeSamples = {" + time_code(0) + ": " + word();
        for (const uint32_t toggle : track.toggles) {
          present = !present;
          text += ", " + time_code(toggle) + ": " + word();
        }
        text += '}';
      }
      line(text + "\n    }");
    }
  }

  // Bodies whose changes lie in the same part of the time.
  struct Group {
    std::string name;
    std::vector<uint32_t> bodies;  // indices into source_.bodies()
    size_t first = 0, last = 0;    // frames from 0: of its samples; the same: it rests
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
    }
    std::vector<Group> result;
    for (auto& [key, group] : found) result.push_back(std::move(group));
    return result;
  }

  void write_instancers() {
    for (const Group& group : groups()) write_instancer(group);
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
    file_.write("        int64[] ids = ");
    write_list(file_, count, [&](std::string& text, size_t i) { append_number(text, body(i).id); });
    file_.write("\n        custom string[] pilesim:name = ");
    write_list(file_, count, [&](std::string& text, size_t i) { text += quoted(body(i).name); });
    file_.write("\n        int[] protoIndices = ");
    write_list(file_, count,
               [&](std::string& text, size_t i) { append_number(text, prototype[i]); });
    file_.write("\n        rel prototypes = [");
    for (size_t p = 0; p < prototypes.size(); ++p) {
      file_.write((p > 0 ? ", <" : "<") + path + "/prototypes/" + prototype_name(p) + '>');
    }
    file_.write("]\n        float3[] scales = ");
    write_list(file_, count, [](std::string& text, size_t) { text += "(1, 1, 1)"; });
    write_absent(group);
    write_samples(group, "point3f[] positions", [&](std::string& text, size_t, size_t i) {
      append_tuple(text, poses_.position[group.bodies[i]]);
    });
    write_samples(group, "quath[] orientations", [&](std::string& text, size_t, size_t i) {
      append_rotation(text, poses_.orientation[group.bodies[i]]);
    });
    if (group.last > group.first) {
      // From each sample on to the next one, so that to go on with it meets the next.
      write_samples(
          group, "vector3f[] velocities",
          [&](std::string& text, size_t k, size_t i) {
            const uint32_t b = group.bodies[i];
            const Vec3f step = k == group.last ? Vec3f::Zero().eval()
                                               : Vec3f(next_.position[b] - poses_.position[b]);
            const double seconds = k == group.last ? 1 : source_.time_s(k + 1) - source_.time_s(k);
            append_velocity(text, step / static_cast<float>(seconds));
          },
          true);
    }
    line("\n\n        def Scope \"prototypes\"\n        {");
    for (size_t p = 0; p < prototypes.size(); ++p) {
      file_.write("            def Mesh \"" + prototype_name(p) + '"' +
                  mesh_metadata(prototypes[p][0], "            "));
      line("                " + binding(prototypes[p][1]) + "\n            }");
    }
    line("        }\n    }");
  }

  // One sample of each frame from group.first to group.last; append(text, k, i) writes that of the
  // i-th body. `looks_ahead`: next_ has the frame after it, where there is one.
  template <class Append>
  void write_samples(const Group& group, const std::string& name, const Append& append,
                     bool looks_ahead = false) {
    file_.write("\n        " + name);
    if (group.last == group.first) {
      source_.read(0, poses_);
      file_.write(" = ");
      write_list(file_, group.bodies.size(),
                 [&](std::string& text, size_t i) { append(text, 0, i); });
      return;
    }
    file_.write(".timeSamples = {");
    if (looks_ahead) source_.read(group.first, next_);
    for (size_t k = group.first; k <= group.last; ++k) {
      if (looks_ahead) {
        std::swap(poses_, next_);
        if (k < group.last) source_.read(k + 1, next_);
      } else {
        source_.read(k, poses_);
      }
      file_.write("\n            " + time_code(k) + ": ");
      write_list(file_, group.bodies.size(),
                 [&](std::string& text, size_t i) { append(text, k, i); });
      file_.write(",");
    }
    file_.write("\n        }");
  }

  // invisibleIds, a sample wherever they change.
  void write_absent(const Group& group) {
    std::vector<uint32_t> coming_and_going;
    for (const uint32_t b : group.bodies) {
      if (source_.bodies()[b].ever_absent) coming_and_going.push_back(b);
    }
    if (coming_and_going.empty()) return;
    file_.write("\n        int64[] invisibleIds.timeSamples = {");
    std::vector<uint32_t> before;
    for (size_t k = group.first; k <= group.last; ++k) {
      source_.read(k, poses_);
      std::vector<uint32_t> absent;
      for (const uint32_t b : coming_and_going) {
        if ((poses_.state[b] & kPresent) == 0) absent.push_back(source_.bodies()[b].id);
      }
      if (k > group.first && absent == before) continue;
      file_.write("\n            " + time_code(k) + ": ");
      write_list(file_, absent.size(),
                 [&](std::string& text, size_t i) { append_number(text, absent[i]); });
      file_.write(",");
      before = std::move(absent);
    }
    file_.write("\n        }");
  }

  ExportSource& source_;
  const ExportJob& job_;
  ExportFile& file_;
  std::vector<std::string> mesh_, look_;  // names of prims, by shape and by look
  TrajectoryFrame poses_, next_;          // scratch
};

}  // namespace

void write_usda(ExportSource& source, const ExportJob& job, ExportForm form, ExportFile& file) {
  UsdaWriter(source, job, file).write(form);
}

}  // namespace pilesim

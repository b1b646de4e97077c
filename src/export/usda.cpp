// Layout:
//   /meshes (class)     one Mesh per shape
//   /pile               materials, camera, and the bodies (usda_bodies.h)
// Large amounts of motion go to value clips, each a file for a part of the time; a
// manifest names their attributes.
#include <cmath>
#include <map>
#include <memory>
#include <set>

#include "export/export_text.h"
#include "export/formats.h"
#include "export/usda_bodies.h"
#include "export/usda_text.h"
#include "render/image_output.h"

namespace pilesim {
namespace fs = std::filesystem;

namespace {

// Readers load a whole clip when its time comes.
constexpr uint64_t kBytesOfClip = uint64_t{1} << 28;
constexpr uint64_t kBytesOfPose = 100;  // as text, with velocity

class UsdaWriter {
 public:
  UsdaWriter(ExportSource& source, const ExportJob& job, ExportFiles& files)
      : source_(source), job_(job), files_(files), file_(&files[0]) {
    UsdaNames mesh_names, look_names;
    for (const TrajectoryShape& shape : source.header().shapes) {
      prims_.mesh.push_back(mesh_names(shape.name));
    }
    for (const ExportLook& look : source.looks()) prims_.look.push_back(look_names(look.name));
    prims_.subsets.resize(source.shapes().size());
    for (const ExportBody& body : source.bodies()) {
      if (!source.looks()[body.look].is_painted) continue;
      auto& subsets = prims_.subsets[body.shape];
      if (subsets.empty()) subsets = subsets_of(source.shapes()[body.shape]);
      for (const auto& [name, picture] : subsets) {
        if (picture == 0) continue;
        const auto [look, is_new] = prims_.textured_look.try_emplace({body.look, picture});
        if (!is_new) continue;
        look->second =
            look_names(source.looks()[body.look].name + " texture " + std::to_string(picture));
      }
    }
  }

  void write(ExportForm form) {
    bodies_ = form == ExportForm::objects ? usda_objects(source_, prims_)
                                          : usda_instancers(source_, prims_);
    choose_clips();
    write_head(all_);
    write_meshes();
    file_->write("\ndef Xform \"pile\" (\n");
    if (!clips_.empty()) write_clips();
    file_->write("    kind = \"assembly\"\n)\n{\n");
    write_origin();
    write_looks();
    if (source_.has_camera()) write_camera();
    bodies_->write(*file_, !clips_.empty());
    file_->write("}\n");
  }

 private:
  void line(const std::string& text) { write_line(*file_, text); }
  std::string code(size_t k) const { return time_code(source_, k); }

  // Name of a texture by its number in TextureMap.
  static std::string subset_name(uint32_t number) { return "texture_" + std::to_string(number); }

  std::map<std::string, size_t> subsets_of(const ExportMesh& mesh) {
    std::map<std::string, size_t> subsets;
    for (const uint32_t number : mesh.texture_map.texture) {
      const auto [subset, is_new] = subsets.try_emplace(subset_name(number), 0);
      if (!is_new || number == 0) continue;
      subset->second = pictures_.number(*mesh.texture_map.textures[number - 1]);
    }
    return subsets;
  }

  void write_head(const FrameSpan& span) {
    std::string rate;
    append_number(rate, source_.header().frame_rate);
    line("#usda 1.0\n(\n    defaultPrim = \"pile\"");
    line("    doc = \"Written by pilesim. Time codes are frames of the trajectory.\"");
    line("    endTimeCode = " + code(span.last));
    line("    framesPerSecond = " + rate + "\n    metersPerUnit = 1");
    line("    startTimeCode = " + code(span.first));
    line("    timeCodesPerSecond = " + rate + "\n    upAxis = \"Y\"\n)");
  }

  // A clip begins at the frame where the previous one ends: clips do not interpolate between each
  // other.
  void choose_clips() {
    std::vector<uint64_t> poses(source_.frame_count());
    bodies_->count_poses(poses);
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
      line("\nover \"pile\"\n{");
      bodies_->write_clip(*file_, clips_[c]);
      line("}");
      const std::string comma = c > 0 ? ", " : "";
      active += comma + '(' + code(clips_[c].first) + ", " + std::to_string(c) + ')';
      paths += comma + asset(*file_);
    }
    file_ = &add_beside(".clips.usda");
    write_head(all_);
    line("\nover \"pile\"\n{");
    bodies_->write_manifest(*file_);
    line("}");
    const std::string manifest = asset(*file_);
    file_ = scene;
    line("    clips = {\n        dictionary default = {");
    line("            double2[] active = [" + active + ']');
    line("            asset[] assetPaths = [" + paths + ']');
    line("            asset manifestAssetPath = " + manifest);
    line("            string primPath = \"/pile\"");
    line("            double2[] times = [(" + code(0) + ", " + code(0) + "), (" + code(all_.last) +
         ", " + code(all_.last) + ")]\n        }\n    }");
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
      line("    def Mesh \"" + prims_.mesh[shape] + "\"\n    {");
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
      write_list(*file_, mesh.normals.size(),
                 [&](std::string& text, size_t i) { append_tuple(text, mesh.normals[i]); });
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
      if (!prims_.subsets[shape].empty()) write_places(mesh.texture_map);
      line("\n        uniform token subdivisionScheme = \"none\"");
      if (prims_.subsets[shape].size() > 1) write_subsets(shape);
      line("    }");
    }
    line("}");
  }

  void write_places(const TextureMap& map) {
    file_->write("\n        texCoord2f[] primvars:st = ");
    write_list(*file_, 3 * map.corners.size(), [&](std::string& text, size_t i) {
      const auto [u, v] = map.corners[i / 3][i % 3];
      text += '(';
      append_number(text, u);
      text += ", ";
      append_number(text, 1 - v);  // from the lower edge
      text += ')';
    });
    file_->write(" (\n            interpolation = \"faceVarying\"\n        )");
  }

  void write_subsets(uint32_t shape) {
    const std::vector<uint32_t>& texture = source_.shapes()[shape].texture_map.texture;
    std::map<std::string, std::vector<size_t>> triangles;
    for (size_t i = 0; i < texture.size(); ++i) {
      if (texture[i] != 0) triangles[subset_name(texture[i])].push_back(i);
    }
    line("        uniform token subsetFamily:materialBind:familyType = \"nonOverlapping\"");
    for (const auto& [name, found] : triangles) {
      const std::vector<size_t>& indices = found;  // lambdas cannot capture structured bindings
      line("\n        def GeomSubset \"" + name + "\"\n        {");
      line("            uniform token elementType = \"face\"");
      line("            uniform token familyName = \"materialBind\"");
      file_->write("            int[] indices = ");
      write_list(*file_, indices.size(),
                 [&](std::string& text, size_t i) { append_number(text, indices[i]); });
      line("\n        }");
    }
  }

  static std::string number(double value) {
    std::string text;
    append_number(text, static_cast<float>(value));
    return text;
  }

  static std::string linear_tuple(const Colour& colour, float times = 1) {
    std::string text = "(";
    for (size_t c = 0; c < 3; ++c) {
      if (c > 0) text += ", ";
      append_rounded(text, times * static_cast<float>(linear_from_srgb(colour[c])), 6);
    }
    return text + ')';
  }

  void write_origin() {
    const Vec3& origin = source_.origin();
    if (origin.isZero()) return;
    std::string text = "    double3 xformOp:translate = (";
    for (int axis = 0; axis < 3; ++axis) {
      if (axis > 0) text += ", ";
      append_number(text, origin[axis]);
    }
    line(text + ")\n    uniform token[] xformOpOrder = [\"xformOp:translate\"]\n");
  }

  void write_looks() {
    std::vector<std::string> picture_file;
    for (const Texture* picture : pictures_.all()) {
      ExportFile& file = add_beside(".texture." + std::to_string(picture_file.size() + 1) + ".png");
      file.write(png_of(*picture));
      picture_file.push_back(asset(file));
    }
    line("    def Scope \"materials\"\n    {");
    for (size_t i = 0; i < prims_.look.size(); ++i) {
      const ExportLook& look = source_.looks()[i];
      const std::string path = "</pile/materials/" + prims_.look[i];
      if (look.is_painted) {
        write_material(prims_.look[i], look, ".connect = " + path + "/paint.outputs:result>");
        write_reader("paint", "float3", "displayColor");
      } else {
        write_material(prims_.look[i], look, " = " + linear_tuple(look.colour));
      }
      line("        }");
    }
    for (const auto& [key, name] : prims_.textured_look) {
      const std::string path = "</pile/materials/" + name;
      write_material(name, source_.looks()[key.first],
                     ".connect = " + path + "/texture.outputs:rgb>");
      line("\n            def Shader \"texture\"\n            {");
      line("                uniform token info:id = \"UsdUVTexture\"");
      line("                asset inputs:file = " + picture_file[key.second - 1]);
      line("                token inputs:sourceColorSpace = \"sRGB\"");
      line("                float2 inputs:st.connect = " + path + "/place.outputs:result>");
      line("                token inputs:wrapS = \"repeat\"");
      line("                token inputs:wrapT = \"repeat\"");
      line("                float3 outputs:rgb\n            }");
      write_reader("place", "float2", "st");
      line("        }");
    }
    line("    }");
  }

  // Without its end. `colour`: text after the name of the surface's input.
  void write_material(const std::string& name, const ExportLook& look, const std::string& colour) {
    line("        def Material \"" + name + "\"\n        {");
    line("            token outputs:surface.connect = </pile/materials/" + name +
         "/surface.outputs:surface>\n");
    line("            def Shader \"surface\"\n            {");
    line("                uniform token info:id = \"UsdPreviewSurface\"");
    line("                color3f inputs:diffuseColor" + colour);
    line("                float inputs:roughness = " + number(look.roughness));
    if (look.metallic > 0) line("                float inputs:metallic = " + number(look.metallic));
    if (look.transmission > 0) {
      line("                float inputs:opacity = " + number(1 - look.transmission));
      line("                float inputs:ior = 1.5");
    }
    if (look.emission > 0) {
      line("                color3f inputs:emissiveColor = " +
           linear_tuple(look.colour, look.emission));
    }
    if (look.clear_coat > 0) {
      line("                float inputs:clearcoat = " + number(look.clear_coat));
      line("                float inputs:clearcoatRoughness = " + number(kCoatRoughness));
    }
    line("                token outputs:surface\n            }");
  }

  void write_reader(const std::string& name, const std::string& type, const std::string& primvar) {
    line("\n            def Shader \"" + name + "\"\n            {");
    line("                uniform token info:id = \"UsdPrimvarReader_" + type + '"');
    line("                string inputs:varname = \"" + primvar + '"');
    line("                " + type + " outputs:result\n            }");
  }

  void write_camera() {
    // Millimetres; only the ratio of focal length to aperture matters.
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
        text += (k > 0 ? ", " : "") + code(k) + ": ";
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
      position.push_back(source_.from_origin(at.position));
      Quatf q = camera_orientation(at).cast<float>();
      if (k > 0 && q.dot(orientation.back()) < 0) q.coeffs() = -q.coeffs();
      orientation.push_back(q);
    }
    append_pose(text, source_,
                {.key = key, .position = position, .orientation = orientation, .toggles = {}},
                UsdaPlace::scene);
    line(text + kXformOrder + "\n    }");
  }

  ExportSource& source_;
  const ExportJob& job_;
  ExportFiles& files_;
  ExportFile* file_;  // current file
  const FrameSpan all_{0, source_.frame_count() - 1};
  UsdaPrims prims_;
  NumberedTextures pictures_;  // of painted bodies
  std::unique_ptr<UsdaBodies> bodies_;
  std::vector<FrameSpan> clips_;  // empty: all motion is in the scene itself
};

}  // namespace

void write_usda(ExportSource& source, const ExportJob& job, ExportForm form, ExportFiles& files) {
  UsdaWriter(source, job, files).write(form);
}

}  // namespace pilesim

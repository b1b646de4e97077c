#include "export/usda_text.h"

#include "export/export_text.h"

namespace pilesim {
namespace {

std::string material_binding(const std::string& material) {
  return "rel material:binding = </pile/materials/" + material + '>';
}

}  // namespace

std::string UsdaNames::operator()(const std::string& name) {
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

std::string UsdaPrims::binding(uint32_t shape, uint32_t look_index) const {
  std::string name = look[look_index];
  if (subsets[shape].size() == 1) {
    const auto found = textured_look.find({look_index, subsets[shape].begin()->second});
    if (found != textured_look.end()) name = found->second;
  }
  return material_binding(name);
}

std::string UsdaPrims::subset_bindings(uint32_t shape, uint32_t look_index,
                                       const std::string& indent) const {
  std::string text;
  if (subsets[shape].size() < 2) return text;
  for (const auto& [subset, picture] : subsets[shape]) {
    const auto found = textured_look.find({look_index, picture});
    if (found == textured_look.end()) continue;
    text += indent + "over \"" + subset + "\" (\n" + indent +
            "    prepend apiSchemas = [\"MaterialBindingAPI\"]\n" + indent + ")\n" + indent +
            "{\n" + indent + "    " + material_binding(found->second) + "\n" + indent + "}\n";
  }
  return text;
}

std::string UsdaPrims::mesh_metadata(uint32_t shape, const std::string& indent) const {
  return " (\n" + indent + "    prepend apiSchemas = [\"MaterialBindingAPI\"]\n" + indent +
         "    prepend references = </meshes/" + mesh[shape] + ">\n" + indent + ")\n" + indent +
         "{\n";
}

std::string usda_string(const std::string& text) {
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

void append_tuple(std::string& text, const Vec3f& v) {
  text += '(';
  append_vector(text, v);
  text += ')';
}

std::string time_code(const ExportSource& source, size_t k) {
  return std::to_string(source.frame(k));
}

void append_pose(std::string& text, const ExportSource& source, const ExportTrack& track,
                 UsdaPlace place) {
  const auto& key = track.key;
  const auto append = [&](const char* name, const auto& append_value) {
    text += std::string("\n        ") + name;
    if (place == UsdaPlace::declared) return;
    if (key.size() == 1 && place == UsdaPlace::scene) {
      text += " = ";
      append_value(0);
      return;
    }
    text += ".timeSamples = {";
    for (size_t i = 0; i < key.size(); ++i) {
      text += (i > 0 ? ", " : "") + time_code(source, key[i]) + ": ";
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

}  // namespace pilesim

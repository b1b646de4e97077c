#include "geometry/obj_writer.h"

#include <charconv>
#include <string>

#include "core/atomic_file.h"

namespace pilesim {
namespace {

void append_number(std::string& text, float value) {
  char digits[32];
  const auto [end, error] = std::to_chars(std::begin(digits), std::end(digits), value);
  text.append(digits, end);
}

void append_vertex(std::string& text, const Vec3& vertex) {
  text += 'v';
  for (const double coordinate : vertex) {
    text += ' ';
    append_number(text, static_cast<float>(coordinate) + 0.0f);  // no negative zero
  }
  text += '\n';
}

void append_triangle(std::string& text, const Triangle& triangle) {
  text += 'f';
  for (const uint32_t vertex : triangle) text += ' ' + std::to_string(vertex + 1);
  text += '\n';
}

}  // namespace

void write_obj(const TriangleMesh& mesh, const std::filesystem::path& file) {
  std::string text;
  for (const Vec3& vertex : mesh.vertices) append_vertex(text, vertex);
  auto group = mesh.groups.begin();
  for (uint32_t i = 0; i < mesh.triangles.size(); ++i) {
    if (group != mesh.groups.end() && group->first_triangle == i) {
      text += "g " + group->name + '\n';
      ++group;
    }
    append_triangle(text, mesh.triangles[i]);
  }
  write_file_atomically(file, text);
}

}  // namespace pilesim

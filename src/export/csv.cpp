#include <string>
#include <string_view>

#include "core/body_flags.h"
#include "export/export_text.h"
#include "export/formats.h"

namespace pilesim {
namespace {

// RFC 4180.
std::string quoted(const std::string& name) {
  // Spreadsheets read cells that begin like this as formulas, but not after an apostrophe.
  const bool is_formula = !name.empty() && std::string_view("=+-@").find(name[0]) != name.npos;
  if (!is_formula && name.find_first_of(",\"\r\n") == name.npos) return name;
  std::string text = is_formula ? "\"'" : "\"";
  for (const char c : name) text.append(c == '"' ? 2 : 1, c);
  return text + '"';
}

}  // namespace

void write_csv(ExportSource& source, ExportFile& file) {
  file.write("frame,time_s,id,name,x_m,y_m,z_m,qw,qx,qy,qz,state\n");
  std::vector<std::string> body;
  for (const ExportBody& b : source.bodies()) {
    body.push_back(std::to_string(b.id) + ',' + quoted(b.name) + ',');
  }
  TrajectoryFrame poses;
  std::string text;
  for (size_t k = 0; k < source.frame_count(); ++k) {
    source.read(k, poses);
    std::string frame = std::to_string(source.frame(k)) + ',';
    append_number(frame, source.time_s(k));
    frame += ',';
    for (size_t i = 0; i < body.size(); ++i) {
      if ((poses.state[i] & kPresent) == 0) continue;
      text = frame + body[i];
      for (const double value : poses.position[i]) {
        append_number(text, value);
        text += ',';
      }
      const Quatf& q = poses.orientation[i];
      for (const float value : {q.w(), q.x(), q.y(), q.z()}) {
        append_number(text, value);
        text += ',';
      }
      append_number(text, static_cast<unsigned>(poses.state[i]));
      text += '\n';
      file.write(text);
    }
  }
}

}  // namespace pilesim

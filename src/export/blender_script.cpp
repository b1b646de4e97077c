#include <nlohmann/json.hpp>
#include <string>

#include "export/formats.h"

namespace pilesim {

extern const char* const kBlenderScript;  // blender_import.py, embedded by CMake

void write_blender_script(const std::string& data, ExportForm form, ExportFile& file) {
  // The only line of the script that depends on the export.
  const std::string settings = "DATA, FORM = \"pile.npz\", \"objects\"\n";
  std::string script = kBlenderScript;
  const std::string name = form == ExportForm::objects ? "objects" : "instances";
  // JSON strings are valid Python strings.
  script.replace(script.find(settings), settings.size(),
                 "DATA, FORM = " + nlohmann::json(data).dump() + ", \"" + name + "\"\n");
  file.write(script);
}

}  // namespace pilesim

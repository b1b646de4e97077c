#include <nlohmann/json.hpp>
#include <string>

#include "export/formats.h"

namespace pilesim {

extern const char* const kBlenderScript;  // blender_import.py, by CMake

void write_blender_script(const std::string& data, ExportForm form, ExportFile& file) {
  // The one line of the script that is of an export.
  const std::string settings = "DATA, FORM = \"pile.npz\", \"objects\"\n";
  std::string script = kBlenderScript;
  const std::string name = form == ExportForm::objects ? "objects" : "instances";
  // JSON's strings are Python's.
  script.replace(script.find(settings), settings.size(),
                 "DATA, FORM = " + nlohmann::json(data).dump() + ", \"" + name + "\"\n");
  file.write(script);
}

}  // namespace pilesim

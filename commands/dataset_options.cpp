#include "dataset_options.h"

#include <algorithm>
#include <sstream>
#include <string>

#include "json/codec.h"

namespace pilesim {
namespace {

// "a,b" as indices into `words`, each once. Throws CLI::ValidationError.
std::vector<size_t> parse_words(const std::string& text, const std::vector<std::string>& words,
                                const std::string& option) {
  std::vector<size_t> chosen;
  std::istringstream parts(text + ',');
  for (std::string part; std::getline(parts, part, ',');) {
    const auto found = std::ranges::find(words, part);
    if (found == words.end()) {
      throw CLI::ValidationError(option, "\"" + part + "\" is none of " + quoted_list(words) +
                                             "; several are joined by commas");
    }
    const auto index = static_cast<size_t>(found - words.begin());
    if (std::ranges::find(chosen, index) == chosen.end()) chosen.push_back(index);
  }
  return chosen;
}

}  // namespace

std::vector<CLI::Option*> add_dataset_options(CLI::App& command, DatasetOptions& options) {
  CLI::Option* passes =
      command
          .add_option_function<std::string>(
              "--passes",
              [&options](const std::string& text) {
                std::vector<std::string> words;
                for (const PassName& each : kPassNames) words.emplace_back(each.name);
                for (const size_t i : parse_words(text, words, "--passes")) {
                  options.passes.push_back(kPassNames[i].pass);
                }
              },
              "Also write numbers of each pixel into passes/: depth, ids (of bodies), shapes, "
              "normals, motion (to the next frame), visibility (of each body)")
          ->type_name("NAME,...");
  CLI::Option* annotations =
      command
          .add_option_function<std::string>(
              "--annotations",
              [&options](const std::string& text) {
                for (const size_t i : parse_words(text, {"coco", "bop"}, "--annotations")) {
                  (i == 0 ? options.coco : options.bop) = true;
                }
              },
              "A dataset of the pictures: coco (coco.json) or bop (bop/), or both, coco,bop")
          ->type_name("NAME,...");
  return {passes, annotations};
}

}  // namespace pilesim

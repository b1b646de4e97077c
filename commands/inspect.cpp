#include <array>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string_view>

#include "core/output_directory.h"
#include "options.h"
#include "signature/signature_file.h"
#include "signature/signature_summary.h"

namespace pilesim {

void add_inspect_command(CLI::App& app) {
  struct Options {
    std::string file;
    std::string plots;
    bool force = false;
  };
  auto options = std::make_shared<Options>();
  CLI::App* command = app.add_subcommand("inspect", "Print what a signature holds");
  command->add_option("signature", options->file, "A file of pilesim sample-signature")->required();
  command->add_option("--plot", options->plots, "Draw it, too, into this directory (PNG)")
      ->type_name("DIRECTORY");
  command->add_flag("--force", options->force, "Replace pictures that are there already");
  command->footer(R"(
Example:
  pilesim inspect ring.sig --plot ring-pictures)");
  command->callback([options] {
    const Signature signature = read_signature(options->file);
    std::fputs(summary_text(signature).c_str(), stdout);
    if (options->plots.empty()) return;
    constexpr std::array<std::string_view, 1> kKnown = {"collision_height.png"};
    remove_output(claim_output(options->plots, kKnown, options->force));
    make_output_directory(options->plots);
    for (const auto& picture : plot_signature(signature, options->plots)) {
      std::printf("%s\n", picture.c_str());
    }
  });
}

}  // namespace pilesim

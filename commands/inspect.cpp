#include <array>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <string_view>

#include "core/error.h"
#include "core/output_directory.h"
#include "core/printable.h"
#include "options.h"
#include "print.h"
#include "render/image_output.h"
#include "render/pose_sheet.h"
#include "signature/rest/known_rest_poses.h"
#include "signature/sampled_mesh.h"
#include "signature/signature_file.h"
#include "signature/signature_summary.h"

namespace pilesim {
namespace {

namespace fs = std::filesystem;

struct InspectArguments {
  std::string file;
  std::string plots;
  std::string mesh;
  bool force = false;
};

constexpr std::string_view kPoseBodies = "rest_pose_bodies.png";
constexpr size_t kMostPoses = 16;  // a round side has dozens

// The body in its rest poses, likeliest first, under how probable they are.
fs::path draw_rest_poses(const Signature& signature, const TriangleMesh& mesh,
                         const fs::path& file) {
  std::vector<LabelledPose> poses;
  for (const RestPosePair& pair : pair_rest_poses(signature.rest_poses)) {
    if (poses.size() == kMostPoses) break;
    std::string label;
    const auto add = [&](const KnownRestPose* pose) {
      if (pose == nullptr) return;
      char text[40];
      std::snprintf(text, sizeof text, "%s%s %.1f%%", label.empty() ? "" : ", ",
                    pose->source.c_str(), 100 * pose->probability);
      label += text;
    };
    add(pair.by_geometry);
    add(pair.by_simulation);
    poses.push_back({pair.pose->up, pair.pose->height_m, label});
  }
  write_png(draw_pose_sheet(mesh, signature.body.centre_of_mass, poses), file);
  return file;
}

void inspect(const InspectArguments& options) {
  std::error_code fault;
  if (fs::exists(fs::path(options.file) / "trajectory.zarr", fault)) {
    throw Error(ErrorKind::input,
                Problem{.file = options.file,
                        .found = "is a run",
                        .expected = "a signature",
                        .remedy = "Open " + (fs::path(options.file) / "report.html").string() +
                                  " to judge the run, or play it: pilesim view " +
                                  shell_word(options.file)});
  }
  const Signature signature = read_signature(options.file);
  std::optional<TriangleMesh> mesh;
  if (!options.mesh.empty()) mesh = import_sampled_mesh(options.mesh, signature.body);
  print("%s", summary_text(signature).c_str());
  if (options.plots.empty()) return;
  constexpr std::array<std::string_view, 6> kPictures = {
      "collision_height.png", "response_mean.png", "response_spread.png",
      "rest_poses.png",       kPoseBodies,         "packing.png"};
  remove_output(claim_output(options.plots, kPictures, options.force));
  make_output_directory(options.plots);
  std::vector<fs::path> pictures = plot_signature(signature, options.plots);
  if (mesh && !signature.rest_poses.empty()) {
    pictures.push_back(draw_rest_poses(signature, *mesh, fs::path(options.plots) / kPoseBodies));
  }
  for (const fs::path& picture : pictures) print_line(picture.string());
}

}  // namespace

void add_inspect_command(CLI::App& app) {
  auto options = std::make_shared<InspectArguments>();
  CLI::App* command = app.add_subcommand("inspect", "Print the content of a signature");
  command->add_option("signature", options->file, "A file of pilesim sample-signature")
      ->required()
      ->type_name("FILE.sig")
      ->check(named(), "");
  CLI::Option* plot = command
                          ->add_option("--plot", options->plots,
                                       "Draw it, too, into this directory: collision_height.png, "
                                       "response_mean.png, response_spread.png and, if it has rest "
                                       "poses and packing, rest_poses.png and packing.png")
                          ->type_name("DIRECTORY")
                          ->check(named(), "");
  command
      ->add_option("--mesh", options->mesh,
                   "With --plot: the mesh that was sampled, to draw it in its rest poses, too: "
                   "rest_pose_bodies.png")
      ->type_name("MESH")
      ->check(named(), "")
      ->needs(plot);
  command->add_flag("--force", options->force, "Replace pictures that exist");
  command->footer(R"(
Example:
  pilesim inspect ring.sig --plot ring-pictures --mesh assets/ring.obj)");
  command->callback([options] { inspect(*options); });
}

}  // namespace pilesim

#include <array>
#include <memory>

#include "numbers.h"
#include "options.h"
#include "render/render_job.h"
#include "render_pictures.h"
#include "scene/picture_limits.h"

namespace pilesim {

void add_render_command(CLI::App& app) {
  auto options = std::make_shared<RenderArguments>();
  CLI::App* command =
      app.add_subcommand("render", "Draw a trajectory to PNG frames and an MP4, off screen");
  command->add_option("input", options->input, "The directory of a run")
      ->required()
      ->type_name("DIRECTORY")
      ->check(named(), "");
  command
      ->add_option("-o,--output", options->output,
                   "Directory for frames/, video.mp4 and sheet.png (default: the input)")
      ->type_name("DIRECTORY");
  command
      ->add_option_function<std::string>(
          "--frames",
          [options](const std::string& text) {
            options->frames = parse_frame_ranges(text);
            options->all_frames = false;
          },
          std::string("Frames to draw: ") + kFramesHelp +
              "; several with commas: 0,45,last (default: all)")
      ->type_name("FIRST-LASTxSTEP");
  command
      ->add_option_function<std::string>(
          "--size",
          [options](const std::string& text) {
            const auto [width, height] = parse_pair(text, "--size", "1280x720");
            options->overrides.add(
                "/render/size=[" + std::to_string(width) + "," + std::to_string(height) + "]",
                "--size", text);
          },
          "Size of the picture in pixels, " + std::to_string(kSmallestSide) + " to " +
              std::to_string(kLargestSide) + " each and at most " + std::to_string(kMostPixels) +
              " in all (a video omits a row or column of odd sizes); the same as --set "
              "/render/size=[WIDTH,HEIGHT]")
      ->type_name("WIDTHxHEIGHT");
  add_choice<Renderer>(*command, "--renderer",
                       {{"raster", Renderer::raster}, {"rays", Renderer::rays}}, options->renderer,
                       "raster (default): fast; rays: slow, with full meshes and indirect light; "
                       "the same as --set /render/renderer=NAME");
  add_choice<RayQuality>(
      *command, "--quality",
      {{"preview", RayQuality::preview}, {"good", RayQuality::good}, {"final", RayQuality::final}},
      options->quality,
      "Quality of rays, which it implies: preview, good or final (default); the same as --set "
      "/render/rays/quality=NAME");
  add_whole_number(
      *command, "--samples", {1, kMostRaySamples},
      [options](uint64_t samples) { options->samples = samples; },
      "Samples a pixel: 1, 2, 4 or 8 for raster (default 4); any number for rays (default: by "
      "quality); the same as --set /render/samples=N or /render/rays/samples=N");
  CLI::Option* overlay = add_choice<OverlayKind>(
      *command, "--overlay",
      {{"piles", OverlayKind::piles},
       {"guide", OverlayKind::guide},
       {"solver", OverlayKind::solver},
       {"forces", OverlayKind::forces}},
      options->overlay,
      "piles: the layers of directed piles, sleeping bodies darker; guide: the guide, dots at held "
      "bodies, bodies in the colours of the analysis; solver: bodies in the colour of the engine "
      "that steps them, with a legend, sleeping bodies darker; forces: force chains of a glued "
      "pile: lines from body to body, as thick as the force, blue where bodies push, red where "
      "glue pulls");
  command
      ->add_option("--compare-with", options->compare_with,
                   "The directory of another run, drawn on the right of each picture with the same "
                   "camera, with both names")
      ->type_name("DIRECTORY")
      ->check(named(), "")
      ->excludes(overlay);
  CLI::Option* sheet =
      command
          ->add_option_function<std::string>(
              "--sheet",
              [options](const std::string& text) {
                options->sheet = parse_pair(text, "--sheet", "4x3");
              },
              "Draw one picture of evenly spaced frames, sheet.png, and nothing else; at most " +
                  std::to_string(kMostSheetPixels) + " pixels")
          ->type_name("COLUMNSxROWS");
  command
      ->add_option(
          "--camera", options->camera,
          "One of the scene's cameras by its name, \"camera\" for the one without, or all: "
          "each into cameras/NAME/ of the output")
      ->type_name("NAME")
      ->check(named(), "");
  CLI::Option* orbit =
      command
          ->add_option_function<std::string>(
              "--orbit",
              [options](const std::string& text) {
                options->orbit_s = parse_seconds(text, "--orbit");
              },
              "Turn the camera once about its target in so many seconds, while the bodies stand "
              "still as in one frame: the last one, or that of --frames")
          ->type_name("TIME");
  const auto add_names = [&](const char* name, std::vector<std::string>& names,
                             const std::string& description) {
    command->add_option(name, names, description)->type_name("NAME")->allow_extra_args(false);
  };
  add_names("--only", options->only,
            "Draw bodies of these names only; * and ? are wildcards: 'spout/*' (repeatable)");
  add_names("--hide", options->hide, "Leave bodies of these names out, likewise (repeatable)");
  for (CLI::Option* option : add_dataset_options(*command, options->dataset)) {
    option->excludes(sheet)->excludes(orbit)->excludes(command->get_option("--compare-with"));
  }
  command->add_flag("--no-video", options->no_video, "Write the PNG frames only; needs no ffmpeg")
      ->excludes(sheet);
  add_override_option(*command, options->overrides,
                      "Override a value of the camera or of render: --set /render/samples=8");
  CLI::Option* resume =
      command->add_flag("--resume", options->resume,
                        "Keep the pictures that the same command had drawn when it was interrupted "
                        "or killed, and draw the others, or begin if there are none");
  command
      ->add_flag("--keep-films", options->keep_films,
                 "Rays: keep the sums of each picture's samples in films/, up to 48 bytes a pixel. "
                 "With --resume an unfinished picture goes on; with more --samples finished ones "
                 "go on, too, to the same bytes as if drawn at once")
      ->excludes(sheet)
      ->excludes(command->get_option("--compare-with"));
  add_run_options(*command, options->run);
  resume->excludes(command->get_option("--force"))->excludes(sheet);
  command->footer(R"(
Examples:
  pilesim render out/crate
  pilesim render out/crate --resume
  pilesim render out/crate --sheet 4x3
  pilesim render out/crate -o out/still --renderer rays --frames 150 --no-video
  pilesim render out/crate -o out/more --renderer rays --samples 16 --keep-films
  pilesim render out/crate -o out/more --renderer rays --samples 64 --keep-films --resume
  pilesim render out/crate -o out/draft --quality preview
  pilesim render out/crate -o out/end --frames 120- --no-video
  pilesim render out/crate -o out/last --frames last --no-video
  pilesim render out/crate -o out/close --frames 30-90x2 --size 1920x1080 --samples 8
  pilesim render out/crate --passes depth,ids,normals --annotations coco,bop -o out/dataset
  pilesim render out/crate --camera all -o out/views
  pilesim render out/crate --orbit 6s -o out/turned
  pilesim render out/crate --hide crate -o out/without
  pilesim render out/statistical --compare-with out/impulse -o out/both
  pilesim render out/crate --set '/camera={"position": [3, 2, 4], "target": [0, 0.5, 0]}')");
  command->callback(
      [options] { with_options_named(options->overrides, [&] { render(*options); }); });
}

}  // namespace pilesim

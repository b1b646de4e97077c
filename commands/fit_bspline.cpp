#include <memory>
#include <optional>

#include "core/atomic_file.h"
#include "core/output_directory.h"
#include "numbers.h"
#include "options.h"
#include "print.h"
#include "signature/signature_file.h"
#include "signature/signature_fitting.h"
#include "signature/signature_summary.h"
#include "signature/spline/bspline.h"

namespace pilesim {
namespace {

struct FitBsplineArguments {
  FitOptions fit;
  RunOptions run;
  std::string output;
  std::string plots;
  std::optional<int> degree;
  std::vector<int> control_points = {SplineSize{}.control_points[0]};  // of all axes, or of four
  double precision = 1e-3;
};

// "4" or "4,5,4,6".
std::vector<int> parse_points(const std::string& text) {
  constexpr char kOption[] = "--control-points";
  std::vector<int> points;
  std::string_view rest = text;
  for (;;) {
    const size_t comma = rest.find(',');
    points.push_back(
        static_cast<int>(parse_whole_number(rest.substr(0, comma), {1, 1000}, kOption)));
    if (comma == rest.npos) break;
    rest.remove_prefix(comma + 1);
  }
  if (points.size() == 1 || points.size() == 4) return points;
  throw CLI::ValidationError(kOption, "'" + text + "' is not one number for all axes, or four");
}

SplineSize size_of(const FitBsplineArguments& options) {
  SplineSize size;
  if (options.degree) size.degree.fill(*options.degree);
  const std::vector<int>& points = options.control_points;
  for (size_t i = 0; i < 4; ++i) size.control_points[i] = points[points.size() == 1 ? 0 : i];
  return size;
}

void fit(FitBsplineArguments& options) {
  claim_output_file(options.output, options.run.force);
  FitOptions& f = options.fit;
  f.settings.mean = f.settings.spread = size_of(options);
  f.settings.mean_step = f.settings.spread_step = options.precision;
  if (options.degree) f.most_degree = *options.degree;
  constexpr std::array<std::string_view, 2> kPictures = {"fit_mean.png", "fit_curve.png"};
  if (!options.plots.empty()) claim_output(options.plots, kPictures, options.run.force);
  const FitRun run = fit_signature(f);
  write_signature(run.fitted, options.output);
  if (!options.plots.empty()) {
    remove_output(claim_output(options.plots, kPictures, options.run.force));
    make_output_directory(options.plots);
    for (const auto& picture : plot_fit(run, options.plots)) {
      if (!options.run.quiet) print_line(picture.string());
    }
  }
  if (options.run.quiet) return;
  print("%s: %zu bytes, from %zu; fitted in %.2f s", options.output.c_str(), run.fitted_bytes,
        run.table_bytes, run.fit_s);
  if (!run.curve.empty()) print(", searched in %.2f s", run.search_s);
  if (run.fitted.accuracy) print(", accuracy measured in %.2f s", run.accuracy_s);
  print("\n%s%s", fit_report_text(run).c_str(), summary_text(run.fitted).c_str());
}

}  // namespace

void add_fit_bspline_command(CLI::App& app) {
  auto options = std::make_shared<FitBsplineArguments>();
  FitOptions& f = options->fit;
  CLI::App* command = app.add_subcommand(
      "fit-bspline", "Make a signature a thousand times smaller: B-splines in place of its tables");
  command->add_option("signature", f.signature, "A file of pilesim sample-signature")
      ->required()
      ->type_name("FILE.sig")
      ->check(named(), "");
  command->add_option("-o,--output", options->output, "The fitted signature to write, NAME.fit.sig")
      ->required()
      ->type_name("FILE.sig");
  command
      ->add_option("--mesh", f.mesh,
                   "The mesh that was sampled, to measure the fit against fresh true responses")
      ->type_name("MESH")
      ->check(named(), "");
  auto* bytes = add_whole_number(
      *command, "--max-bytes", {1, 1'000'000'000}, [&f](uint64_t most) { f.max_bytes = most; },
      "Choose the fit of least error in a file of this size");
  auto* error = add_real_number(
      *command, "--max-error", {.excludes_least = true}, [&f](double most) { f.max_error = most; },
      "Choose the smallest fit with this distance from true responses or less; with --mesh");
  add_whole_number(
      *command, "--degree", {0, kMostDegree},
      [options](uint64_t degree) { options->degree = static_cast<int>(degree); },
      "Degree of the splines, default " + std::to_string(SplineSize{}.degree[0]) +
          "; with --max-bytes or --max-error the highest to try, from 1, default " +
          std::to_string(f.most_degree) + ", quicker to query");
  command
      ->add_option_function<std::string>(
          "--control-points",
          [options](const std::string& text) { options->control_points = parse_points(text); },
          "Control points on each axis, or four numbers by axis; default " +
              std::to_string(SplineSize{}.control_points[0]) + " (1 to 1000)")
      ->type_name("N[,N,N,N]")
      ->excludes(bytes)
      ->excludes(error);
  add_real_number(
      *command, "--precision", {.excludes_least = true},
      [options](double step) { options->precision = step; },
      "Rounding of control points, in units of the speed before; default 0.001")
      ->excludes(bytes)
      ->excludes(error);
  add_choice<ResponseCoordinates>(
      *command, "--coordinates",
      {{"cartesian", ResponseCoordinates::cartesian},
       {"spherical", ResponseCoordinates::spherical}},
      f.settings.coordinates, "Coordinates of the mean response: cartesian (default) or spherical");
  add_choice<Parametrisation>(
      *command, "--parameters",
      {{"uniform", Parametrisation::uniform}, {"centripetal", Parametrisation::centripetal}},
      f.settings.parametrisation,
      "Parameters of nodes on the splines: uniform (default) or centripetal");
  command
      ->add_option("--plot", options->plots,
                   "Draw the fit, too, into this directory: fit_mean.png and, after a "
                   "search, fit_curve.png")
      ->type_name("DIRECTORY")
      ->check(named(), "");
  add_run_options(*command, options->run);
  command->footer(R"(
Examples:
  pilesim fit-bspline ring.sig -o ring.fit.sig --max-bytes 5000 --mesh assets/ring.obj
  pilesim fit-bspline ring.sig -o ring.fit.sig --max-error 0.03 --mesh assets/ring.obj
  pilesim fit-bspline ring.sig -o ring.fit.sig --degree 3 --control-points 4 --plot ring-fit

Every command takes the fitted file in place of the signature.)");
  command->callback([options] { fit(*options); });
}

}  // namespace pilesim

#include <algorithm>
#include <cmath>

#include "core/gnuplot.h"
#include "core/types.h"
#include "signature/signature_summary.h"
#include "signature/table/axis_labels.h"

namespace pilesim {
namespace {

namespace fs = std::filesystem;

constexpr int kSurfaceLines = 33;

// Polar angle from the plane's normal, azimuth about it (degrees), magnitude.
std::array<double, 3> spherical_of(const Vec3f& v) {
  const double size = v.norm();
  return {size > 0 ? degrees(std::acos(std::clamp(v.y() / size, -1.0, 1.0))) : 0,
          degrees(std::atan2(v.z(), v.x())), size};
}

Vec3f mean_velocity(const ResponseModel& model, const ResponseKeys& keys) {
  Vector6 mean;
  SpreadFactor factor;
  model.evaluate(keys, mean, factor);
  return mean.head<3>();
}

fs::path plot_mean(const FitRun& run, const fs::path& file) {
  const ResponseTable& t = run.table.responses;
  const ResponseModel fit(run.fitted);
  const size_t i0 = t.axes[0].size() / 2, i1 = t.axes[1].size() / 2;
  ResponseKeys keys = {t.axes[0].nodes[i0], t.axes[1].nodes[i1], 0, 0};
  const Axis &a = t.axes[2], &b = t.axes[3];
  std::array<std::string, 3> nodes, surface;
  for (size_t i = 0; i < a.size(); ++i) {
    for (size_t j = 0; j < b.size(); ++j) {
      keys[2] = a.nodes[i];
      keys[3] = b.nodes[j];
      const auto value = spherical_of(mean_velocity(ResponseModel(t), keys));
      for (size_t k = 0; k < 3; ++k) {
        nodes[k] += number(shown(a, i)) + " " + number(shown(b, j)) + " " + number(value[k]) + "\n";
      }
    }
  }
  const auto between = [](const Axis& axis, int line) {
    const float part = static_cast<float>(line) / (kSurfaceLines - 1);
    return axis.nodes.front() + part * (axis.nodes.back() - axis.nodes.front());
  };
  for (int i = 0; i < kSurfaceLines; ++i) {
    for (int j = 0; j < kSurfaceLines; ++j) {
      keys[2] = between(a, i);
      keys[3] = between(b, j);
      const auto value = spherical_of(mean_velocity(fit, keys));
      for (size_t k = 0; k < 3; ++k) {
        surface[k] += number(shown_key(a, keys[2])) + " " + number(shown_key(b, keys[3])) + " " +
                      number(value[k]) + "\n";
      }
    }
    for (std::string& s : surface) s += "\n";
  }
  const bool raw = t.layout == TableLayout::dissertation;
  const std::array<std::string, 3> names = {"polar angle (deg)", "azimuth (deg)",
                                            raw ? "magnitude (m/s)" : "magnitude"};
  std::string script = "set multiplot layout 1,3 title 'Mean velocity response at " +
                       t.axes[0].name + " " + number(shown(t.axes[0], i0)) + ", " + t.axes[1].name +
                       " " + number(shown(t.axes[1], i1)) +
                       " deg: points of the table, fitted surface'\n" +
                       "set palette defined (0 '#4c78a8', 1 '#f4f4f4', 2 '#e45756')\n"
                       "set xlabel '" +
                       label(a) + "'\nset ylabel '" + label(b) +
                       "'\nset view 62,40\nset xyplane 0\nunset colorbox\nunset key\n"
                       "set pm3d depthorder border lc rgb '#999999' lw 0.2\n";
  for (size_t k = 0; k < 3; ++k) {
    script += "$nodes << EOD\n" + nodes[k] + "EOD\n$surface << EOD\n" + surface[k] +
              "EOD\nset title '" + names[k] +
              "'\nsplot $surface with pm3d, $nodes with points pt 7 ps 0.45 lc rgb '#222222'\n";
  }
  write_png_chart(file, script + "unset multiplot\n", 1500, 520);
  return file;
}

fs::path plot_curve(const FitRun& run, const fs::path& file) {
  std::string plot =
      "plot $d using 1:2 with linespoints lw 2 pt 7 ps 0.6 lc rgb '#4c78a8' title "
      "'expected: fit of the true mean and spread'";
  std::string data;
  for (const FitCurvePoint& p : run.curve) {
    data += number(static_cast<double>(p.bytes)) + " " + number(p.expected_error) + " " +
            (p.distance ? number(*p.distance) : std::string("?")) + "\n";
  }
  if (run.fitted.accuracy) {
    plot +=
        ", $d using 1:3 with linespoints lw 2 pt 7 ps 0.6 lc rgb '#e45756' title "
        "'measured: distance from true responses'";
    plot += ", " + number(run.fitted.accuracy->noise_floor) +
            " lw 1 dt 2 lc rgb '#444444' title 'noise floor'";
    plot += ", " + number(run.fitted.accuracy->models.front().distance) +
            " lw 1 dt 4 lc rgb '#444444' title 'table'";
  }
  write_png_chart(file,
                  "set title 'Size of the file against error'\nset logscale x\n"
                  "set grid lc rgb '#e4e4e4'\nset yrange [0:*]\nset datafile missing '?'\n"
                  "set xlabel 'bytes'\nset ylabel 'in units of sqrt(v^2 + k^2 w^2)'\n$d << EOD\n" +
                      data + "EOD\n" + plot + "\n",
                  760, 420);
  return file;
}

}  // namespace

std::vector<fs::path> plot_fit(const FitRun& run, const fs::path& directory) {
  std::vector<fs::path> files = {plot_mean(run, directory / "fit_mean.png")};
  if (!run.curve.empty()) files.push_back(plot_curve(run, directory / "fit_curve.png"));
  return files;
}

}  // namespace pilesim

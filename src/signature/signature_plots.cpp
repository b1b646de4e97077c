#include <cmath>
#include <cstdio>

#include "signature/plotting.h"
#include "signature/signature_summary.h"

namespace pilesim {
namespace {

namespace fs = std::filesystem;

// Mean against spin for some tilts, with the deviation of the middle one as a band.
fs::path plot_heights(const CollisionHeightTable& t, const fs::path& file) {
  const size_t tilts = t.tilt.size();
  const size_t middle = tilts / 2;
  const auto value = [&](const std::vector<float>& of, size_t i, size_t j) {
    return static_cast<double>(of[i * tilts + j]);
  };
  const auto tilt_name = [&](size_t j) {
    return tilts == 1 ? std::string("all directions") : number(shown(t.tilt, j)) + " deg";
  };
  std::string plot = "plot '-' with filledcurves fc rgb '#d4dfeb' title 'one deviation around " +
                     tilt_name(middle) + "'";
  std::string data;
  for (size_t i = 0; i < t.spin.size(); ++i) {
    const double mean = value(t.mean_m, i, middle), deviation = value(t.deviation_m, i, middle);
    data += number(shown(t.spin, i)) + " " + number(mean - deviation) + " " +
            number(mean + deviation) + "\n";
  }
  data += "e\n";
  for (size_t j = 0; j < tilts; j += std::max<size_t>(1, tilts / 4)) {
    plot += ", '-' with linespoints lw 2 pt 7 ps 0.5 title '" + tilt_name(j) + "'";
    for (size_t i = 0; i < t.spin.size(); ++i) {
      data += number(shown(t.spin, i)) + " " + number(value(t.mean_m, i, j)) + "\n";
    }
    data += "e\n";
  }
  return draw(file, 760, 420,
              "set title 'Height of the centre of mass at contact'\n"
              "set key outside right top title 'spin to normal'\nset grid ytics lc rgb '#e4e4e4'\n"
              "set xlabel '" +
                  label(t.spin) + "'\nset ylabel 'height (m)'\n" + plot + "\n" + data);
}

float deviation_of(const ResponseTable& t, size_t cell, size_t component) {
  if (t.layout == TableLayout::dissertation) return t.spread[6 * cell + component];
  float variance = 0;
  for (size_t j = 0; j <= component; ++j) {
    const float l = t.spread[kFactorSize * cell + component * (component + 1) / 2 + j];
    variance += l * l;
  }
  return std::sqrt(variance);
}

// Six pictures, one a component, over the table's last two axes at the middle of the first two.
template <typename Value>
fs::path plot_slices(const ResponseTable& t, const std::string& title, const Value& value,
                     const fs::path& file) {
  const bool raw = t.layout == TableLayout::dissertation;
  const std::string v = raw ? "v - v particle, " : "v, ", w = raw ? "w, " : "k w, ";
  const std::string names[6] = {v + "along", v + "normal", v + "across",
                                w + "along", w + "normal", w + "across"};
  const uint32_t i0 = static_cast<uint32_t>(t.axes[0].size() / 2);
  const uint32_t i1 = static_cast<uint32_t>(t.axes[1].size() / 2);
  std::string script = "set multiplot layout 2,3 title '" + title + " at " + t.axes[0].name + " " +
                       number(shown(t.axes[0], i0)) + ", " + t.axes[1].name + " " +
                       number(shown(t.axes[1], i1)) + " deg'\n" +
                       "set palette defined (0 '#4c78a8', 1 '#f4f4f4', 2 '#e45756')\n"
                       "set xlabel '" +
                       label(t.axes[2]) + "'\nset ylabel '" + label(t.axes[3]) +
                       "'\nset view map\nset pm3d corners2color mean\nunset key\n";
  for (size_t component = 0; component < 6; ++component) {
    script += "set title '" + names[component] + "'\nsplot '-' with pm3d\n";
    for (uint32_t i2 = 0; i2 < t.axes[2].size(); ++i2) {
      for (uint32_t i3 = 0; i3 < t.axes[3].size(); ++i3) {
        script += number(shown(t.axes[2], i2)) + " " + number(shown(t.axes[3], i3)) + " " +
                  number(value(t.cell({i0, i1, i2, i3}), component)) + "\n";
      }
      script += "\n";
    }
    script += "e\n";
  }
  return draw(file, 1100, 640, script + "unset multiplot\n");
}

fs::path plot_rest_poses(const std::vector<KnownRestPose>& poses, const fs::path& file) {
  std::string data, labels;
  for (size_t i = 0; i < poses.size(); ++i) {
    const KnownRestPose& p = poses[i];
    data += std::to_string(i) + " " + number(100 * p.probability) + " " +
            number(100 * p.probability_low) + " " + number(100 * p.probability_high) + "\n";
    char up[80];
    std::snprintf(up, sizeof up, "(%.2f, %.2f, %.2f)", p.up.x(), p.up.y(), p.up.z());
    // Double quotes: gnuplot breaks lines only in those.
    labels += (i > 0 ? ", \"" : "\"") + std::string(up) + "\\n" + p.source + "\\nh " +
              number(p.height_m) + " m\" " + std::to_string(i);
  }
  return draw(file, 180 + 110 * static_cast<int>(poses.size()), 420,
              "set title 'Rest poses: up in the mesh frame'\nset boxwidth 0.6\n"
              "set style fill solid 0.85\nset ylabel 'probability (%)'\nset yrange [0:*]\n"
              "set grid ytics lc rgb '#e4e4e4'\nunset key\nset xtics (" +
                  labels + ") font ',8'\nset bmargin 5\n$d << EOD\n" + data +
                  "EOD\n"
                  "plot $d using 1:2 with boxes lc rgb '#4c78a8', "
                  "$d using 1:2:3:4 with yerrorbars lc rgb '#444444' pt 0\n");
}

}  // namespace

std::vector<fs::path> plot_signature(const Signature& signature, const fs::path& directory) {
  const ResponseTable t = signature.fit ? tabulate(ResponseModel(signature)) : signature.responses;
  std::vector<fs::path> files;
  files.push_back(plot_heights(signature.heights, directory / "collision_height.png"));
  files.push_back(plot_slices(
      t, "Mean response",
      [&](size_t cell, size_t component) { return t.mean[6 * cell + component]; },
      directory / "response_mean.png"));
  files.push_back(plot_slices(
      t, "Standard deviation",
      [&](size_t cell, size_t component) { return deviation_of(t, cell, component); },
      directory / "response_spread.png"));
  if (!signature.rest_poses.empty()) {
    files.push_back(plot_rest_poses(signature.rest_poses, directory / "rest_poses.png"));
  }
  return files;
}

}  // namespace pilesim

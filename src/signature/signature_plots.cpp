#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "core/gnuplot.h"
#include "signature/rest/known_rest_poses.h"
#include "signature/signature_summary.h"
#include "signature/table/axis_labels.h"

namespace pilesim {
namespace {

namespace fs = std::filesystem;

// Mean against spin for some tilts; a band shows the deviation of the middle one.
fs::path plot_heights(const CollisionHeightTable& t, const fs::path& file) {
  const size_t tilts = t.tilt.size();
  const size_t middle = tilts / 2;
  const auto value = [&](const std::vector<float>& of, size_t i, size_t j) {
    return static_cast<double>(of[i * tilts + j]);
  };
  const auto tilt_name = [&](size_t j) {
    return tilts == 1 ? std::string("all directions") : number(shown(t.tilt, j)) + " deg";
  };
  Plot plot(
      "set title 'Height of the centre of mass at contact'\n"
      "set key outside right top title 'spin to normal'\nset grid ytics lc rgb '#e4e4e4'\n"
      "set xlabel '" +
      label(t.spin) + "'\nset ylabel 'height (m)'\n");
  std::string band;
  for (size_t i = 0; i < t.spin.size(); ++i) {
    const double mean = value(t.mean_m, i, middle), deviation = value(t.deviation_m, i, middle);
    band += number(shown(t.spin, i)) + " " + number(mean - deviation) + " " +
            number(mean + deviation) + "\n";
  }
  plot.add(
      "with filledcurves fc rgb '#d4dfeb' title 'one deviation around " + tilt_name(middle) + "'",
      band);
  for (size_t j = 0; j < tilts; j += std::max<size_t>(1, tilts / 4)) {
    std::string rows;
    for (size_t i = 0; i < t.spin.size(); ++i) {
      rows += number(shown(t.spin, i)) + " " + number(value(t.mean_m, i, j)) + "\n";
    }
    plot.add("with linespoints lw 2 pt 7 ps 0.5 title '" + tilt_name(j) + "'", rows);
  }
  write_png_chart(file, plot.script(), 760, 420);
  return file;
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

// Six pictures, one per component, over the table's last two axes, in the middle of the first two.
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
                       "'\nset view map\nset pm3d corners2color mean\nunset key\n" +
                       (t.axes[2].period > 0 ? "set xtics 90\n" : "");
  for (size_t component = 0; component < 6; ++component) {
    script += "set title '" + names[component] + "'\nsplot '-' with pm3d\n";
    // Close a periodic axis: repeat its first column one period later.
    const auto columns = static_cast<uint32_t>(t.axes[2].size() + (t.axes[2].period > 0 ? 1 : 0));
    for (uint32_t column = 0; column < columns; ++column) {
      const uint32_t i2 = column % static_cast<uint32_t>(t.axes[2].size());
      const double turns = column == i2 ? 0 : t.axes[2].period;
      for (uint32_t i3 = 0; i3 < t.axes[3].size(); ++i3) {
        script += number(shown(t.axes[2], i2) + degrees(turns)) + " " +
                  number(shown(t.axes[3], i3)) + " " +
                  number(value(t.cell({i0, i1, i2, i3}), component)) + "\n";
      }
      script += "\n";
    }
    script += "e\n";
  }
  write_png_chart(file, script + "unset multiplot\n", 1100, 640);
  return file;
}

constexpr size_t kMostSlots = 14;  // a round side has dozens

std::string bars(const std::vector<RestPosePair>& slots, const KnownRestPose* RestPosePair::*source,
                 double offset) {
  std::string data;
  for (size_t i = 0; i < slots.size(); ++i) {
    const KnownRestPose* p = slots[i].*source;
    if (p == nullptr) continue;
    data += number(static_cast<double>(i) + offset) + " " + number(100 * p->probability) + " " +
            number(100 * p->probability_low) + " " + number(100 * p->probability_high) + "\n";
  }
  return data;
}

fs::path plot_rest_poses(const std::vector<KnownRestPose>& poses, const fs::path& file) {
  std::vector<RestPosePair> slots = pair_rest_poses(poses);
  const bool simulated =
      std::ranges::any_of(slots, [](const RestPosePair& s) { return s.by_simulation != nullptr; });
  std::string title = "Rest poses: up in the mesh frame";
  if (slots.size() > kMostSlots) {
    title += ", " + std::to_string(kMostSlots) + " of " + std::to_string(slots.size());
    slots.resize(kMostSlots);
  }
  std::string labels;
  for (size_t i = 0; i < slots.size(); ++i) {
    const Vec3 up = slots[i].pose->up.unaryExpr(
        [](double x) { return std::abs(x) < 5e-3 ? 0.0 : x; });  // no "-0.00"
    char text[80];
    std::snprintf(text, sizeof text, "(%.2f, %.2f, %.2f)", up.x(), up.y(), up.z());
    // Double quotes: gnuplot breaks lines only in those.
    labels += (i > 0 ? ", \"" : "\"") + std::string(text) + "\\nh " +
              number(std::round(slots[i].pose->height_m * 1e5) / 1e5) + " m\" " + std::to_string(i);
  }
  std::string script =
      "set title '" + title + "'\nset boxwidth " + (simulated ? "0.36" : "0.6") +
      "\nset style fill solid 0.85\nset ylabel 'probability (%)'\n"
      "set yrange [0:*]\nset xrange [-0.6:" +
      number(static_cast<double>(slots.size()) - 0.4) +
      "]\nset grid ytics lc rgb '#e4e4e4'\nset key outside right top\nset xtics (" + labels +
      ") font ',8'\nset bmargin 4\n$g << EOD\n" +
      bars(slots, &RestPosePair::by_geometry, simulated ? -0.19 : 0) + "EOD\n";
  std::string plot = "plot $g using 1:2 with boxes lc rgb '#4c78a8' title 'geometry'";
  if (simulated) {
    script += "$s << EOD\n" + bars(slots, &RestPosePair::by_simulation, 0.19) + "EOD\n";
    plot +=
        ", $s using 1:2 with boxes lc rgb '#f0a35e' title 'simulation, 95%', "
        "$s using 1:2:3:4 with yerrorbars lc rgb '#444444' pt 7 ps 0.3 notitle";
  }
  write_png_chart(file, script + plot + "\n", 320 + 110 * static_cast<int>(slots.size()), 420);
  return file;
}

// Ratio of the spheres' figures to the object's, in per cent, with its uncertainty.
fs::path plot_packing(const Packing& packing, const fs::path& file) {
  struct Row {
    const char* name;
    double PackingFigures::*figure;
  };
  constexpr std::array kRows = {Row{"heap\\nheight", &PackingFigures::heap_height},
                                Row{"heap\\nradius", &PackingFigures::heap_spread},
                                Row{"heap\\nreach", &PackingFigures::heap_reach},
                                Row{"column\\nheight", &PackingFigures::column_height},
                                Row{"column\\nradius", &PackingFigures::column_spread},
                                Row{"column\\nreach", &PackingFigures::column_reach},
                                Row{"column\\nsolid", &PackingFigures::column_fraction},
                                Row{"lower\\nhalf", &PackingFigures::column_deep_fraction},
                                Row{"column\\nnearest", &PackingFigures::column_nearest}};
  std::string labels, measured, spheres;
  for (size_t i = 0; i < kRows.size(); ++i) {
    const double place = static_cast<double>(i);
    labels += (i > 0 ? ", \"" : "\"") + std::string(kRows[i].name) + "\" " + number(place);
    const double PackingFigures::*figure = kRows[i].figure;
    const double mean = packing.measured.*figure;
    if (!(mean > 0)) continue;  // not measured
    measured += number(place) + " 100 " + number(100 * packing.error.*figure / mean) + "\n";
    spheres += number(place) + " " + number(100 * packing.spheres.*figure / mean) + "\n";
  }
  Plot plot(
      "set title 'Packing: spheres against poured bodies'\nset ylabel 'of the object (%)'\n"
      "set xrange [-0.5:8.5]\nset grid ytics lc rgb '#e4e4e4'\nset key outside right top\n"
      "set bmargin 4\nset xtics (" +
      labels + ")\n");
  plot.add("using 1:2:3 with yerrorbars lc rgb '#444444' lw 2 pt 7 ps 0.6 title 'object, 1 error'",
           measured);
  plot.add("using 1:2 with points lc rgb '#e45756' pt 5 ps 1.2 title 'spheres'", spheres);
  write_png_chart(file, plot.script(), 760, 420);
  return file;
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
  if (signature.packing) {
    files.push_back(plot_packing(*signature.packing, directory / "packing.png"));
  }
  return files;
}

}  // namespace pilesim

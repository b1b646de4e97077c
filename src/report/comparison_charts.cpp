#include "report/comparison_charts.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "core/gnuplot.h"
#include "core/text.h"

namespace pilesim {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kColours[] = {"#333333", "#4c78a8", "#e45756", "#54a24b",
                                    "#f2b155", "#9467bd", "#72b7b2", "#9d755d"};

// Put the key below, since names of modes are long, clear of the axis' label; use powers of ten
// that fit side by side.
constexpr const char* kKey = "set key below left reverse Left height 1\nset format '%g'\n";
constexpr int kKeyRow = 19;  // pixels, per mode

std::string colour_of(size_t mode) { return kColours[mode % std::size(kColours)]; }

std::string digits_of(const Json& number) { return with_digits(number.get<double>(), 6); }

bool is_known(const Json& interval) {
  return interval.is_object() && interval["value"].is_number() && interval["low"].is_number();
}

ComparisonChart draw(const std::string& title, const std::string& name, int height, size_t modes,
                     const Plot& plot) {
  height += kKeyRow * static_cast<int>(modes);
  const std::string script = kKey + plot.script();
  const std::string svg = draw_svg(script, 760, height);
  return {.chart = {title, svg},
          .name = name,
          .svg = svg,
          .png = draw_png(script, 1140, height * 3 / 2, 1.4)};
}

// The modes that no other mode beats in both, by rising error: one line of gnuplot each.
std::string pareto_front(const Json& modes) {
  std::vector<std::pair<double, double>> points;  // error, negated speed-up
  for (const Json& mode : modes) {
    if (!is_known(mode["worst_error"]) || !is_known(mode["speed_up"])) continue;
    points.emplace_back(mode["worst_error"]["value"].get<double>(),
                        -mode["speed_up"]["value"].get<double>());
  }
  std::ranges::sort(points);
  std::string front;
  double fastest = 0;
  for (const auto& [error, slowness] : points) {
    if (-slowness <= fastest) continue;
    fastest = -slowness;
    front += with_digits(error, 6) + " " + with_digits(fastest, 6) + "\n";
  }
  return front;
}

ComparisonChart pareto_chart(const Json& modes) {
  Plot plot(
      "set logscale xy\nset grid lc rgb '#e4e4e4' lw 1\nset offsets graph 0.1, graph 0.1, graph "
      "0.1, graph 0.1\n"
      "set xlabel 'largest error (1: as far as the reference is from itself)'\n"
      "set ylabel 'speed-up'\n");
  plot.add("with steps lw 1.2 lc rgb '#bbbbbb' title 'nothing better'", pareto_front(modes));
  for (size_t i = 0; i < modes.size(); ++i) {
    const Json& mode = modes[i];
    if (!is_known(mode["worst_error"]) || !is_known(mode["speed_up"])) continue;
    const Json& x = mode["worst_error"];
    const Json& y = mode["speed_up"];
    plot.add("using 1:2:3:4:5:6 with xyerrorbars pt 7 ps 1.1 lw 1.6 lc rgb '" + colour_of(i) +
                 "' title " + quoted(mode["name"]),
             digits_of(x["value"]) + " " + digits_of(y["value"]) + " " + digits_of(x["low"]) + " " +
                 digits_of(x["high"]) + " " + digits_of(y["low"]) + " " + digits_of(y["high"]) +
                 "\n");
  }
  return draw("Speed-up against error", "pareto", 400, modes.size() + 1, plot);
}

// Overlaps of 0 are drawn at the lower end of the chart.
constexpr double kLeastOverlap = 1e-5;

ComparisonChart overlap_chart(const Json& modes) {
  Plot plot(
      "set logscale xy\nset grid lc rgb '#e4e4e4' lw 1\nset offsets graph 0.1, graph 0.1, graph "
      "0.1, graph 0.1\n"
      "set xlabel 'deepest overlap at the end (diameters)'\nset ylabel 'speed-up'\n"
      "set arrow from 0.02, graph 0 to 0.02, graph 1 nohead lc rgb '#888888' dt 2\n");
  for (size_t i = 0; i < modes.size(); ++i) {
    const Json& mode = modes[i];
    const Json& x = mode["quality_at_end"]["deepest_penetration_diameters"];
    const Json& y = mode["speed_up"];
    if (!is_known(x) || !is_known(y)) continue;
    const auto shown = [](const Json& number) {
      return with_digits(std::max(number.get<double>(), kLeastOverlap), 6);
    };
    plot.add("using 1:2:3:4:5:6 with xyerrorbars pt 7 ps 1.1 lw 1.6 lc rgb '" + colour_of(i) +
                 "' title " + quoted(mode["name"]),
             shown(x["value"]) + " " + digits_of(y["value"]) + " " + shown(x["low"]) + " " +
                 shown(x["high"]) + " " + digits_of(y["low"]) + " " + digits_of(y["high"]) + "\n");
  }
  return draw("Speed-up against overlap", "overlap", 400, modes.size(), plot);
}

ComparisonChart error_chart(const Json& modes) {
  std::string names;
  size_t row = 0;
  for (const auto& [name, error] : modes[0]["errors"].items()) {
    std::string shown = name;
    for (char& c : shown) c = c == '_' ? ' ' : c;
    names += (row > 0 ? ", " : "") + quoted(shown) + " " + std::to_string(row);
    ++row;
  }
  Plot plot("set logscale x\nset grid xtics lc rgb '#e4e4e4' lw 1\nset ytics (" + names +
            ")\nset yrange [" + std::to_string(row) +
            ":-1]\nset xlabel 'error (1: as far as the reference is from itself)'\n"
            "set arrow from 1, graph 0 to 1, graph 1 nohead lc rgb '#888888' dt 2\n");
  for (size_t i = 0; i < modes.size(); ++i) {
    std::string block;
    double y = 0.6 * (static_cast<double>(i) + 0.5) / static_cast<double>(modes.size()) - 0.3;
    for (const auto& [name, error] : modes[i]["errors"].items()) {
      const Json& interval = error["normalised"];
      // 0 has no logarithm.
      if (is_known(interval) && interval["low"].get<double>() > 0) {
        block += digits_of(interval["value"]) + " " + with_digits(y, 6) + " " +
                 digits_of(interval["low"]) + " " + digits_of(interval["high"]) + "\n";
      }
      y += 1;
    }
    if (block.empty()) continue;
    plot.add("using 1:2:3:4 with xerrorbars pt 7 ps 0.7 lw 1.6 lc rgb '" + colour_of(i) +
                 "' title " + quoted(modes[i]["name"]),
             block);
  }
  return draw("Errors by quantity", "errors", 60 + 40 * static_cast<int>(row), modes.size(), plot);
}

ComparisonChart energy_chart(const Json& figures) {
  Plot plot(
      "set grid ytics lc rgb '#e4e4e4' lw 1\nset xlabel 'simulated time (s)'\n"
      "set ylabel 'energy per mass ((D/T)^2)'\n");
  const Json& modes = figures["modes"];
  for (size_t i = 0; i < modes.size(); ++i) {
    const Json& energy = modes[i]["energy"];
    std::string block;
    for (size_t k = 0; k < energy.size(); ++k) {
      if (!energy[k].is_number()) continue;
      const double time_s = figures["simulated_s"].get<double>() * static_cast<double>(k + 1) /
                            static_cast<double>(energy.size());
      block += with_digits(time_s, 6) + " " + digits_of(energy[k]) + "\n";
    }
    plot.add("with lines lw 1.6 lc rgb '" + colour_of(i) + "' title " + quoted(modes[i]["name"]),
             block);
  }
  return draw("Energy of the first seed", "energy", 300, modes.size(), plot);
}

}  // namespace

std::vector<ComparisonChart> comparison_charts(const Json& figures) {
  const Json& modes = figures["modes"];
  return {pareto_chart(modes), overlap_chart(modes), error_chart(modes), energy_chart(figures)};
}

}  // namespace pilesim

#include "report/charts.h"

#include "core/gnuplot.h"
#include "core/text.h"

namespace pilesim {
namespace {

struct Series {
  std::string title;
  std::string style;  // of gnuplot: "with lines lw 2 lc rgb '#…'"
  std::vector<double> values;
};

std::string line_style(const char* colour) {
  return std::string("with lines lw 1.6 lc rgb '") + colour + "'";
}

std::string area_style(const char* colour) {
  return std::string("with filledcurves x1 lc rgb '") + colour + "'";
}

std::string draw(const std::string& y_label, const std::vector<double>& time_s,
                 const std::vector<Series>& series, bool logarithmic = false) {
  Plot plot(
      "set grid ytics lc rgb '#e4e4e4' lw 1\nset style fill solid 0.85 noborder\n"
      "set key outside right top reverse Left\nset xlabel 'simulated time (s)'\n" +
      std::string(logarithmic ? "set logscale y\n" : "set yrange [0:*]\n") + "set ylabel " +
      quoted(y_label) + "\n");
  for (const Series& one : series) {
    std::string rows;
    for (size_t i = 0; i < time_s.size(); ++i) {
      rows += with_digits(time_s[i], 6) + " " + with_digits(one.values[i], 6) + "\n";
    }
    plot.add(one.style + " title " + quoted(one.title), rows);
  }
  return draw_svg(plot.script(), 760, 300);
}

template <typename Value>
std::vector<double> column(const std::vector<FrameRow>& rows, const Value& value) {
  std::vector<double> values;
  for (const FrameRow& row : rows) values.push_back(static_cast<double>(value(row)));
  return values;
}

Chart time_chart(const std::vector<FrameRow>& rows, const std::vector<double>& time_s) {
  constexpr const char* kColours[] = {"#4c78a8", "#72b7b2", "#e45756",
                                      "#f2b155", "#9d755d", "#bab0ac"};
  // Stacked: draw from the highest sum down, so that each area covers the ones below it.
  std::vector<std::vector<double>> sums;
  std::vector<double> sum(rows.size(), 0);
  for (size_t stage = 0; stage <= kStageCount; ++stage) {
    for (size_t i = 0; i < rows.size(); ++i) {
      sum[i] +=
          1e3 * (stage < kStageCount ? rows[i].times.seconds[stage] : rows[i].times.other_s());
    }
    sums.push_back(sum);
  }
  std::vector<Series> series;
  for (size_t stage = kStageCount + 1; stage-- > 0;) {
    std::string name(stage < kStageCount ? stage_name(static_cast<Stage>(stage)) : "other");
    for (char& c : name) c = c == '_' ? ' ' : c;
    series.push_back({name, area_style(kColours[stage]), sums[stage]});
  }
  return {"Time per frame", draw("ms", time_s, series)};
}

}  // namespace

Chart line_chart(const std::string& title, const std::string& y_label,
                 const std::vector<double>& time_s, const std::vector<ChartLine>& lines) {
  constexpr const char* kColours[] = {"#4c78a8", "#e45756", "#54a24b",
                                      "#333333", "#f2b155", "#9467bd"};
  std::vector<Series> series;
  for (const ChartLine& line : lines) {
    series.push_back(
        {line.title, line_style(kColours[series.size() % std::size(kColours)]), line.values});
  }
  return {title, draw(y_label, time_s, series, true)};
}

std::vector<Chart> simulation_charts(const std::vector<FrameRow>& rows) {
  const auto time_s = column(rows, [](const FrameRow& row) { return row.time_s; });
  double lowest_j = 0;
  for (const FrameRow& row : rows) lowest_j = std::min(lowest_j, row.potential_energy_j);
  const auto kinetic = column(rows, [](const FrameRow& row) { return row.kinetic_energy_j; });
  const auto potential =
      column(rows, [&](const FrameRow& row) { return row.potential_energy_j - lowest_j; });
  const auto total = column(rows, [&](const FrameRow& row) {
    return row.kinetic_energy_j + row.potential_energy_j - lowest_j;
  });
  return {time_chart(rows, time_s),
          {"Bodies", draw("count", time_s,
                          {{"present", line_style("#4c78a8"),
                            column(rows, [](const FrameRow& row) { return row.bodies; })},
                           {"awake", line_style("#e45756"),
                            column(rows, [](const FrameRow& row) { return row.bodies_awake; })}})},
          {"Energy of the dynamic bodies", draw("J", time_s,
                                                {{"total", line_style("#333333"), total},
                                                 {"potential", line_style("#4c78a8"), potential},
                                                 {"kinetic", line_style("#e45756"), kinetic}})}};
}

}  // namespace pilesim

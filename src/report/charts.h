// The report's charts: SVG by gnuplot, embedded in the page.
#pragma once

#include <string>
#include <vector>

#include "report/report_writer.h"

namespace pilesim {

struct Chart {
  std::string title;
  std::string svg;  // an <svg> element
};

// Time by stage, bodies and contacts, energy, and penetration, over frames. Throws Error(io) if
// gnuplot is missing or fails.
std::vector<Chart> simulation_charts(const std::vector<FrameRow>& rows);

struct ChartLine {
  std::string title;
  std::vector<double> values;
};

// Lines over simulated time with a logarithmic y axis; `values` that are not positive are skipped.
// Throws Error(io) as above.
Chart line_chart(const std::string& title, const std::string& y_label,
                 const std::vector<double>& time_s, const std::vector<ChartLine>& lines);

}  // namespace pilesim

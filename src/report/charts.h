// The report's charts, drawn by gnuplot to SVG that stands inside a page.
#pragma once

#include <string>
#include <vector>

#include "report/report_writer.h"

namespace pilesim {

struct Chart {
  std::string title;
  std::string svg;  // an <svg> element
};

// Time by stage, bodies and contacts, energy, penetration, each over frames. Throws Error(io) where
// gnuplot is missing or fails.
std::vector<Chart> simulation_charts(const std::vector<FrameRow>& rows);

}  // namespace pilesim

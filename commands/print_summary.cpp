#include "print_summary.h"

#include "core/counted.h"
#include "print.h"

namespace pilesim {

void print_summary(const std::string& output, const SimulationSummary& summary) {
  for (const std::string& line : summary.warnings) warn(line);
  if (summary.was_complete) {
    print("%s: the run is complete; nothing was left to do\n", output.c_str());
    return;
  }
  for (const std::string& line : summary.beginning) print_line(line);
  for (const std::string& line : summary.collision_shapes) print_line(line);
  for (const std::string& line : summary.signatures) print_line(line);
  for (const std::string& line : summary.piles) print_line(line);
  print("%s: %s (%.2f s) of %s in %.1f s; %u awake at the end; deepest penetration %.2g m\n",
        output.c_str(), counted(summary.frames, "frame").c_str(), summary.simulated_s,
        counted(summary.bodies, "body", "bodies").c_str(), summary.wall_s, summary.awake_at_end,
        summary.deepest_penetration_m);
  const PileQuality& quality = summary.quality;
  if (summary.deepest_inspected_m) {
    print("in the frames inspected: deepest penetration of the shapes %.2g m\n",
          *summary.deepest_inspected_m);
  }
  print("at the end: penetration %.2g D, %llu unsettled, %llu escaped, %llu floating\n",
        quality.body_diameter_m > 0 ? quality.deepest_penetration_m / quality.body_diameter_m : 0,
        static_cast<unsigned long long>(quality.unsettled),
        static_cast<unsigned long long>(quality.escaped),
        static_cast<unsigned long long>(quality.floating));
}

}  // namespace pilesim

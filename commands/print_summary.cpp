#include "print_summary.h"

#include "core/counted.h"
#include "core/text.h"
#include "print.h"

namespace pilesim {
namespace {

// "0.012 D (0.0034 m)"
std::string depth_text(const PileQuality& quality) {
  const double depth_m = quality.deepest_penetration_m, diameter_m = quality.body_diameter_m;
  return with_digits(diameter_m > 0 ? depth_m / diameter_m : 0, 2) + " D (" +
         with_digits(depth_m, 2) + " m)";
}

}  // namespace

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
  print("%s: %s (%.2f s) of %s; it took %.1f s\n", output.c_str(),
        counted(summary.frames, "frame").c_str(), summary.simulated_s,
        counted_bodies(summary.bodies, summary.static_bodies, summary.kinematic_bodies).c_str(),
        summary.wall_s);
  if (summary.deepest_inspected) {
    print("of the frames inspected: deepest overlap %s, in frame %llu (%.2f s)\n",
          depth_text(summary.deepest_inspected->quality).c_str(),
          static_cast<unsigned long long>(summary.deepest_inspected->frame),
          static_cast<double>(summary.deepest_inspected->frame) / summary.frame_rate);
  }
  const PileQuality& quality = summary.quality;
  print("at the end: deepest overlap %s; of %s %llu unsettled, %llu escaped, %llu floating\n",
        depth_text(quality).c_str(), counted(quality.bodies, "body", "bodies").c_str(),
        static_cast<unsigned long long>(quality.unsettled),
        static_cast<unsigned long long>(quality.escaped),
        static_cast<unsigned long long>(quality.floating));
}

}  // namespace pilesim

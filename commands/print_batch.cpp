#include "print_batch.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "core/counted.h"
#include "print.h"

namespace pilesim {
namespace {

// A second, by the fastest servers of names that clusters share (docs/lab/batch.md).
constexpr double kMostFiles = 20'000;

// "2.5 h", "40 s".
std::string duration_text(double seconds) {
  char text[32];
  if (seconds < 120) {
    std::snprintf(text, sizeof text, "%.3g s", seconds);
  } else if (seconds < 7200) {
    std::snprintf(text, sizeof text, "%.3g min", seconds / 60);
  } else if (seconds < 3 * 86400) {
    std::snprintf(text, sizeof text, "%.4g h", seconds / 3600);
  } else {
    std::snprintf(text, sizeof text, "%.4g days", seconds / 86400);
  }
  return text;
}

std::string bytes_text(double bytes) {
  char text[32];
  if (bytes < 1e9) {
    std::snprintf(text, sizeof text, "%.3g MB", bytes / 1e6);
  } else if (bytes < 1e12) {
    std::snprintf(text, sizeof text, "%.4g GB", bytes / 1e9);
  } else {
    std::snprintf(text, sizeof text, "%.4g TB", bytes / 1e12);
  }
  return text;
}

// Three digits: "225,000", "7,640", "0.4".
std::string count_text(double count) {
  char text[32];
  if (count < 1000) {
    std::snprintf(text, sizeof text, "%.3g", count);
    return text;
  }
  const double digit = std::pow(10, std::floor(std::log10(count)) - 2);
  std::snprintf(text, sizeof text, "%.0f", std::round(count / digit) * digit);
  std::string grouped = text;
  for (size_t at = grouped.size(); at > 3; at -= 3) grouped.insert(at - 3, ",");
  return grouped;
}

void print_collected(const BatchSummary& summary) {
  const CollectionSummary& all = summary.collected;
  if (all.pictures > 0) {
    print("  coco.json: %s, %s\n", counted(all.pictures, "picture").c_str(),
          counted(all.annotations, "mask").c_str());
  }
  if (all.scenes > 0) {
    print("  bop: %s, %s\n", counted(all.scenes, "scene").c_str(),
          counted(all.models, "model").c_str());
  }
  if (all.tars > 0) {
    print("  tar: %s, %s of %s\n", counted(all.tars, "file").c_str(),
          counted(all.samples, "sample").c_str(), counted(all.packed, "job").c_str());
  }
}

}  // namespace

void print_forecast(const std::string& output, const BatchForecast& forecast) {
  print("%s: %s, %llu of them done, %llu to do\n", output.c_str(),
        counted(forecast.jobs, "job").c_str(), static_cast<unsigned long long>(forecast.done),
        static_cast<unsigned long long>(forecast.jobs - forecast.done));
  if (forecast.changed > 0) {
    print("  %s of another plan: made again with --force\n",
          counted(forecast.changed, "job is", "jobs are").c_str());
    for (const std::string& change : forecast.changes) print("    %s\n", change.c_str());
  }
  if (forecast.sample == 0 || forecast.jobs == forecast.done) return;
  print(
      "  by %s: %s of processor time (%s a job), %s here, %s of disk in %s files, %s of memory a "
      "job\n",
      counted(forecast.sample, "job that was measured", "jobs that were measured").c_str(),
      duration_text(forecast.processor_s).c_str(), duration_text(forecast.processor_s_each).c_str(),
      duration_text(forecast.wall_s).c_str(), bytes_text(forecast.bytes).c_str(),
      count_text(forecast.files).c_str(),
      bytes_text(static_cast<double>(forecast.peak_memory_bytes)).c_str());
}

void print_cluster(uint64_t nodes, uint64_t cores_each, const BatchForecast& forecast) {
  if (forecast.sample == 0 || forecast.jobs == forecast.done) return;
  const double cores = static_cast<double>(nodes * cores_each);
  const double to_do = static_cast<double>(forecast.jobs - forecast.done);
  // No job is shared.
  const double wall_s = std::ceil(to_do / cores) * forecast.processor_s_each;
  const double files = forecast.files / wall_s;
  print("  on %s of %s: %s; %s of memory a node; %s files and %s a second onto the shared disk\n",
        counted(nodes, "node").c_str(), counted(cores_each, "core").c_str(),
        duration_text(wall_s).c_str(),
        bytes_text(static_cast<double>(forecast.peak_memory_bytes * cores_each)).c_str(),
        count_text(files).c_str(), bytes_text(forecast.bytes / wall_s).c_str());
  if (files > kMostFiles) {
    print(
        "    more files than a shared disk makes, some thousands to %s a second: fewer are left\n"
        "    by coco in place of bop, tar files and \"drop_packed\" (docs/batch.md)\n",
        count_text(kMostFiles).c_str());
  }
}

void print_batch(const std::string& output, const BatchSummary& summary, bool has_run) {
  const uint64_t now = summary.done + summary.not_done() -
                       std::min(summary.of_before, summary.done + summary.not_done());
  print("%s: %llu of %s done", output.c_str(), static_cast<unsigned long long>(summary.done),
        counted(summary.jobs, "job").c_str());
  if (summary.of_before > 0) {
    print(", %llu of them by an earlier run", static_cast<unsigned long long>(summary.of_before));
  }
  if (summary.tried_again > 0) {
    print(", %llu tried again", static_cast<unsigned long long>(summary.tried_again));
  }
  if (summary.elsewhere > 0) {
    print(", %llu under way in another process",
          static_cast<unsigned long long>(summary.elsewhere));
  }
  print("; %s", duration_text(summary.wall_s).c_str());
  if (now > 0 && summary.wall_s > 0 && has_run) {
    print(", %.3g jobs a minute, %.0f %% of %s", 60 * static_cast<double>(now) / summary.wall_s,
          100 * summary.processor_s / summary.wall_s / summary.cores,
          counted(static_cast<unsigned>(summary.cores), "core").c_str());
  }
  print("\n");
  print_collected(summary);
}

}  // namespace pilesim

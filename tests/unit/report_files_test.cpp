#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <sstream>

#include "core/atomic_file.h"
#include "core/error.h"
#include "report/report_html.h"
#include "report/report_json.h"
#include "report/report_writer.h"
#include "report/verdict.h"
#include "support/small_disk.h"
#include "support/thrown_error.h"

namespace pilesim {
namespace {

using testing::HasSubstr;
using testing::Not;
namespace fs = std::filesystem;

// Ten frames that take 1 to 10 ms, half of it in the solver.
SimulationReport ten_frames() {
  SimulationReport report;
  report.command = "simulate";
  report.scene_name = "boxes <b>& \"spheres\"</b>";
  report.scene_file = "scene.json";
  report.changed_options = R"({"/seed": 3})";
  report.mode = "impulse";
  report.step_s = 1.0 / 240;
  report.frame_rate = 60;
  report.frames = 10;
  report.dynamic_bodies = 4;
  report.static_bodies = 1;
  report.collision_shapes = {"box: exact"};
  for (uint64_t i = 0; i < 10; ++i) {
    FrameRow row;
    row.frame = i;
    row.time_s = static_cast<double>(i) / 60;
    row.steps = i == 0 ? 0 : 4;
    row.times.total_s = 1e-3 * static_cast<double>(i + 1);
    row.times.seconds[static_cast<size_t>(Stage::solver)] = row.times.total_s / 2;
    row.bodies = 4;
    row.bodies_awake = 9 - static_cast<uint32_t>(i);
    row.kinetic_energy_j = 1.0 / static_cast<double>(i + 1);
    report.rows.push_back(row);
  }
  return report;
}

TEST(ReportJson, AddsUpWhatTheFramesSay) {
  const nlohmann::ordered_json figures = report_json(ten_frames());
  EXPECT_EQ(figures["counts"]["frames"], 10);
  EXPECT_EQ(figures["counts"]["steps"], 36);
  EXPECT_EQ(figures["counts"]["dynamic_bodies"], 4);
  EXPECT_EQ(figures["counts"]["static_bodies"], 1);
  EXPECT_EQ(figures["settled"], true);
  // Frame 0 is the scene's initial state: its cost belongs to the setup, not to the simulation.
  const auto& stages = figures["time"]["stages"];
  EXPECT_NEAR(stages["solver"]["total_s"].get<double>(), 0.027, 1e-12);
  EXPECT_NEAR(stages["other"]["total_s"].get<double>(), 0.027, 1e-12);
  EXPECT_NEAR(stages["all"]["total_s"].get<double>(), 0.054, 1e-12);
}

TEST(ReportJson, HasSettledWhereItsJudgeFindsAllAtRest) {
  SimulationReport report = ten_frames();
  EXPECT_EQ(report_json(report)["settled"], true);
  report.quality.unsettled = 1;
  EXPECT_EQ(report_json(report)["settled"], false);
}

// One figure of each kind: the judge's, with its moment. The solver's view of its own contacts and
// the sleeping bodies are absent.
TEST(ReportJson, TellsTheFiguresOfTheJudgeWithTheirMoment) {
  SimulationReport report = ten_frames();
  report.quality = {.bodies = 4, .deepest_penetration_m = 0.1, .body_diameter_m = 0.5};
  report.inspections = {
      {.frame = 0, .quality = {.deepest_penetration_m = 0.02}},
      {.frame = 3, .quality = {.deepest_penetration_m = 0.2, .body_diameter_m = 0.5}},
      {.frame = 6, .quality = {.deepest_penetration_m = 0.2, .body_diameter_m = 0.5}}};
  const nlohmann::ordered_json figures = report_json(report);
  EXPECT_EQ(figures["quality_at_end"]["frame"], 9);
  EXPECT_DOUBLE_EQ(figures["quality_at_end"]["time_s"], 0.15);
  EXPECT_DOUBLE_EQ(figures["quality_at_end"]["deepest_penetration_diameters"], 0.2);
  EXPECT_EQ(figures["quality_of_run"]["frame"], 3);
  EXPECT_DOUBLE_EQ(figures["quality_of_run"]["time_s"], 0.05);
  EXPECT_DOUBLE_EQ(figures["quality_of_run"]["deepest_penetration_diameters"], 0.4);
  EXPECT_EQ(figures["quality_of_run"]["frames"].size(), 3);
  EXPECT_FALSE(figures.contains("penetration"));
  for (const char* key : {"awake_at_end", "contacts_at_end", "bodies_present"}) {
    EXPECT_FALSE(figures["counts"].contains(key)) << key;
  }
}

TEST(ReportJson, IsReadAsItWasWrittenInItsOwnVersionOnly) {
  const fs::path directory = fs::path(testing::TempDir()) / "pilesim_read_report";
  fs::create_directories(directory);
  const fs::path file = directory / "report.json";
  SimulationReport report = ten_frames();
  report.setup_s = 0.25;
  report.cpu_s = 1.5;
  report.peak_memory_bytes = 12345;
  report.quality = {.bodies = 4,
                    .overlapping_pairs = 3,
                    .deepest_penetration_m = 0.1,
                    .mean_penetration_m = 0.0625,
                    .largest_gap_m = 0.25,
                    .mean_gap_m = 0.125,
                    .unsettled = 2,
                    .escaped = 1,
                    .floating = 5,
                    .body_diameter_m = 0.3};
  nlohmann::ordered_json figures = report_json(report);
  write_file_atomically(file, figures.dump());
  const ReportedRun run = read_report(file);
  EXPECT_EQ(run.setup_s, 0.25);
  EXPECT_EQ(run.cpu_s, 1.5);
  EXPECT_EQ(quality_json(run.quality), quality_json(report.quality));
  EXPECT_EQ(run.steps, 36);
  EXPECT_EQ(run.peak_memory_bytes, 12345);
  EXPECT_NEAR(run.times.of(Stage::solver), 0.027, 1e-12);
  EXPECT_NEAR(run.times.total_s, 0.054, 1e-12);
  EXPECT_EQ(run.collision_shapes, report.collision_shapes);
  const auto refused = [&](const nlohmann::ordered_json& changed) {
    write_file_atomically(file, changed.dump());
    return test::error_text([&] { read_report(file); }, ErrorKind::input);
  };
  figures["format_version"] = 1;
  EXPECT_THAT(refused(figures), HasSubstr(R"(is "pilesim report" of version 1)"));
  figures["format_version"] = 2;
  figures["time"].erase("cpu_s");
  EXPECT_THAT(refused(figures), HasSubstr("cpu_s"));
  fs::remove_all(directory);
}

TEST(TimingCsvTest, HasAColumnForEachNumberAndARowForEachFrame) {
  const fs::path file = fs::path(testing::TempDir()) / "pilesim_timing.csv";
  const SimulationReport report = ten_frames();
  {
    TimingCsv csv(file);
    for (const FrameRow& row : report.rows) csv.append(row);
  }
  std::istringstream lines(read_file(file));
  std::string line;
  ASSERT_TRUE(std::getline(lines, line));
  const auto columns = std::ranges::count(line, ',');
  EXPECT_THAT(line, testing::StartsWith("frame,time_s,steps,total_ms,broad_phase_ms"));
  for (size_t i = 0; i < report.rows.size(); ++i) {
    ASSERT_TRUE(std::getline(lines, line));
    EXPECT_EQ(std::ranges::count(line, ','), columns);
    EXPECT_THAT(line, testing::StartsWith(std::to_string(i) + ","));
  }
  EXPECT_FALSE(std::getline(lines, line));
  fs::remove(file);
}

TEST(TimingCsvTest, AFullDiskCutsNoRow) {
  test::on_a_small_disk(64 << 10, [](const test::SmallDisk& disk) {
    const fs::path file = disk.directory / "timing.csv";
    TimingCsv csv(file);
    const FrameRow row = ten_frames().rows.back();
    size_t rows = 0;
    const auto fill = [&] {
      for (; rows < 5000; ++rows) csv.append(row);
    };
    EXPECT_THROW(fill(), Error);
    EXPECT_GT(rows, 100u);
    const auto whole_rows = [&] {
      const std::string text = read_file(file);
      EXPECT_TRUE(text.ends_with('\n'));
      EXPECT_EQ(text.find('\0'), text.npos);  // no gap either
      const auto lines = std::ranges::count(text, '\n');
      EXPECT_EQ(std::ranges::count(text, ','),
                lines * std::ranges::count(text.substr(0, text.find('\n')), ','));
      return static_cast<size_t>(lines) - 1;
    };
    EXPECT_EQ(whole_rows(), rows);
    disk.make_room();
    csv.append(row);
    EXPECT_EQ(whole_rows(), rows + 1);
  });
}

TEST(PeakMemory, GrowsWithWhatIsUsedAndStays) {
  constexpr size_t kBytes = 200 << 20;
  const uint64_t before = peak_memory_bytes();
  EXPECT_GT(before, 1u << 20);
  {
    const std::vector<char> used(kBytes, 1);
    EXPECT_EQ(used[kBytes / 2], 1);
  }
  EXPECT_GT(peak_memory_bytes(), kBytes);
  EXPECT_LT(peak_memory_bytes(), before + 2 * kBytes);
}

TEST(ReportPage, StandsAloneAndEscapesNames) {
  const fs::path directory = fs::path(testing::TempDir()) / "pilesim_report";
  fs::create_directories(directory);
  write_report(ten_frames(), directory);
  const std::string page = read_file(directory / "report.html");
  EXPECT_THAT(page, Not(HasSubstr("<b>& ")));
  EXPECT_THAT(page, HasSubstr("&lt;b&gt;&amp;"));
  EXPECT_THAT(page, HasSubstr("<svg"));
  for (const char* outside : {"src=\"http", "href=\"http", "<link", "<script src"}) {
    EXPECT_THAT(page, Not(HasSubstr(outside)));
  }
  const auto figures = nlohmann::ordered_json::parse(read_file(directory / "report.json"));
  EXPECT_EQ(figures["scene"]["name"], ten_frames().scene_name);
  fs::remove_all(directory);
}

// Figures of a pile in a guide.
nlohmann::ordered_json guided_figures(double inside, double filled, double filled_at_start) {
  SimulationReport report = ten_frames();
  report.quality.bodies = 4;
  report.quality.body_diameter_m = 0.5;
  const nlohmann::ordered_json part = {
      {"part", 2}, {"part_share", 0.6}, {"what", "the lower 60 % of part 2 is empty: too narrow"}};
  auto empty = nlohmann::ordered_json::array();
  if (filled_at_start < 0.85) empty.push_back(part);
  report.piles =
      nlohmann::ordered_json{
          {"guide",
           {{"bodies_inside", inside},
            {"filled_share", filled},
            {"outline_moved_m", 0.02},
            {"filling", {{"kept", 4}, {"filled_share", filled_at_start}, {"empty", empty}}}}}}
          .dump();
  return report_json(report);
}

TEST(ReportVerdict, KnowsTheGuide) {
  const Verdict kept = verdict(guided_figures(0.99, 0.97, 0.98));
  EXPECT_TRUE(kept.good);
  EXPECT_EQ(kept.headline, "At rest and sound");
  EXPECT_EQ(kept.sentences.front(),
            "99 % of the bodies are inside the guide at the end, and 97 % of it is filled (98 % at "
            "the start); the pile&rsquo;s outline has moved by 20 mm.");
  const Verdict out = verdict(guided_figures(0.18, 0.3, 0.98));
  EXPECT_FALSE(out.good);
  EXPECT_THAT(out.headline, HasSubstr("the guide&rsquo;s shape is lost"));
  // A flat heap may be inside a wide guide.
  EXPECT_FALSE(verdict(guided_figures(1, 0.3, 0.98)).good);
  const Verdict empty = verdict(guided_figures(1, 0.7, 0.7));
  EXPECT_FALSE(empty.good);
  EXPECT_THAT(empty.headline, HasSubstr("the guide is not full"));
  EXPECT_THAT(empty.sentences[1], HasSubstr("the lower 60 % of part 2 is empty: too narrow"));
}

TEST(ReportPage, FiguresOfAGuideAreTables) {
  const std::string page = report_html(guided_figures(1, 0.7, 0.7), {}, "");
  EXPECT_THAT(page, HasSubstr("<tr><td>bodies inside</td><td class=\"n\">100 %</td></tr>"));
  EXPECT_THAT(page, HasSubstr("<h3>filling</h3>"));
  EXPECT_THAT(page, HasSubstr("<tr><td>kept</td><td class=\"n\">4</td></tr>"));
  EXPECT_THAT(page, HasSubstr("<h3>empty</h3>"));
  EXPECT_THAT(page, HasSubstr("<th class=\"n\">part share</th>"));
  EXPECT_THAT(page, Not(HasSubstr("kept 4"))) << "as one run of keys";
}

}  // namespace
}  // namespace pilesim

// Shared by the reports of all runs.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "finish/finished_pile.h"
#include "model/model.h"
#include "report/quality_gate.h"
#include "report/report_writer.h"
#include "scene/scene_loader.h"
#include "simulate/simulator.h"

namespace pilesim {

// Fills in everything known before the run.
SimulationReport begin_report(const std::string& command, const std::filesystem::path& scene_file,
                              const LoadedScene& loaded, const Model& model);

// `bodies`: number of dynamic bodies present.
FrameRow make_row(uint64_t frame, double time_s, const FrameStatistics& statistics,
                  uint32_t bodies);
uint32_t count_present(const Model& model, const BodyStates& states);

// JSON object: how many joints there are, how many of them have broken, which and when; empty
// without joints. `broke_at`: as in RunProgress.
std::string joint_figures(const Scene& scene, const Model& model,
                          const std::vector<uint32_t>& broken,
                          const std::vector<uint64_t>& broke_at);

// Adds the figures of finishing, and its time to the last frame, which then describes the final
// pile. Call it after the final quality is set.
void take_finish(FinishedPile& pile, SimulationReport& report);

// Throws Error(quality) naming `output` if a gate failed.
void throw_failed_gates(const std::filesystem::path& output,
                        const std::vector<GateResult>& results);
// The same for a run that was already complete, from its report. Throws as read_report() does, if
// there are gates.
void require_gates(const std::filesystem::path& output, const std::vector<QualityGate>& gates);

}  // namespace pilesim

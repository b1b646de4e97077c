// The common part of the reports of all runs.
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

// With what is known before the run.
SimulationReport begin_report(const std::string& command, const std::filesystem::path& scene_file,
                              const LoadedScene& loaded, const Model& model);

// `bodies` are the dynamic ones that are present.
FrameRow make_row(uint64_t frame, double time_s, const FrameStatistics& statistics,
                  uint32_t bodies);
uint32_t count_present(const Model& model, const BodyStates& states);

// The figures of finishing. Its time goes to the last frame, which then tells of the pile as it
// lies in the end. After the quality of the end.
void take_finish(FinishedPile& pile, SimulationReport& report);

// Throws Error(quality), naming `output`, where one has not passed.
void throw_failed_gates(const std::filesystem::path& output,
                        const std::vector<GateResult>& results);
// The same for a run that was complete before, by the figures of its report. Throws as
// read_report() does, where there are gates.
void require_gates(const std::filesystem::path& output, const std::vector<QualityGate>& gates);

}  // namespace pilesim

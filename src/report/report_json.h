// The figures of a simulation as JSON, in a fixed order.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "report/report_writer.h"

namespace pilesim {

// `report` has rows.
nlohmann::ordered_json report_json(const SimulationReport& report);

nlohmann::ordered_json quality_json(const PileQuality& quality);

}  // namespace pilesim

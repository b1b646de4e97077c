// Estimates a response table from measurements: means, spreads, errors and exemplars.
#pragma once

#include <cstdint>
#include <span>

#include "signature/table/response_table.h"
#include "signature/table/table_fit.h"

namespace pilesim {

// The table of `responses`, in the units of its layout, from their `fit` over `axes`; `empty` has
// the table's axes. Cells without trials have zeros.
ResponseTable estimated_table(const ResponseTable& empty, std::span<const Axis> axes,
                              const Measurements& responses, const TableFit& fit,
                              uint32_t exemplars);

}  // namespace pilesim

// The measurements of the bench as tables for people.
#pragma once

#include <taut/apps/bench/elastic.hpp>

namespace taut {

/// Rates of the machine per number of threads.
std::string machine_table(std::vector<MachineRates> const& machines);

/// Those; the counts; a line per material, precision and size;
/// the variants.
std::string bench_tables(std::vector<BenchRow> const& rows,
                         std::vector<MachineRates> const& machines);

}  // namespace taut

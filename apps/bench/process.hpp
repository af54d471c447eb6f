// Kokkos fixes its number of threads at its start, so a bench measures each number in a process of
// its own.
#pragma once

#include <taut/apps/bench/machine.hpp>

#include <nlohmann/json_fwd.hpp>

#include <functional>
#include <string>
#include <string_view>
#include <vector>

namespace taut {

/// Starts Kokkos with `threads` threads in a child process, measures the machine there (`seconds`
/// for each rate) and calls `measure`; returns what that made. Kokkos must not have been started.
/// Throws Error where the process ends early; `smaller` says what to ask for then.
nlohmann::json measure_in_process(int threads, double seconds, std::string_view smaller,
                                  std::function<nlohmann::json(MachineRates const&)> const& measure,
                                  MachineRates& machine);

/// One, and as many as there are; or what was asked for.
std::vector<int> bench_threads(std::vector<int> const& asked);

/// Throws Error for a word that is not known.
void require_known(char const* option, std::vector<std::string> const& words,
                   std::vector<std::string_view> const& known);

}  // namespace taut

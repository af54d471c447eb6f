// Loops of Kokkos on the host, compiled once.
//
// Kokkos instantiates its loop, with the names and the branches that belong to it, for each functor
// anew: some two kilobytes of code and a good part of the compile time of a kernel that is itself a
// line. On the host a loop therefore takes the functor behind a function that runs a range of it.
// What is left per kernel is that range; Kokkos sees one iteration per thread.
#pragma once

#include <taut/core/exec/space.hpp>

#include <cstdint>
#include <string>

namespace taut::kernels {

/// Calls `functor(i)` for i in [first, last).
using RangeFunction = void (*)(void const* functor, int first, int last);

/// Adds the terms of [first, last) to `sum`; writes the sum before each where `write` says so.
using ScanFunction = void (*)(void const* functor, int first, int last, std::int64_t& sum,
                              bool write);

template <class Functor>
void run_range(void const* functor, int first, int last) {
  auto const& body = *static_cast<Functor const*>(functor);
  for (int i = first; i < last; ++i) body(i);
}

/// Calls `functor(team)`.
template <class Execution>
using TeamFunction = void (*)(void const* functor,
                              typename Kokkos::TeamPolicy<Execution>::member_type const& team);

template <class Execution, class Functor>
void run_team(void const* functor,
              typename Kokkos::TeamPolicy<Execution>::member_type const& team) {
  (*static_cast<Functor const*>(functor))(team);
}

/// Runs [0, n) in as many ranges as there are threads, as Kokkos's static schedule would.
template <class Execution>
void host_loop(Execution const& execution, std::string const& label, int n, RangeFunction run,
               void const* functor);

/// The same for a prefix sum; returns the sum of all.
template <class Execution>
std::int64_t host_scan(Execution const& execution, std::string const& label, int n,
                       ScanFunction run, void const* functor);

/// A loop over teams.
template <class Execution>
void host_team_loop(Kokkos::TeamPolicy<Execution> const& policy, std::string const& label,
                    TeamFunction<Execution> run, void const* functor);

}  // namespace taut::kernels

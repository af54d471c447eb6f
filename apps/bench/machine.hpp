// What the machine can do at most: memory bandwidth by the triad of McCalpin's STREAM, arithmetic
// by chains of fused multiply-adds that stay in registers.
#pragma once

#include <taut/core/report/timer.hpp>

#include <algorithm>
#include <limits>

namespace taut {

struct MachineRates {
  int threads = 0;
  double triad = 0;  ///< GB/s of a_i = b_i + s c_i, counted as 24 bytes per i
  double fma32 = 0;  ///< GFLOP/s, a multiply-add counted as two
  double fma64 = 0;
};

/// With the threads that Kokkos was started with; takes about `seconds` for each number.
MachineRates measure_machine(double seconds);

/// The least time of a call of `run`, s: of at least two calls, and of as many as fit into
/// `seconds`. What disturbs a measurement only ever adds to it.
template <class Run>
double best_seconds(double seconds, Run const& run) {
  double best = std::numeric_limits<double>::infinity();
  Timer const all;
  for (int k = 0; k < 2 || all.seconds() < seconds; ++k) {
    Timer const one;
    run();
    best = std::min(best, one.seconds());
  }
  return best;
}

}  // namespace taut

// `taut bench elastic`: what a sweep over the tets costs, against what this machine can do at most.
#pragma once

#include <taut/apps/bench/machine.hpp>

#include <string>
#include <vector>

namespace taut {

struct BenchOptions {
  std::vector<std::string> materials;                   ///< empty: all models
  std::vector<std::string> precisions{"fp32", "fp64"};  ///< of fp32, mixed, fp64
  std::vector<int> tets{50'000, 500'000, 2'000'000};    ///< about so many
  std::vector<int> threads;                             ///< empty: one, and all
  double seconds = 0.4;                                 ///< spent on each number
  bool json = false;                                    ///< a list of rows instead of tables
  bool quick = false;                                   ///< a small mesh and hasty numbers
};

/// One measured number.
struct BenchRow {
  std::string material;  ///< "-" where no material is involved
  std::string precision;
  int threads = 0;
  int tets = 0;
  std::string kernel;     ///< "gradient", "quadratic_form", "iteration"; see variants.hpp
  double ns_per_tet = 0;  ///< the least of all repetitions
  double bytes = 0;       ///< per tet, see counts.hpp
  double flops = 0;       ///< per tet
  double fraction = 0;    ///< of the smaller of both limits
  double held = 0;        ///< with "iteration": bytes per tet in fields and tables of the solver
  double resident = 0;  ///< with "iteration": growth of the process' resident memory, bytes per tet
  int allocations = 0;  ///< with "iteration": of fields, in all iterations after the first
};

/// Measures with the threads that Kokkos was started with.
std::vector<BenchRow> measure_elastic(BenchOptions const& options, MachineRates const& machine);

/// One JSON object per row, in a list.
std::string to_json(std::vector<BenchRow> const& rows);

/// Measures in a process of its own per number of threads, so Kokkos must not have been started.
/// Throws Error.
int bench_command(BenchOptions const& options);

}  // namespace taut

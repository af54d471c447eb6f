// `taut bench hot`: what a step of material points is made of, against what this machine can do at
// most: a cube of fixed corotated material, eight particles in a cell, strained and turned.
//
// Per particle:
//   rebuild           sorting, topology of the grid, mass and momentum to it
//   to_grid           the last of these alone
//   to_particles      velocities back, F, positions
//   change            the energy's change along a direction
//   gradient, gradient_blocks, quadratic_form    as a nonlinear CG takes them
//   linearise         the 45 numbers of each particle's part of the Hessian, projected
//   product           the Hessian from these times a vector
//   linearise_fp32, product_fp32    the same in floats, as the default cycle has them
//   assembly          the fine matrix from these
// Per node of a level, for the default cycle and HOT's ("hot"):
//   hierarchy         all of it, from the positions of the nodes on
//   smoother          before and after the coarser level, of each level
//   cycle             a V-cycle, and per 3x3 block of the fine level
#pragma once

#include <taut/apps/bench/machine.hpp>

#include <nlohmann/json_fwd.hpp>

#include <string>
#include <vector>

namespace taut {

struct HotBenchOptions {
  std::vector<int> cells{16, 32};  ///< along an edge of the cube
  std::vector<int> threads;        ///< empty: one, and all
  double seconds = 0.3;            ///< spent on each number
  bool json = false;               ///< a list instead of tables
  bool quick = false;              ///< a small grid and haste
};

/// One measured number.
struct HotRow {
  std::string cycle;  ///< "", "default" or "hot"
  std::string kernel;
  std::string per = "particle";  ///< or "node", "block"
  int level = 0;                 ///< 0: the finest
  int threads = 0;
  int cells = 0, particles = 0, nodes = 0;  ///< nodes of the level
  double ns = 0;                            ///< per particle, node or block
  double bytes = 0, flops = 0;  ///< the same, that the work cannot do without; 0: not counted
  double fraction = 0;          ///< of the smaller limit
  double held = 0;              ///< with "hierarchy": bytes per fine node
};

/// Measures with the threads that Kokkos was started with.
std::vector<HotRow> measure_hot(HotBenchOptions const& options, MachineRates const& machine);

nlohmann::json to_json(std::vector<HotRow> const& rows);
std::vector<HotRow> hot_rows(nlohmann::json const& list);

/// The machine, and per number of threads a line per kernel, a column per size.
std::string hot_tables(std::vector<HotRow> const& rows, std::vector<MachineRates> const& machines);

/// Measures in a process of its own per number of threads, so Kokkos must not have been started.
/// Throws Error.
int bench_hot_command(HotBenchOptions const& options);

}  // namespace taut

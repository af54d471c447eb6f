// `taut bench contact`: what contact costs in an iteration of a step, against what this machine can
// do at most and against the elastic work of the same bodies.
//
//   search_hash, search_bvh   all pairs whose boxes overlap (PairSearch)
//   renewal                   what a contact term does when its candidates have to be found anew:
//                             for energies and for bounds together
//   features                  the closest points of all candidates
//   gradient, gradient_diagonal, gradient_blocks, quadratic_form    as the term does them
//   max_step                  as the term does it: candidates proved complete, additive CCD
//   additive_ccd, pairwise, half_dhat, planar, isotropic    bounds of the candidates of max_step
//   elastic                   gradient, diagonal and p'Hp of the elastic term
//   iteration                 of PNCG, with all searches that a step of `iterations` needs
#pragma once

#include <taut/apps/bench/machine.hpp>

#include <string>
#include <vector>

namespace taut {

struct ContactBenchOptions {
  std::vector<std::string> precisions{"mixed", "fp64"};        ///< of mixed, fp64
  std::vector<int> contacts{1'000, 10'000, 100'000, 300'000};  ///< about so many
  std::vector<int> threads;                                    ///< empty: one, and all
  int iterations = 30;                                         ///< of a step
  double seconds = 0.2;                                        ///< spent on each number
  bool json = false;                                           ///< a list instead of tables
  bool quick = false;                                          ///< a small scene and haste
};

/// One measured number.
struct ContactRow {
  std::string precision;
  int threads = 0;
  std::string kernel;
  int asked = 0;       ///< contacts
  int contacts = 0;    ///< pairs that act
  int candidates = 0;  ///< pairs that a search within the same radius finds, by boxes
  int kept = 0;        ///< of those, pairs that energies are computed of
  int tets = 0;
  double seconds = 0;       ///< the least of all repetitions
  double bytes = 0;         ///< that the work must move, see contact_counts.hpp
  double flops = 0;         ///< that it must do
  double fraction = 0;      ///< of the smaller of both limits; 0 where nothing was counted
  double held = 0;          ///< with "iteration": bytes in arrays of the contact term
  double peak = 0;          ///< with "iteration": the same, at most so far
  double searches = 0;      ///< with "iteration": through the whole surface, per iteration
  double search_share = 0;  ///< with "iteration": of all that finds candidates
  double bound_share = 0;   ///< with "iteration": of step bounds
  int allocations = 0;      ///< with "iteration": in all iterations of a second step
};

/// Measures with the threads that Kokkos was started with. Throws Error for an unknown precision.
std::vector<ContactRow> measure_contact(ContactBenchOptions const& options,
                                        MachineRates const& machine);

/// One JSON object per row, in a list; and back.
std::string to_json(std::vector<ContactRow> const& rows);
std::vector<ContactRow> contact_rows(std::string const& json);

/// The machine, and per precision and number of threads a line per kernel, a column per size.
std::string contact_tables(std::vector<ContactRow> const& rows,
                           std::vector<MachineRates> const& machines);

/// Measures in a process of its own per number of threads, so Kokkos must not have been started.
/// Throws Error.
int bench_contact_command(ContactBenchOptions const& options);

}  // namespace taut

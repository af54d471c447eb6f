// What choices of the library cost, measured against their alternatives:
//
//   dots / dots_free                   five scalar products with sums in a fixed order, and in any
//   gradient / gradient_atomic         forces gathered in a fixed order, and added up by atomics
//   quadratic_pack / quadratic_loop    p'Hp of data in cache: Kokkos' SIMD packs, and a plain loop
//                                      over the lanes of a pack that the compiler vectorises
#pragma once

#include <taut/apps/bench/counts.hpp>
#include <taut/apps/bench/elastic.hpp>

namespace taut {

/// The time that the machine needs at least, ns per tet: for the bytes or for the flops.
double limit_ns(MachineRates const& machine, std::string_view precision, SweepCounts const& counts);

/// Appends a row per variant and precision, with the stable neo-Hookean model on the mesh nearest
/// to 500 000 tets. "gradient" is that of measure_elastic. `tets` of the dots are tets per vertex
/// times their length, so that numbers compare.
void measure_variants(BenchOptions const& options, MachineRates const& machine,
                      std::vector<BenchRow>& rows);

}  // namespace taut

// Bytes and flops that the work on a particle cannot do without, in fp64, for fixed corotated
// material and quadratic B-splines: the measure that `taut bench hot` compares its times with.
//
// Bytes, as for an ideal cache: what is read and written of a particle, once each, and what is read
// and written of a node, once each, shared by the particles per node. Flops as in counts.hpp, with
// sums over the 27 nodes of a particle taken axis by axis: 162 for the value of a 3-vector field,
// 558 for its value and gradient, and the same for their transposes.
#pragma once

#include <taut/apps/bench/counts.hpp>

namespace taut {

/// Of `kernel` (hot.hpp), per particle, with `particles` of them to a node. Zero for what is not
/// counted.
SweepCounts count_particles(std::string_view kernel, double particles);

}  // namespace taut

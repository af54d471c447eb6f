// What a preconditioner P, of whatever room, tells the minimiser that uses it: when it is to be
// rebuilt, and whether it is one small matrix per unknown, which the minimiser applies in passing.
#pragma once

#include <taut/core/exec/space.hpp>
#include <taut/core/math/matrix.hpp>

#include <limits>

namespace taut {

/// When P is rebuilt during a minimisation; it always is at the first iterate. A rebuild does not
/// restart the direction.
struct Refresh {
  int interval = 1;  ///< rebuilt at every so many iterates,
  /// or once the step length has fallen below the longest since the last rebuild by this factor.
  double trigger = std::numeric_limits<double>::infinity();

  static Refresh lagged(int iterations) { return {.interval = iterations}; }
  static Refresh rarely() { return {.interval = 30, .trigger = 10}; }
};

/// One symmetric matrix per unknown: 3x3 blocks, or diagonals, or where both fields are empty the
/// identity. The gradient sweep fills it with curvature, `update` of its owner inverts it.
template <class P, class S>
struct LocalMatrices {
  using Real = typename P::real;
  VectorField<Real, S> diagonal;
  BlockField<Real, S> blocks;

  bool empty() const { return diagonal.extent(0) == 0 && blocks.extent(0) == 0; }

  KOKKOS_FUNCTION Vec3<Real> product(int i, Vec3<Real> const& v) const {
    if (blocks.extent(0) > 0) {
      return Sym3<Real>{{blocks(i, 0), blocks(i, 1), blocks(i, 2), blocks(i, 3), blocks(i, 4),
                         blocks(i, 5)}} *
             v;
    }
    if (diagonal.extent(0) > 0) {
      return {diagonal(i, 0) * v[0], diagonal(i, 1) * v[1], diagonal(i, 2) * v[2]};
    }
    return v;
  }
};

}  // namespace taut

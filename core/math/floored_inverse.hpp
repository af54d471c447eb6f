// Inverse of a symmetric 3x3 block whose eigenvalues are first raised to a floor.
#pragma once

#include <taut/core/math/symmetric_eigen.hpp>

namespace taut {

/// Inverse of A with its eigenvalues raised to `relative` times the largest, to `absolute`, and to
/// what T can hold the inverse of. A that is zero (or not positive at all) and has no absolute
/// floor gives the identity. In fp64 whatever T, because a stiff contact leaves blocks that fp32
/// cannot invert.
template <class T>
KOKKOS_FUNCTION Sym3<T> floored_inverse(Sym3<T> const& A, double relative, double absolute) {
  double const scale = double(A.s[0]) + double(A.s[1]) + double(A.s[2]);
  if (!(scale > 0)) {
    T const one = absolute > 0 ? T(1 / absolute) : T(1);
    return {{one, one, one, 0, 0, 0}};
  }
  constexpr double tiny = 4 * double(Kokkos::Experimental::norm_min_v<T>);
  absolute = Kokkos::max(absolute, tiny);
  double const unit = 1 / Kokkos::max(scale, tiny);
  Sym3<double> inverse;
  for (int k = 0; k < 6; ++k) inverse.s[k] = unit * double(A.s[k]);
  absolute *= unit;
  Mat3<double> const a = to_matrix(inverse), adjugate = cofactor(a);
  double const det = dot(a.column(0), adjugate.column(0));
  // 1 / trace(A^-1) is a lower bound of the smallest eigenvalue, and at least a third of it; that
  // both factors exceed the least one keeps Cramer's rule far from round-off.
  double const least = Kokkos::max(1e-10, Kokkos::max(relative, absolute));
  if (trace(adjugate) > least && det > least * trace(adjugate)) {
    inverse = symmetric_part((1 / det) * adjugate);
  } else {
    SymmetricEigen<double> eigen = symmetric_eigen(inverse);
    double const floor = Kokkos::max(relative * eigen.values[0], absolute);
    for (int k = 0; k < 3; ++k) eigen.values[k] = 1 / Kokkos::max(eigen.values[k], floor);
    inverse = eigen.compose();
  }
  Sym3<T> result;
  for (int k = 0; k < 6; ++k) result.s[k] = T(unit * inverse.s[k]);
  return result;
}

}  // namespace taut

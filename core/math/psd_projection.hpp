// The nearest positive semi-definite matrix in the Frobenius norm: negative eigenvalues of a
// symmetric matrix are raised to a floor,
//
//   A + Sum_k max(floor - lambda_k, 0) v_k v_k^T,
//
// which leaves a matrix that needs no projection untouched to the last bit.
#pragma once

#include <taut/core/math/symmetric_eigen.hpp>

namespace taut {

/// 3x3; T may be a pack. `floor` is in the units of A.
template <class T>
KOKKOS_INLINE_FUNCTION Sym3<T> project_psd(Sym3<T> const& a, T const& floor = T(0)) {
  SymmetricEigen<T> e = symmetric_eigen(a);
  for (int k = 0; k < 3; ++k) e.values[k] = max(floor - e.values[k], T(0));
  Sym3<T> r = e.compose();
  for (int k = 0; k < 6; ++k) r.s[k] = a.s[k] + r.s[k];
  return r;
}

/// N x N; both triangles are read and written.
template <class T, int N>
KOKKOS_INLINE_FUNCTION SquareMatrix<T, N> project_psd(SquareMatrix<T, N> const& a,
                                                      T const& floor = T(0)) {
  SquareEigen<T, N> const e = symmetric_eigen(a);
  SquareMatrix<T, N> r = a;
  for (int k = 0; k < N; ++k) {
    T const raise = max(floor - e.values[k], T(0));
    for (int j = 0; j < N; ++j) {
      T const weight = raise * e.vectors(j, k);
      for (int i = 0; i < N; ++i) r(i, j) = r(i, j) + weight * e.vectors(i, k);
    }
  }
  return r;
}

}  // namespace taut

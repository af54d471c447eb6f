// The nearest positive semi-definite matrix in the Frobenius norm: negative eigenvalues of a
// symmetric matrix are raised to a floor,
//
//   Sum_k max(lambda_k, floor) v_k v_k^T.
//
// A matrix without an eigenvalue below the floor is returned as it is, to the last bit. Of any
// other the sum is formed afresh: adding (floor - lambda_k) v_k v_k^T to A would cancel, and leave
// negative eigenvalues where |lambda_k| dwarfs the others.
#pragma once

#include <taut/core/math/symmetric_eigen.hpp>

namespace taut {

/// 3x3; T may be a pack. `floor` is in the units of A.
template <class T>
KOKKOS_INLINE_FUNCTION Sym3<T> project_psd(Sym3<T> const& a, T const& floor = T(0)) {
  SymmetricEigen<T> e = symmetric_eigen(a);
  auto const project = e.values[2] < floor;  // the smallest
  for (int k = 0; k < 3; ++k) e.values[k] = max(e.values[k], floor);
  Sym3<T> r = e.compose();
  for (int k = 0; k < 6; ++k) r.s[k] = select(project, r.s[k], a.s[k]);
  return r;
}

/// N x N; both triangles are read and written.
template <class T, int N>
KOKKOS_INLINE_FUNCTION SquareMatrix<T, N> project_psd(SquareMatrix<T, N> const& a,
                                                      T const& floor = T(0)) {
  SquareEigen<T, N> const e = symmetric_eigen(a);
  T smallest = e.values[0];
  for (int k = 1; k < N; ++k) smallest = min(smallest, e.values[k]);
  auto const project = smallest < floor;
  if (!any_lane(project)) return a;
  SquareMatrix<T, N> r;
  for (int j = 0; j < N; ++j)
    for (int i = 0; i <= j; ++i) {
      T sum(0);
      for (int k = 0; k < N; ++k) {
        sum = sum + max(e.values[k], floor) * (e.vectors(i, k) * e.vectors(j, k));
      }
      r(i, j) = select(project, sum, a(i, j));
      r(j, i) = select(project, sum, a(j, i));
    }
  return r;
}

}  // namespace taut

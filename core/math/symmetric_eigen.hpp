// Eigenvalues and eigenvectors of small symmetric matrices by cyclic Jacobi rotations (Golub and
// Van Loan, Matrix Computations, section 8.5): A = V diag(values) V^T with V orthogonal to
// round-off whatever the eigenvalues. The rotations are straight-line arithmetic, so T may be a
// pack; a pack sweeps until its last lane is diagonal.
#pragma once

#include <taut/core/math/matrix.hpp>

namespace taut {

/// (A + A^T) / 2
template <class T>
KOKKOS_FORCEINLINE_FUNCTION Sym3<T> symmetric_part(Mat3<T> const& a) {
  T const half(0.5);
  return {{a(0, 0), a(1, 1), a(2, 2), half * (a(0, 1) + a(1, 0)), half * (a(1, 2) + a(2, 1)),
           half * (a(0, 2) + a(2, 0))}};
}

/// Dense N x N matrix, stored by columns.
template <class T, int N>
struct SquareMatrix {
  T a[N * N];
  KOKKOS_FORCEINLINE_FUNCTION T& operator()(int i, int j) { return a[i + N * j]; }
  KOKKOS_FORCEINLINE_FUNCTION T const& operator()(int i, int j) const { return a[i + N * j]; }
};

/// A = Sum_k values[k] v_k v_k^T with v_k = column k of `vectors`, in no particular order.
template <class T, int N>
struct SquareEigen {
  T values[N];
  SquareMatrix<T, N> vectors;
};

/// The same for 3x3: values[0] >= values[1] >= values[2], det(vectors) = +1.
template <class T>
struct SymmetricEigen {
  Vec3<T> values;
  Mat3<T> vectors;

  /// Sum_k values[k] v_k v_k^T: the matrix itself, or a function of it once `values` were changed.
  KOKKOS_FORCEINLINE_FUNCTION Sym3<T> compose() const {
    constexpr int row[6] = {0, 1, 2, 0, 1, 0}, column[6] = {0, 1, 2, 1, 2, 2};
    Sym3<T> r;
    for (int e = 0; e < 6; ++e) {
      r.s[e] = T(0);
      for (int k = 0; k < 3; ++k) {
        r.s[e] = r.s[e] + values[k] * vectors(row[e], k) * vectors(column[e], k);
      }
    }
    return r;
  }
};

namespace kernels {

/// A <- J^T A J and V <- V J with the rotation J in the plane (p, q) that annihilates A_pq. What is
/// below `negligible` is dropped without a rotation: between equal eigenvalues its angle would be
/// noise, and turning by it would carry other off-diagonal entries around for many sweeps.
template <class T, int N>
KOKKOS_FORCEINLINE_FUNCTION void jacobi_rotate(SquareMatrix<T, N>& a, SquareMatrix<T, N>& v, int p,
                                               int q, T const& negligible) {
  T const tiny(Kokkos::Experimental::norm_min_v<ValueType<T>>);
  T const apq = a(p, q), d = a(q, q) - a(p, p);
  T const twice = select(abs(apq) > negligible, apq + apq, T(0));
  // tan of the smaller of the two angles
  T const t = select(d < T(0), -twice, twice) / (abs(d) + sqrt(d * d + (twice * twice + tiny)));
  T const c = T(1) / sqrt(T(1) + t * t), s = t * c;
  a(p, p) = a(p, p) - t * apq;
  a(q, q) = a(q, q) + t * apq;
  a(p, q) = a(q, p) = T(0);
  for (int r = 0; r < N; ++r) {
    T const vp = v(r, p), vq = v(r, q);
    v(r, p) = c * vp - s * vq;
    v(r, q) = s * vp + c * vq;
    if (r == p || r == q) continue;
    T const ap = a(r, p), aq = a(r, q);
    a(r, p) = a(p, r) = c * ap - s * aq;
    a(r, q) = a(q, r) = s * ap + c * aq;
  }
}

/// One rotation for each pair p < q, row by row. Up to 4x4 the pairs are written out, for the
/// entries to stay in registers.
template <int p = 0, int q = 1, class T, int N>
KOKKOS_FORCEINLINE_FUNCTION void jacobi_sweep(SquareMatrix<T, N>& a, SquareMatrix<T, N>& v,
                                              T const& negligible) {
  if constexpr (N > 4) {
    for (int i = 0; i < N - 1; ++i)
      for (int j = i + 1; j < N; ++j) jacobi_rotate(a, v, i, j, negligible);
  } else {
    jacobi_rotate(a, v, p, q, negligible);
    if constexpr (q + 1 < N) {
      jacobi_sweep<p, q + 1>(a, v, negligible);
    } else if constexpr (p + 2 < N) {
      jacobi_sweep<p + 1, p + 2>(a, v, negligible);
    }
  }
}

/// Exchanges columns p and q, one of them negated to keep the determinant, where values[p] is the
/// smaller.
template <class T>
KOKKOS_FORCEINLINE_FUNCTION void sort_pair(SymmetricEigen<T>& e, int p, int q) {
  T const vp = e.values[p], vq = e.values[q];
  auto const exchange = vp < vq;
  e.values[p] = select(exchange, vq, vp);
  e.values[q] = select(exchange, vp, vq);
  for (int r = 0; r < 3; ++r) {
    T const rp = e.vectors(r, p), rq = e.vectors(r, q);
    e.vectors(r, p) = select(exchange, rq, rp);
    e.vectors(r, q) = select(exchange, -rp, rq);
  }
}

}  // namespace kernels

/// Eigen-decomposition of a symmetric N x N matrix; both triangles are read. Off-diagonal entries
/// are driven below epsilon/4 of the largest entry. A NaN or infinity gives NaN.
template <class T, int N>
KOKKOS_INLINE_FUNCTION SquareEigen<T, N> symmetric_eigen(SquareMatrix<T, N> a) {
  using Real = ValueType<T>;
  T scale(Kokkos::Experimental::norm_min_v<Real>), zero(0);
  for (T const& entry : a.a) {
    scale = max(scale, abs(entry));
    zero = zero + T(0) * entry;  // NaN if an entry is NaN or infinite
  }
  T const inverse_scale = T(1) / scale;
  SquareEigen<T, N> e;
  for (int i = 0; i < N * N; ++i) {
    a.a[i] = a.a[i] * inverse_scale;
    e.vectors.a[i] = T(i % (N + 1) == 0 ? 1 : 0) + zero;
  }
  T const negligible(Kokkos::Experimental::epsilon_v<Real> / 4);
  // 4 to 6 sweeps are usual up to N = 12; the bound only ends the loop on NaN.
  for (int sweep = 0; sweep < 20; ++sweep) {
    T largest(0);
    for (int q = 1; q < N; ++q)
      for (int p = 0; p < q; ++p) largest = max(largest, abs(a(p, q)));
    if (!any_lane(largest > negligible)) break;
    kernels::jacobi_sweep(a, e.vectors, negligible);
  }
  for (int k = 0; k < N; ++k) e.values[k] = scale * a(k, k) + zero;
  return e;
}

/// The 3x3 case, sorted.
template <class T>
KOKKOS_INLINE_FUNCTION SymmetricEigen<T> symmetric_eigen(Sym3<T> const& a) {
  SquareEigen<T, 3> const unsorted = symmetric_eigen(
      SquareMatrix<T, 3>{{a.s[0], a.s[3], a.s[5], a.s[3], a.s[1], a.s[4], a.s[5], a.s[4], a.s[2]}});
  SymmetricEigen<T> e;
  for (int k = 0; k < 3; ++k) e.values[k] = unsorted.values[k];
  for (int k = 0; k < 9; ++k) e.vectors.a[k] = unsorted.vectors.a[k];
  kernels::sort_pair(e, 0, 1);
  kernels::sort_pair(e, 1, 2);
  kernels::sort_pair(e, 0, 1);
  return e;
}

}  // namespace taut

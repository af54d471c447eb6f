// What F = D B is asked for, had from the edges D of a tet and the inverse B of those at rest (see
// materials/edge_state.hpp).
#pragma once

#include <taut/core/math/matrix.hpp>

namespace taut {

/// A A^T.
template <class T>
KOKKOS_FORCEINLINE_FUNCTION Sym3<T> gram_of_rows(Mat3<T> const& A) {
  Vec3<T> const x{A(0, 0), A(0, 1), A(0, 2)}, y{A(1, 0), A(1, 1), A(1, 2)},
      z{A(2, 0), A(2, 1), A(2, 2)};
  return {{dot(x, x), dot(y, y), dot(z, z), dot(x, y), dot(y, z), dot(x, z)}};
}
/// A^T A.
template <class T>
KOKKOS_FORCEINLINE_FUNCTION Sym3<T> gram_of_columns(Mat3<T> const& A) {
  Vec3<T> const x = A.column(0), y = A.column(1), z = A.column(2);
  return {{dot(x, x), dot(y, y), dot(z, z), dot(x, y), dot(y, z), dot(x, z)}};
}
/// A : B of two symmetric matrices.
template <class T>
KOKKOS_FORCEINLINE_FUNCTION T contract(Sym3<T> const& a, Sym3<T> const& b) {
  T const off = a.s[3] * b.s[3] + a.s[4] * b.s[4] + a.s[5] * b.s[5];
  return a.s[0] * b.s[0] + a.s[1] * b.s[1] + a.s[2] * b.s[2] + T(2) * off;
}
/// A : B, column by column: a third of the latency of nine products added one after the other.
template <class T>
KOKKOS_FORCEINLINE_FUNCTION T contract_columns(Mat3<T> const& a, Mat3<T> const& b) {
  return dot(a.column(0), b.column(0)) +
         (dot(a.column(1), b.column(1)) + dot(a.column(2), b.column(2)));
}
/// D G with a symmetric G, row by row: three numbers of D at a time.
template <class T>
KOKKOS_FORCEINLINE_FUNCTION Mat3<T> operator*(Mat3<T> const& D, Sym3<T> const& G) {
  Mat3<T> r;
  for (int i = 0; i < 3; ++i) {
    r.a[i] = D.a[i] * G.s[0] + D.a[i + 3] * G.s[3] + D.a[i + 6] * G.s[5];
    r.a[i + 3] = D.a[i] * G.s[3] + D.a[i + 3] * G.s[1] + D.a[i + 6] * G.s[4];
    r.a[i + 6] = D.a[i] * G.s[5] + D.a[i + 3] * G.s[4] + D.a[i + 6] * G.s[2];
  }
  return r;
}
/// s cof(D) and s det(D).
template <class T>
struct ScaledCofactor {
  Mat3<T> C;
  T det;
};
template <class T>
KOKKOS_FORCEINLINE_FUNCTION ScaledCofactor<T> scaled_cofactor(T const& s, Mat3<T> const& D) {
  Vec3<T> const x = s * D.column(0), area = cross(D.column(1), D.column(2));
  ScaledCofactor<T> r;
  r.det = dot(x, area);
  r.C.set_column(0, s * area);
  r.C.set_column(1, cross(D.column(2), x));
  r.C.set_column(2, cross(x, D.column(1)));
  return r;
}

}  // namespace taut

// Fixed-size vectors and 3x3 matrices for kernels. T is a scalar or a SIMD pack of scalars.
//
// Matrices are stored by columns, so that `a[i + 3 * j]` is the entry (i, j) and the nine numbers
// in memory order are vec(A), the column stacking that all formulas of the library use.
#pragma once

#include <taut/core/math/scalar.hpp>

namespace taut {

template <class T>
struct Vec3 {
  T v[3];
  KOKKOS_FORCEINLINE_FUNCTION T& operator[](int i) { return v[i]; }
  KOKKOS_FORCEINLINE_FUNCTION T const& operator[](int i) const { return v[i]; }
};

template <class T>
struct Mat3 {
  T a[9];
  KOKKOS_FORCEINLINE_FUNCTION T& operator()(int i, int j) { return a[i + 3 * j]; }
  KOKKOS_FORCEINLINE_FUNCTION T const& operator()(int i, int j) const { return a[i + 3 * j]; }
  KOKKOS_FORCEINLINE_FUNCTION Vec3<T> column(int j) const {
    return {a[3 * j], a[3 * j + 1], a[3 * j + 2]};
  }
  KOKKOS_FORCEINLINE_FUNCTION void set_column(int j, Vec3<T> const& c) {
    for (int i = 0; i < 3; ++i) a[i + 3 * j] = c[i];
  }
};

/// Symmetric 3x3 matrix, stored as xx, yy, zz, xy, yz, xz.
template <class T>
struct Sym3 {
  T s[6];
};

template <class T>
KOKKOS_FORCEINLINE_FUNCTION Vec3<T> operator+(Vec3<T> const& a, Vec3<T> const& b) {
  return {a[0] + b[0], a[1] + b[1], a[2] + b[2]};
}
template <class T>
KOKKOS_FORCEINLINE_FUNCTION Vec3<T> operator-(Vec3<T> const& a, Vec3<T> const& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
template <class T>
KOKKOS_FORCEINLINE_FUNCTION Vec3<T> operator-(Vec3<T> const& a) {
  return {-a[0], -a[1], -a[2]};
}
template <class T>
KOKKOS_FORCEINLINE_FUNCTION Vec3<T> operator*(T const& s, Vec3<T> const& a) {
  return {s * a[0], s * a[1], s * a[2]};
}
template <class T>
KOKKOS_FORCEINLINE_FUNCTION T dot(Vec3<T> const& a, Vec3<T> const& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
template <class T>
KOKKOS_FORCEINLINE_FUNCTION Vec3<T> cross(Vec3<T> const& a, Vec3<T> const& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
template <class T>
KOKKOS_FORCEINLINE_FUNCTION T norm(Vec3<T> const& a) {
  return sqrt(dot(a, a));
}

template <class T>
KOKKOS_FORCEINLINE_FUNCTION Mat3<T> identity3() {
  Mat3<T> r;
  for (int k = 0; k < 9; ++k) r.a[k] = T(k % 4 == 0 ? 1 : 0);
  return r;
}
template <class T>
KOKKOS_FORCEINLINE_FUNCTION Mat3<T> operator+(Mat3<T> const& a, Mat3<T> const& b) {
  Mat3<T> r;
  for (int k = 0; k < 9; ++k) r.a[k] = a.a[k] + b.a[k];
  return r;
}
template <class T>
KOKKOS_FORCEINLINE_FUNCTION Mat3<T> operator-(Mat3<T> const& a, Mat3<T> const& b) {
  Mat3<T> r;
  for (int k = 0; k < 9; ++k) r.a[k] = a.a[k] - b.a[k];
  return r;
}
template <class T>
KOKKOS_FORCEINLINE_FUNCTION Mat3<T> operator*(T const& s, Mat3<T> const& a) {
  Mat3<T> r;
  for (int k = 0; k < 9; ++k) r.a[k] = s * a.a[k];
  return r;
}
template <class T>
KOKKOS_FORCEINLINE_FUNCTION Vec3<T> operator*(Mat3<T> const& a, Vec3<T> const& x) {
  Vec3<T> r;
  for (int i = 0; i < 3; ++i) r[i] = a(i, 0) * x[0] + a(i, 1) * x[1] + a(i, 2) * x[2];
  return r;
}
template <class T>
KOKKOS_FORCEINLINE_FUNCTION Mat3<T> operator*(Mat3<T> const& a, Mat3<T> const& b) {
  Mat3<T> r;
  for (int j = 0; j < 3; ++j)
    for (int i = 0; i < 3; ++i) r(i, j) = a(i, 0) * b(0, j) + a(i, 1) * b(1, j) + a(i, 2) * b(2, j);
  return r;
}
template <class T>
KOKKOS_FORCEINLINE_FUNCTION Mat3<T> transpose(Mat3<T> const& a) {
  return {{a(0, 0), a(0, 1), a(0, 2), a(1, 0), a(1, 1), a(1, 2), a(2, 0), a(2, 1), a(2, 2)}};
}
/// A^T B without forming the transpose.
template <class T>
KOKKOS_FORCEINLINE_FUNCTION Mat3<T> transpose_times(Mat3<T> const& a, Mat3<T> const& b) {
  Mat3<T> r;
  for (int j = 0; j < 3; ++j)
    for (int i = 0; i < 3; ++i) r(i, j) = a(0, i) * b(0, j) + a(1, i) * b(1, j) + a(2, i) * b(2, j);
  return r;
}
/// A^T x without forming the transpose.
template <class T>
KOKKOS_FORCEINLINE_FUNCTION Vec3<T> transpose_times(Mat3<T> const& a, Vec3<T> const& x) {
  Vec3<T> r;
  for (int i = 0; i < 3; ++i) r[i] = a(0, i) * x[0] + a(1, i) * x[1] + a(2, i) * x[2];
  return r;
}
/// A : B, the sum of the products of equal entries.
template <class T>
KOKKOS_FORCEINLINE_FUNCTION T contract(Mat3<T> const& a, Mat3<T> const& b) {
  T r = a.a[0] * b.a[0];
  for (int k = 1; k < 9; ++k) r = r + a.a[k] * b.a[k];
  return r;
}
template <class T>
KOKKOS_FORCEINLINE_FUNCTION T trace(Mat3<T> const& a) {
  return a.a[0] + a.a[4] + a.a[8];
}
/// Cofactor matrix [f1 x f2 | f2 x f0 | f0 x f1] = det(F) F^-T, the derivative of det F.
template <class T>
KOKKOS_FORCEINLINE_FUNCTION Mat3<T> cofactor(Mat3<T> const& f) {
  Mat3<T> r;
  r.set_column(0, cross(f.column(1), f.column(2)));
  r.set_column(1, cross(f.column(2), f.column(0)));
  r.set_column(2, cross(f.column(0), f.column(1)));
  return r;
}
template <class T>
KOKKOS_FORCEINLINE_FUNCTION T determinant(Mat3<T> const& f) {
  return dot(f.column(0), cross(f.column(1), f.column(2)));
}
/// A y for symmetric A.
template <class T>
KOKKOS_FORCEINLINE_FUNCTION Vec3<T> operator*(Sym3<T> const& A, Vec3<T> const& y) {
  return {A.s[0] * y[0] + A.s[3] * y[1] + A.s[5] * y[2],
          A.s[3] * y[0] + A.s[1] * y[1] + A.s[4] * y[2],
          A.s[5] * y[0] + A.s[4] * y[1] + A.s[2] * y[2]};
}
/// y' A y for symmetric A.
template <class T>
KOKKOS_FORCEINLINE_FUNCTION T quadratic(Sym3<T> const& A, Vec3<T> const& y) {
  return dot(y, A * y);
}
template <class T>
KOKKOS_FORCEINLINE_FUNCTION Mat3<T> to_matrix(Sym3<T> const& A) {
  return {{A.s[0], A.s[3], A.s[5], A.s[3], A.s[1], A.s[4], A.s[5], A.s[4], A.s[2]}};
}
/// a b^T
template <class T>
KOKKOS_FORCEINLINE_FUNCTION Mat3<T> outer(Vec3<T> const& a, Vec3<T> const& b) {
  Mat3<T> r;
  for (int j = 0; j < 3; ++j)
    for (int i = 0; i < 3; ++i) r(i, j) = a[i] * b[j];
  return r;
}

}  // namespace taut

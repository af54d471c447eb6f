// Rotation-variant polar decomposition F = R S: R is the rotation nearest to F, also for inverted,
// flat and zero F, and S = R^T F is symmetric. Also the derivative of R.
//
// R maximises tr(R^T F) over the rotations. For a unit quaternion q, tr(R(q)^T F) = q^T K q with
// Davenport's symmetric trace-free 4x4 matrix K(F) (Horn 1987, J. Opt. Soc. Am. A 4, 629). With the
// signed singular values of F, s0 >= s1 >= |s2|, the eigenvalues of K are
//
//   s0 + s1 + s2 = tr S,   s0 - s1 - s2,   -s0 + s1 - s2,   -s0 - s1 + s2,
//
// the roots of   p(x) = x^4 - 2 |F|^2 x^2 - 8 det F x + |F|^4 - 4 |cof F|^2.
//
// The largest root comes from Laguerre's iteration and q from inverse iteration with K: some 300
// flops, and the error of R^T F - (R^T F)^T is a few epsilon |F|. Where the two largest roots
// (nearly) meet, p knows too little of them: those F, with s1 + s2 below about |F|/20, go through
// Jacobi rotations of K instead. That branch is rare, and a pack takes it as a whole.
#pragma once

#include <taut/core/math/symmetric_eigen.hpp>

namespace taut {
namespace kernels {

/// p(x) for |F| = 1: x^4 - 2 x^2 - linear x + constant.
template <class T>
struct StretchPolynomial {
  T linear, constant;

  KOKKOS_FORCEINLINE_FUNCTION T value(T const& x) const {
    return ((x * x - T(2)) * x - linear) * x + constant;
  }
  KOKKOS_FORCEINLINE_FUNCTION T slope(T const& x) const {
    return (T(4) * (x * x) - T(4)) * x - linear;
  }
  /// Laguerre's step towards the largest root. From above and with all roots real, as here, the
  /// iteration descends monotonically, cubically in the end.
  KOKKOS_FORCEINLINE_FUNCTION T step(T const& x) const {
    T const f = value(x), df = slope(x), half_d2f = T(6) * (x * x) - T(2);
    return T(-4) * f / (df + sqrt(max(T(9) * (df * df) - T(24) * (f * half_d2f), T(0))));
  }
  /// Upper bound of the roots: s0 + s1 + s2 <= sqrt(3) |s|.
  KOKKOS_FORCEINLINE_FUNCTION static T upper_bound() { return T(1.7320508075688772); }
};

template <class T>
struct Quaternion {
  T q[4];  ///< w, x, y, z; any length but zero
};

template <class T>
KOKKOS_FORCEINLINE_FUNCTION Mat3<T> rotation_matrix(Quaternion<T> const& quaternion) {
  T const &w = quaternion.q[0], &x = quaternion.q[1], &y = quaternion.q[2], &z = quaternion.q[3];
  T const one(1), scale = T(2) / ((w * w + x * x) + (y * y + z * z));
  T const sx = scale * x, sy = scale * y, sz = scale * z;
  return {{one - (y * sy + z * sz), x * sy + w * sz, x * sz - w * sy,  //
           x * sy - w * sz, one - (x * sx + z * sz), y * sz + w * sx,  //
           x * sz + w * sy, y * sz - w * sx, one - (x * sx + y * sy)}};
}

template <class T>
KOKKOS_FORCEINLINE_FUNCTION SquareMatrix<T, 4> davenport_matrix(Mat3<T> const& F) {
  T const wx = F(2, 1) - F(1, 2), wy = F(0, 2) - F(2, 0), wz = F(1, 0) - F(0, 1);
  T const xy = F(0, 1) + F(1, 0), xz = F(0, 2) + F(2, 0), yz = F(1, 2) + F(2, 1);
  return {{F(0, 0) + F(1, 1) + F(2, 2), wx, wy, wz,  //
           wx, F(0, 0) - F(1, 1) - F(2, 2), xy, xz,  //
           wy, xy, F(1, 1) - F(0, 0) - F(2, 2), yz,  //
           wz, xz, yz, F(2, 2) - F(0, 0) - F(1, 1)}};
}

/// Eigenvector of the largest eigenvalue of K, for x just above it: three steps of inverse
/// iteration with N = (x I - K)^-1, which is positive definite.
template <class T>
KOKKOS_FORCEINLINE_FUNCTION Quaternion<T> inverse_iteration(SquareMatrix<T, 4> const& K,
                                                            T const& x) {
  // x I - K = [A -B; -B^T D] in 2x2 blocks, inverted through A = L diag L^T, W = A^-1 B and the
  // Schur complement D - B^T W. A and the complement may be nearly singular, so that everything
  // must follow from the same rounded L: l, t2, t3 and not the entries of A^-1.
  T const one(1), m0 = x - K(0, 0), m1 = x - K(1, 1), m2 = x - K(2, 2), m3 = x - K(3, 3);
  T const i0 = one / m0, l = K(1, 0) * i0, i1 = m0 / (m0 * m1 - K(1, 0) * K(1, 0));
  T const c2 = K(2, 0) * i0, t2 = K(2, 1) + l * K(2, 0);
  T const c3 = K(3, 0) * i0, t3 = K(3, 1) + l * K(3, 0);
  T const w12 = t2 * i1, w02 = c2 + l * w12, w13 = t3 * i1, w03 = c3 + l * w13;
  T const s22 = m2 - K(2, 0) * c2 - t2 * w12, s33 = m3 - K(3, 0) * c3 - t3 * w13;
  T const s32 = K(3, 2) + K(2, 0) * c3 + t2 * w13;  // negated
  T const j2 = one / s22, k = s32 * j2;
  T const n33 = s22 / (s22 * s33 - s32 * s32), n32 = k * n33, n22 = j2 + k * n32;
  T const n20 = w02 * n22 + w03 * n32, n30 = w02 * n32 + w03 * n33;
  T const n21 = w12 * n22 + w13 * n32, n31 = w12 * n32 + w13 * n33;
  T const a10 = l * i1;
  T const n00 = (i0 + l * a10) + w02 * n20 + w03 * n30, n11 = i1 + w12 * n21 + w13 * n31;
  T const n10 = a10 + w02 * n21 + w03 * n31;
  SquareMatrix<T, 4> const N = {
      {n00, n10, n20, n30, n10, n11, n21, n31, n20, n21, n22, n32, n30, n31, n32, n33}};

  // The first step from the axis e_j that N amplifies most, which cannot be orthogonal to the
  // eigenvector, is column j of N.
  Quaternion<T> r = {{n00, n10, n20, n30}};
  T most = n00;
  for (int j = 1; j < 4; ++j) {
    auto const more = N(j, j) > most;
    most = select(more, N(j, j), most);
    for (int i = 0; i < 4; ++i) r.q[i] = select(more, N(i, j), r.q[i]);
  }
  for (int step = 0; step < 2; ++step) {
    Quaternion<T> const y = r;
    for (int i = 0; i < 4; ++i) {
      r.q[i] = (N(i, 0) * y.q[0] + N(i, 1) * y.q[1]) + (N(i, 2) * y.q[2] + N(i, 3) * y.q[3]);
    }
  }
  return r;
}

/// The same without help, at ten times the cost.
template <class T>
KOKKOS_FUNCTION Quaternion<T> dominant_eigenvector(SquareMatrix<T, 4> const& K) {
  SquareEigen<T, 4> const e = symmetric_eigen(K);
  Quaternion<T> r;
  for (int i = 0; i < 4; ++i) r.q[i] = e.vectors(i, 0);
  T largest = e.values[0];
  for (int j = 1; j < 4; ++j) {
    auto const larger = e.values[j] > largest;
    largest = select(larger, e.values[j], largest);
    for (int i = 0; i < 4; ++i) r.q[i] = select(larger, e.vectors(i, j), r.q[i]);
  }
  return r;
}

}  // namespace kernels

/// The rotation R of F = R S. Its error is a few epsilon |F| / (s1 + s2): where s1 + s2 = 0,
/// several rotations are nearest and one of them is returned (for F = 0, the identity). |F|^2 must
/// neither overflow nor underflow. A NaN in F gives NaN.
template <class T>
KOKKOS_FORCEINLINE_FUNCTION Mat3<T> polar_rotation(Mat3<T> const& F) {
  using Real = ValueType<T>;
  constexpr bool single = std::is_same_v<Real, float>;
  T const norm2 = (dot(F.column(0), F.column(0)) + dot(F.column(1), F.column(1))) +
                  dot(F.column(2), F.column(2));
  T const tiny(Kokkos::Experimental::norm_min_v<Real>);
  Mat3<T> const unit = (T(1) / sqrt(max(norm2, tiny))) * F;
  Mat3<T> const C = cofactor(unit);
  T const C2 = (dot(C.column(0), C.column(0)) + dot(C.column(1), C.column(1))) +
               dot(C.column(2), C.column(2));

  // Lowering p by a margin above all rounding errors lifts the root, so that x I - K is positive
  // definite also in floating point.
  T const margin(128 * Kokkos::Experimental::epsilon_v<Real>);
  kernels::StretchPolynomial<T> const p = {T(8) * dot(unit.column(0), C.column(0)),
                                           (T(1) - margin) - T(4) * C2};
  T x = p.upper_bound();
  for (int i = 0; i < (single ? 2 : 3); ++i) x = x + p.step(x);
  SquareMatrix<T, 4> const K = kernels::davenport_matrix(unit);
  kernels::Quaternion<T> q = kernels::inverse_iteration(K, x);

  // A step of inverse iteration leaves at most eta = (x - x0)/(x0 - x1) of an error, with x0 and x1
  // the largest roots; x - x0 is p/p' and x0 - x1 = p'/(4 (s0 + s1)(s0 + s2)) at least p'/6. Three
  // steps suffice where eta^3 < epsilon.
  T const enough((single ? 4.9e-3 : 6e-6) / 6);
  auto const hard = p.value(x) + margin >= enough * square(p.slope(x));
  if (any_lane(hard)) {
    kernels::Quaternion<T> const safe = kernels::dominant_eigenvector(K);
    for (int i = 0; i < 4; ++i) q.q[i] = select(hard, safe.q[i], q.q[i]);
  }
  return kernels::rotation_matrix(q);
}

/// tr S = s0 + s1 + s2 from the invariants I2 = |F|^2, J = det F and C2 = |cof F|^2, without R:
/// accurate to epsilon |F|^3 / ((s0 + s1)(s1 + s2)(s2 + s0)) relative to |F|, and to the cube root
/// of epsilon where the three largest roots of p meet. I2^(3/2) must neither overflow nor
/// underflow.
template <class T>
KOKKOS_FORCEINLINE_FUNCTION T stretch_sum(T const& I2, T const& J, T const& C2) {
  using Real = ValueType<T>;
  T const norm = sqrt(max(I2, T(Kokkos::Experimental::norm_min_v<Real>)));
  T const scale = T(1) / norm, scale2 = scale * scale;
  kernels::StretchPolynomial<T> const p = {T(8) * (J * scale2) * scale,
                                           T(1) - T(4) * (C2 * scale2) * scale2};
  // After a step below `small` the error is below epsilon. A multiple root is approached slowly and
  // only as far as p is more than its rounding error.
  T const small(std::is_same_v<Real, float> ? 1e-3 : 1e-6);
  T const noise(32 * Kokkos::Experimental::epsilon_v<Real>);
  T x = p.upper_bound();
  for (int i = 0; i < 16; ++i) {
    T const step = select(p.value(x) > noise, p.step(x), T(0));
    x = x + step;
    if (!any_lane(step < -small)) break;
  }
  return norm * x;
}

/// The vector a of the skew part of A: A - A^T = [a]x, a = (A21 - A12, A02 - A20, A10 - A01).
template <class T>
KOKKOS_FORCEINLINE_FUNCTION Vec3<T> axial(Mat3<T> const& A) {
  return {A(2, 1) - A(1, 2), A(0, 2) - A(2, 0), A(1, 0) - A(0, 1)};
}

/// Where sums si + sj of singular values are cut off, for a division: 32 epsilon (1 + s0 + s1 +
/// s2). Relative to the size of F that is the size of their rounding error; absolute, as F has no
/// dimension, it keeps 1 / (si + sj) below 1 / (32 epsilon) where an element shrinks to a point.
template <class T>
KOKKOS_FORCEINLINE_FUNCTION T stretch_floor(T const& trace) {
  constexpr ValueType<T> eps = Kokkos::Experimental::epsilon_v<ValueType<T>>;
  return T(32 * eps) * (T(1) + trace);
}

/// si + sj of a decomposition with signed singular values s, at least the floor: never negative
/// except by rounding, as R is the nearest rotation.
template <class T>
KOKKOS_FORCEINLINE_FUNCTION T floored_sum(T const& si, T const& sj, Vec3<T> const& s) {
  return max(si + sj, stretch_floor(s[0] + s[1] + s[2]));
}

/// The derivative of R: the inverse of G = tr(S) I - S, for S = R^T F. From dF,
///
///   dR = R [w]x,  w = G^-1 a,  a = axial(R^T dF),   and   dF : dR = a . G^-1 a.
///
/// For dR^T F + R^T dF = dS is symmetric; with dR = R [w]x its skew part says
/// R^T dF - dF^T R = [w]x S + S [w]x = [G w]x. The eigenvalues of G are the sums si + sj. G is
/// shifted by their floor, so that G^-1 is positive definite and bounded for every F.
template <class T>
KOKKOS_FORCEINLINE_FUNCTION Sym3<T> rotation_gradient(Mat3<T> const& S) {
  T const one(1), half(0.5), trace_s = trace(S), shifted = trace_s + stretch_floor(trace_s);
  T const g10 = -half * (S(1, 0) + S(0, 1)), g20 = -half * (S(2, 0) + S(0, 2));
  T const g21 = -half * (S(2, 1) + S(1, 2));
  // G = L diag(d) L^T, which needs no pivoting and keeps small eigenvalues better than Cramer's
  // rule; then G^-1 = L^-T diag(1/d) L^-1.
  T const d0 = shifted - S(0, 0), i0 = one / d0, l10 = g10 * i0, l20 = g20 * i0;
  T const e21 = g21 - l20 * g10;
  T const i1 = one / ((shifted - S(1, 1)) - l10 * g10), l21 = e21 * i1;
  T const i2 = one / ((shifted - S(2, 2)) - l20 * g20 - l21 * e21);
  T const p = l10 * i1, m = l10 * l21 - l20, yz = -l21 * i2, xz = m * i2;
  return {{i0 + l10 * p + m * xz, i1 - l21 * yz, i2, -(p + l21 * xz), yz, xz}};
}

}  // namespace taut

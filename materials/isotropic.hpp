// From a model's invariant derivatives to stress and curvature: everything that a discretisation
// asks of an isotropic material at one deformation gradient F, with dF a change of F.
//
//   P(F)   = dPsi/dI1 R + 2 dPsi/dI2 F + dPsi/dJ C,                              C = cofactor of F
//   dF:dP  = the six terms h1..h6 of Shen et al. 2024, section 3.1:
//     d2Psi/dI1^2 (R:dF)^2 + d2Psi/dI2^2 (2F:dF)^2 + d2Psi/dJ^2 (C:dF)^2
//     + dPsi/dI1 a.(tr S I - S)^-1 a + 2 dPsi/dI2 |dF|^2 + 2 dPsi/dJ F:cof(dF)
//
// where a = axial(R^T dF). The fourth term is the paper's sum over the three twist modes,
// Sum lambda_i (Q_i : dF)^2 with lambda_i = 2 / (s_j + s_k): those are the eigenvalues of
// 2 (tr S I - S)^-1, so a polar decomposition serves where the paper takes a singular value one.
#pragma once

#include <taut/core/math/polar.hpp>
#include <taut/materials/invariants.hpp>

namespace taut {

/// A model at one F: what stress and curvature need, evaluated once. T may be a pack of elements.
template <class Model, class T>
struct IsotropicState {
  Mat3<T> F;
  Mat3<T> C;      ///< cofactor of F
  Mat3<T> R;      ///< rotation; only if Model::use.d1
  Sym3<T> G_inv;  ///< (tr S I - S)^-1; only if Model::use.d1
  Invariants<T> invariants;
  InvariantDerivatives<T> d;
};

template <class Model, class T>
KOKKOS_FORCEINLINE_FUNCTION IsotropicState<Model, T> evaluate(Lame<T> const& lame,
                                                              Mat3<T> const& F) {
  IsotropicState<Model, T> s;
  s.F = F;
  s.C = cofactor(F);
  s.invariants.I2 = contract(F, F);
  s.invariants.J = dot(F.column(0), s.C.column(0));
  if constexpr (Model::use.d1) {
    s.R = polar_rotation(F);
    Mat3<T> const S = transpose_times(s.R, F);
    s.invariants.I1 = trace(S);
    s.G_inv = rotation_gradient(S);
  }
  s.d = Model::derivatives(lame, s.invariants);
  return s;
}

template <class Model, class T>
KOKKOS_FORCEINLINE_FUNCTION T energy(Lame<T> const& lame, Mat3<T> const& F) {
  Invariants<T> i;
  i.I2 = contract(F, F);
  i.J = determinant(F);
  if constexpr (Model::use.d1) i.I1 = trace(transpose_times(polar_rotation(F), F));
  return Model::energy(lame, i);
}

/// How cof F and J change when F is reached by a step dF: exact polynomials, no cancellation.
template <class T>
struct CofactorChange {
  Mat3<T> C;
  T J;
};

template <class T>
KOKKOS_FORCEINLINE_FUNCTION CofactorChange<T> cofactor_change(Mat3<T> const& F, Mat3<T> const& dF) {
  CofactorChange<T> change;
  Mat3<T> const before = F - dF;
  for (int k = 0; k < 3; ++k) {
    int const i = (k + 1) % 3, j = (k + 2) % 3;
    change.C.set_column(k,
                        cross(dF.column(i), F.column(j)) + cross(before.column(i), dF.column(j)));
  }
  // J - J0 = f0.(f1 x f2) - g0.(g1 x g2), with one factor changed at a time.
  change.J = dot(dF.column(0), cross(F.column(1), F.column(2))) +
             dot(before.column(0), change.C.column(0));
  return change;
}

/// Psi(F) - Psi(F - dF), accurate relative to the difference and not to Psi.
template <class Model, class T>
KOKKOS_FORCEINLINE_FUNCTION T energy_change(Lame<T> const& lame, IsotropicState<Model, T> const& s,
                                            Mat3<T> const& dF) {
  CofactorChange<T> const change = cofactor_change(s.F, dF);
  Invariants<T> d;
  d.I2 = T(2) * contract(s.F, dF) - contract(dF, dF);
  d.J = change.J;
  if constexpr (Model::use.d1) {
    // I1 is the largest root of x^4 - 2 I2 x^2 - 8 J x + I2^2 - 4 |C|^2. With both roots known to a
    // few digits, their difference follows from the differences of the coefficients.
    T const x = s.invariants.I1, I2 = s.invariants.I2;
    Mat3<T> const C0 = s.C - change.C;
    T const I2_0 = I2 - d.I2, J0 = s.invariants.J - d.J;
    T const x0 = stretch_sum(I2_0, J0, contract(C0, C0));
    T const dc = d.I2 * (I2 + I2_0) - T(4) * contract(change.C, s.C + C0);
    T const numerator = T(2) * d.I2 * x0 * x0 + T(8) * d.J * x0 - dc;
    T const denominator = (x * x + x0 * x0 - T(2) * I2) * (x + x0) - T(8) * s.invariants.J;
    // Where the two largest roots meet (s1 + s2 -> 0) the quotient is worthless; the plain
    // difference is not much better, but bounded.
    auto const regular = denominator > T(1e-4) * (x * x + x0 * x0) * (x + x0);
    d.I1 = select(regular, numerator / select(regular, denominator, T(1)), x - x0);
  }
  return Model::change(lame, s.invariants, d);
}

template <class Model, class T>
KOKKOS_FORCEINLINE_FUNCTION Mat3<T> stress(IsotropicState<Model, T> const& s) {
  Mat3<T> P = (T(2) * s.d.d2) * s.F;
  if constexpr (Model::use.d1) P = P + s.d.d1 * s.R;
  if constexpr (Model::use.d3) P = P + s.d.d3 * s.C;
  return P;
}

/// dF : d2Psi/dF2 : dF, unfiltered.
template <class Model, class T>
KOKKOS_FORCEINLINE_FUNCTION T quadratic_form(IsotropicState<Model, T> const& s, Mat3<T> const& dF) {
  T q = T(2) * s.d.d2 * contract(dF, dF);
  if constexpr (Model::use.d1) {
    q = q + s.d.d1 * quadratic(s.G_inv, axial(transpose_times(s.R, dF)));
    if constexpr (Model::use.d11) q = q + s.d.d11 * square(contract(s.R, dF));
  }
  if constexpr (Model::use.d22) q = q + T(4) * s.d.d22 * square(contract(s.F, dF));
  if constexpr (Model::use.d3) {
    q = q + s.d.d33 * square(contract(s.C, dF)) + T(2) * s.d.d3 * contract(s.F, cofactor(dF));
  }
  return q;
}

/// dP(F) : dF, unfiltered.
template <class Model, class T>
KOKKOS_FORCEINLINE_FUNCTION Mat3<T> stress_change(IsotropicState<Model, T> const& s,
                                                  Mat3<T> const& dF) {
  Mat3<T> dP = (T(2) * s.d.d2) * dF;
  if constexpr (Model::use.d1) {
    // dR = R [omega]x with (tr S I - S) omega = axial(R^T dF)
    Vec3<T> const a = axial(transpose_times(s.R, dF));
    Vec3<T> const w = s.G_inv * a;
    Mat3<T> const skew = {{T(0), w[2], -w[1], -w[2], T(0), w[0], w[1], -w[0], T(0)}};
    dP = dP + s.d.d1 * (s.R * skew);
    if constexpr (Model::use.d11) dP = dP + (s.d.d11 * contract(s.R, dF)) * s.R;
  }
  if constexpr (Model::use.d22) dP = dP + (T(4) * s.d.d22 * contract(s.F, dF)) * s.F;
  if constexpr (Model::use.d3) {
    dP = dP + (s.d.d33 * contract(s.C, dF)) * s.C;
    for (int k = 0; k < 3; ++k) {
      int const i = (k + 1) % 3, j = (k + 2) % 3;
      dP.set_column(k, dP.column(k) + s.d.d3 * (cross(dF.column(i), s.F.column(j)) +
                                                cross(s.F.column(i), dF.column(j))));
    }
  }
  return dP;
}

/// The diagonal and the off-diagonal entries of b'(d2Psi/dF2)b for one vertex, whose change of F is
/// dF = u b^T: a symmetric 3x3 in u, unfiltered. `diagonal_only` leaves the off-diagonal entries
/// zero.
template <class Model, bool diagonal_only, class T>
KOKKOS_FORCEINLINE_FUNCTION Sym3<T> vertex_block(IsotropicState<Model, T> const& s,
                                                 Vec3<T> const& b) {
  constexpr int row[6] = {0, 1, 2, 0, 1, 0}, col[6] = {0, 1, 2, 1, 2, 2};
  constexpr int entries = diagonal_only ? 3 : 6;
  Sym3<T> h;
  T const isotropic = T(2) * s.d.d2 * dot(b, b);
  for (int k = 0; k < 6; ++k) h.s[k] = k < 3 ? isotropic : T(0);
  if constexpr (Model::use.d1) {
    // For u = e_k, a = axial(R^T e_k b^T) = (row k of R) x b up to sign.
    Vec3<T> a[3], Ga[3];
    for (int k = 0; k < 3; ++k) {
      a[k] = cross(Vec3<T>{s.R(k, 0), s.R(k, 1), s.R(k, 2)}, b);
      Ga[k] = s.G_inv * a[k];
    }
    for (int k = 0; k < entries; ++k) h.s[k] = h.s[k] + s.d.d1 * dot(a[row[k]], Ga[col[k]]);
    if constexpr (Model::use.d11) {
      Vec3<T> const Rb = s.R * b;
      for (int k = 0; k < entries; ++k) h.s[k] = h.s[k] + s.d.d11 * Rb[row[k]] * Rb[col[k]];
    }
  }
  if constexpr (Model::use.d22) {
    Vec3<T> const Fb = s.F * b;
    for (int k = 0; k < entries; ++k) {
      h.s[k] = h.s[k] + T(4) * s.d.d22 * Fb[row[k]] * Fb[col[k]];
    }
  }
  if constexpr (Model::use.d3) {
    Vec3<T> const Cb = s.C * b;
    for (int k = 0; k < entries; ++k) h.s[k] = h.s[k] + s.d.d33 * Cb[row[k]] * Cb[col[k]];
  }
  return h;
}

}  // namespace taut

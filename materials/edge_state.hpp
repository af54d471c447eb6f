// An isotropic material of I2 and J at a tet, by the edges of the tet instead of by F: F, dF and
// the products P b_a are then not needed. With D the edges, d a change of them, B the inverse of D
// at rest, F = D B, dF = d B and G = B B^T,
//
//   F B^T = D G,   C B^T = det(B) cof(D),   P B^T = 2 dPsi/dI2 F B^T + dPsi/dJ C B^T,
//
// as C = cof(D) cof(B) and cof(B) B^T = det(B) 1. Column a of P B^T is P b_a, and
//
//   I2 = F B^T : D,   J = det(B) det(D),   F : dF = F B^T : d,   C : dF = C B^T : d,
//   dF : dF = G : d^T d,   F : cof(dF) = det(B) D : cof(d).
//
// Derived here; the terms are those of isotropic.hpp.
#pragma once

#include <taut/core/math/edges.hpp>
#include <taut/materials/isotropic.hpp>

namespace taut {

/// A model at one tet, evaluated once. T may be a pack of elements; what is not used costs nothing.
template <class Model, class T>
struct EdgeState {
  static_assert(!Model::use.d1, "taut: I1 needs the rotation of F");
  Mat3<T> D;
  Mat3<T> FB, CB;  ///< F B^T, C B^T
  Sym3<T> G;       ///< B B^T
  T det_B;
  Invariants<T> invariants;
  InvariantDerivatives<T> d;

  /// Of the corner in place `a`, 0 to 3, where b_3 = -(b_0 + b_1 + b_2): |b_a|^2, and column a of
  /// F B^T or C B^T, up to the sign.
  KOKKOS_FORCEINLINE_FUNCTION T square_b(int a) const {
    return a < 3 ? G.s[a] : G.s[0] + G.s[1] + G.s[2] + T(2) * (G.s[3] + G.s[4] + G.s[5]);
  }
  KOKKOS_FORCEINLINE_FUNCTION static Vec3<T> corner(Mat3<T> const& columns, int a) {
    if (a < 3) return columns.column(a);
    return columns.column(0) + columns.column(1) + columns.column(2);
  }
};

/// At edges D, m, with B, 1/m.
template <class Model, class T>
KOKKOS_FORCEINLINE_FUNCTION EdgeState<Model, T> evaluate_edges(Lame<T> const& lame,
                                                               Mat3<T> const& B, Mat3<T> const& D) {
  EdgeState<Model, T> s;
  s.D = D;
  s.det_B = determinant(B);
  ScaledCofactor<T> const cofactor = scaled_cofactor(s.det_B, D);
  s.CB = cofactor.C;
  s.invariants.J = cofactor.det;
  s.G = gram_of_rows(B);
  s.FB = D * s.G;
  s.invariants.I2 = contract_columns(s.FB, D);
  s.d = Model::derivatives(lame, s.invariants);
  return s;
}

/// Psi at D less Psi at D - d, as accurate as energy_change of isotropic.hpp.
template <class Model, class T>
KOKKOS_FORCEINLINE_FUNCTION T energy_change(Lame<T> const& lame, EdgeState<Model, T> const& s,
                                            Mat3<T> const& d) {
  Vec3<T> const d0 = d.column(0), d1 = d.column(1), d2 = d.column(2);
  Vec3<T> const before0 = s.D.column(0) - d0, before1 = s.D.column(1) - d1;
  Invariants<T> change;
  change.I2 = T(2) * contract_columns(s.FB, d) - contract(s.G, gram_of_columns(d));
  change.J = dot(d0, s.CB.column(0)) +
             s.det_B * dot(before0, cross(d1, s.D.column(2)) + cross(before1, d2));
  return Model::change(lame, s.invariants, change);
}

/// P b_a of the corner in place `a` below 3.
template <class Model, class T>
KOKKOS_FORCEINLINE_FUNCTION Vec3<T> corner_stress(EdgeState<Model, T> const& s, int a) {
  Vec3<T> const of_length = (T(2) * s.d.d2) * s.FB.column(a);
  if constexpr (!Model::use.d3) return of_length;
  return of_length + s.d.d3 * s.CB.column(a);
}

/// dF : d2Psi/dF2 : dF, unfiltered.
template <class Model, class T>
KOKKOS_FORCEINLINE_FUNCTION T quadratic_form(EdgeState<Model, T> const& s, Mat3<T> const& d) {
  T q = T(2) * s.d.d2 * contract(s.G, gram_of_columns(d));
  if constexpr (Model::use.d22) q = q + T(4) * s.d.d22 * square(contract_columns(s.FB, d));
  if constexpr (Model::use.d3 && !Model::allows_inversion) {
    // With G = (C B^T)^T d = J D^-1 d, which the certificate of inversion_sweeps.hpp needs, too:
    // C : dF = tr G and F : cof(dF) = ((tr G)^2 - tr G^2) / 2J.
    Mat3<T> const G = transpose_times(s.CB, d);
    T const trace_G = trace(G), square_of_trace = square(trace_G);
    T const of_square = square(G(0, 0)) + square(G(1, 1)) + square(G(2, 2)) +
                        T(2) * (G(0, 1) * G(1, 0) + G(1, 2) * G(2, 1) + G(0, 2) * G(2, 0));
    q = q + s.d.d33 * square_of_trace +
        (s.d.d3 * (T(1) / s.invariants.J)) * (square_of_trace - of_square);
  } else if constexpr (Model::use.d3) {
    Vec3<T> const d0 = d.column(0), d1 = d.column(1), d2 = d.column(2);
    Vec3<T> const D1 = s.D.column(1), D2 = s.D.column(2);
    T const of_cofactor =
        dot(d0, cross(d1, D2) + cross(D1, d2)) + dot(s.D.column(0), cross(d1, d2));
    q = q + s.d.d33 * square(contract_columns(s.CB, d)) + (T(2) * s.d.d3 * s.det_B) * of_cofactor;
  }
  return q;
}

/// vertex_block of isotropic.hpp for the corner in place `a`.
template <class Model, bool diagonal_only, class T>
KOKKOS_FORCEINLINE_FUNCTION Sym3<T> vertex_block(EdgeState<Model, T> const& s, int a) {
  constexpr int row[6] = {0, 1, 2, 0, 1, 0}, col[6] = {0, 1, 2, 1, 2, 2};
  constexpr int entries = diagonal_only ? 3 : 6;
  Sym3<T> h;
  T const isotropic = T(2) * s.d.d2 * s.square_b(a);
  for (int k = 0; k < 6; ++k) h.s[k] = k < 3 ? isotropic : T(0);
  if constexpr (Model::use.d22) {
    Vec3<T> const v = s.corner(s.FB, a), w = (T(4) * s.d.d22) * v;
    for (int k = 0; k < entries; ++k) h.s[k] = h.s[k] + w[row[k]] * v[col[k]];
  }
  if constexpr (Model::use.d3) {
    Vec3<T> const v = s.corner(s.CB, a), w = s.d.d33 * v;
    for (int k = 0; k < entries; ++k) h.s[k] = h.s[k] + w[row[k]] * v[col[k]];
  }
  return h;
}

}  // namespace taut

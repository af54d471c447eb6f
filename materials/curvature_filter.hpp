// What is done about negative curvature, element by element. A filter turns a material's second
// derivatives into the positive semi-definite ones that preconditioners and step lengths use; it
// never touches energy or stress. Each filter gives
//
//   diagonal(s, b)   the three diagonal entries for a vertex with dF = u b^T
//   block(s, b)      its symmetric 3x3 block
//   quadratic(s, dF) dF : H : dF
//   at(s)            diagonal(b) and block(b) of many b, for what has more vertices than a tet
//
// per unit volume; T may be a pack of elements. One with `by_edges` gives them of an EdgeState as
// well, with the place of a corner for b and the change of the edges for dF.
#pragma once

#include <taut/core/math/psd_projection.hpp>
#include <taut/materials/edge_state.hpp>
#include <taut/materials/isotropic.hpp>
#include <taut/materials/singular_frame.hpp>

namespace taut {

namespace kernels {
template <class T>
KOKKOS_FORCEINLINE_FUNCTION Vec3<T> clamped_diagonal(Sym3<T> const& h) {
  return {max(h.s[0], T(0)), max(h.s[1], T(0)), max(h.s[2], T(0))};
}

/// The state with the negative weights of squares in a vertex block left out. What remains of the
/// block, but for the term with dPsi/dI1, is positive semi-definite for every model.
template <class Model, class T, template <class, class> class State>
KOKKOS_FORCEINLINE_FUNCTION void keep_squares(State<Model, T>& s) {
  s.d.d2 = max(s.d.d2, T(0));
  if constexpr (Model::use.d11) s.d.d11 = max(s.d.d11, T(0));
  if constexpr (Model::use.d22) s.d.d22 = max(s.d.d22, T(0));
  if constexpr (Model::use.d3) s.d.d33 = max(s.d.d33, T(0));
}
}  // namespace kernels

/// The filtered curvature of one state as a function of b: where a filter has nothing to compute
/// that does not depend on b. The state must outlive it.
template <class Filter, class Model, class T>
struct CurvatureAt {
  IsotropicState<Model, T> const& state;

  KOKKOS_FORCEINLINE_FUNCTION Vec3<T> diagonal(Vec3<T> const& b) const {
    return Filter::template diagonal<Model>(state, b);
  }
  KOKKOS_FORCEINLINE_FUNCTION Sym3<T> block(Vec3<T> const& b) const {
    return Filter::template block<Model>(state, b);
  }
};

/// The paper's: each of the twelve diagonal entries and the scalar dF:H:dF are cut off at zero.
struct ClampElement {
  static constexpr char const* name = "clamp";
  static constexpr bool by_edges = true;

  template <class Model, class T>
  KOKKOS_FORCEINLINE_FUNCTION static CurvatureAt<ClampElement, Model, T> at(
      IsotropicState<Model, T> const& s) {
    return {s};
  }
  template <class Model, class State, class Corner>
  KOKKOS_FORCEINLINE_FUNCTION static auto diagonal(State const& s, Corner const& b) {
    return kernels::clamped_diagonal(vertex_block<Model, true>(s, b));
  }
  template <class Model, class State, class Corner>
  KOKKOS_FORCEINLINE_FUNCTION static auto block(State const& s, Corner const& b) {
    // Without I1 a vertex block is a sum of squares, which needs no eigenvalues.
    if constexpr (Model::use.d1) {
      return project_psd(vertex_block<Model, false>(s, b));
    } else {
      State positive = s;
      kernels::keep_squares(positive);
      return vertex_block<Model, false>(positive, b);
    }
  }
  template <class Model, class State, class T>
  KOKKOS_FORCEINLINE_FUNCTION static T quadratic(State const& s, Mat3<T> const& dF) {
    return max(quadratic_form<Model>(s, dF), T(0));
  }
};

/// The public reference's "filter" variants, without its index error: the curvature of the
/// rotation, lambda = 2 / (si + sj), is limited to 1 for all three pairs, and a negative volumetric
/// term dPsi/dJ F:cof(dF) is dropped. What is left may still be negative for models outside ARAP
/// and fixed corotated, so their squares are limited to positive weights, dPsi/dI1 to what
/// 2 dPsi/dI2 outweighs (|axial(R^T dF)| <= |dF| for a vertex, times lambda / 2 <= 1/2), and the
/// element is clamped as well.
struct LimitLambda {
  static constexpr char const* name = "limit_lambda";

  template <class Model, class T>
  KOKKOS_FORCEINLINE_FUNCTION static CurvatureAt<LimitLambda, Model, T> at(
      IsotropicState<Model, T> const& s) {
    return {s};
  }
  template <class Model, class T>
  KOKKOS_FORCEINLINE_FUNCTION static Vec3<T> diagonal(IsotropicState<Model, T> const& s,
                                                      Vec3<T> const& b) {
    return kernels::clamped_diagonal(vertex_block<Model, true>(limited(s), b));
  }
  template <class Model, class T>
  KOKKOS_FORCEINLINE_FUNCTION static Sym3<T> block(IsotropicState<Model, T> const& s,
                                                   Vec3<T> const& b) {
    return vertex_block<Model, false>(limited(s), b);
  }
  template <class Model, class T>
  KOKKOS_FORCEINLINE_FUNCTION static T quadratic(IsotropicState<Model, T> const& s,
                                                 Mat3<T> const& dF) {
    IsotropicState<Model, T> l = limited(s);
    if constexpr (Model::use.d3) {
      l.d.d3 = select(l.d.d3 * contract(s.F, cofactor(dF)) < T(0), T(0), l.d.d3);
    }
    return max(quadratic_form<Model>(l, dF), T(0));
  }

private:
  template <class Model, class T>
  KOKKOS_FORCEINLINE_FUNCTION static IsotropicState<Model, T> limited(
      IsotropicState<Model, T> const& s) {
    IsotropicState<Model, T> l = s;
    if constexpr (Model::use.d1) {
      // lambda / 2 are the eigenvalues of G_inv. A negative one (si + sj < 0) becomes the limit
      // too: it comes from a sum that passed through zero, where lambda grew without bound.
      SymmetricEigen<T> e = symmetric_eigen(s.G_inv);
      for (int k = 0; k < 3; ++k) {
        e.values[k] = select(e.values[k] < T(0), T(0.5), min(e.values[k], T(0.5)));
      }
      l.G_inv = e.compose();
    }
    kernels::keep_squares(l);
    if constexpr (Model::use.d1) l.d.d1 = max(l.d.d1, T(-4) * l.d.d2);
    return l;
  }
};

/// Exact projection: the negative eigenvalues of d2Psi/dF2 are set to zero (analytic eigensystem in
/// the frame of the singular vectors, see singular_frame.hpp).
struct FullProjection {
  static constexpr char const* name = "projection";

  template <class T>
  struct At {
    SingularFrame<T> frame;

    KOKKOS_FORCEINLINE_FUNCTION Vec3<T> diagonal(Vec3<T> const& b) const {
      Sym3<T> const h = block(b);
      return {h.s[0], h.s[1], h.s[2]};
    }
    KOKKOS_FORCEINLINE_FUNCTION Sym3<T> block(Vec3<T> const& b) const {
      Vec3<T> const beta = transpose_times(frame.V, b);
      Mat3<T> const h = frame.vertex_pair(beta, beta);
      return {{h(0, 0), h(1, 1), h(2, 2), h(0, 1), h(1, 2), h(0, 2)}};
    }
  };
  template <class Model, class T>
  KOKKOS_FORCEINLINE_FUNCTION static At<T> at(IsotropicState<Model, T> const& s) {
    return {singular_frame<Model>(s)};
  }
  template <class Model, class T>
  KOKKOS_FORCEINLINE_FUNCTION static Vec3<T> diagonal(IsotropicState<Model, T> const& s,
                                                      Vec3<T> const& b) {
    return at<Model>(s).diagonal(b);
  }
  template <class Model, class T>
  KOKKOS_FORCEINLINE_FUNCTION static Sym3<T> block(IsotropicState<Model, T> const& s,
                                                   Vec3<T> const& b) {
    return at<Model>(s).block(b);
  }
  template <class Model, class T>
  KOKKOS_FORCEINLINE_FUNCTION static T quadratic(IsotropicState<Model, T> const& s,
                                                 Mat3<T> const& dF) {
    return contract(singular_frame<Model>(s).apply(dF), dF);
  }
};

}  // namespace taut

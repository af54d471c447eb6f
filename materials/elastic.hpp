// A constitutive law as a discretisation takes it: an isotropic model together with a curvature
// filter. Satisfies ElementMaterial of core/fem and serves tets and particles alike.
//
//   using Rubber = Elastic<StableNeoHookean>;                    // the paper's clamped curvature
//   using Steel = Elastic<FixedCorotated, FullProjection>;
#pragma once

#include <taut/materials/curvature_filter.hpp>

namespace taut {

template <class Model_, class Filter_ = ClampElement>
struct Elastic {
  using Model = Model_;
  using Filter = Filter_;
  template <class T>
  using Parameters = Lame<T>;
  template <class T>
  using State = IsotropicState<Model, T>;
  template <class T>
  using Frame = SingularFrame<T>;

  static constexpr char const* name = Model::name;
  static constexpr bool allows_inversion = Model::allows_inversion;
  /// Whether the edges of a tet serve instead of F (edge_state.hpp).
  static constexpr bool by_edges = !Model::use.d1 && requires { requires Filter::by_edges; };

  template <class T>
  KOKKOS_FORCEINLINE_FUNCTION static Parameters<T> cast(Parameters<double> const& p) {
    using V = ValueType<T>;
    return {T(static_cast<V>(p.mu)), T(static_cast<V>(p.lambda))};
  }

  /// Psi(F), Pa.
  template <class T>
  KOKKOS_FORCEINLINE_FUNCTION static T energy(Lame<T> const& p, Mat3<T> const& F) {
    return taut::energy<Model>(p, F);
  }
  template <class T>
  KOKKOS_FORCEINLINE_FUNCTION static State<T> evaluate(Lame<T> const& p, Mat3<T> const& F) {
    return taut::evaluate<Model>(p, F);
  }
  /// At the edges D = F B^-1. What is made of the state then takes the place of a corner, 0 to 3,
  /// for its b, and a change of the edges for dF.
  template <class T>
  KOKKOS_FORCEINLINE_FUNCTION static EdgeState<Model, T> evaluate_edges(Lame<T> const& p,
                                                                        Mat3<T> const& B,
                                                                        Mat3<T> const& D) {
    return taut::evaluate_edges<Model>(p, B, D);
  }
  /// Makes stress and curvature of the state those of a volume `weight`.
  template <class AnyState, class T>
  KOKKOS_FORCEINLINE_FUNCTION static void weigh(AnyState& s, T const& weight) {
    s.d = weight * s.d;
  }
  /// Psi(F) - Psi(F - dF) without cancellation.
  template <class AnyState, class T>
  KOKKOS_FORCEINLINE_FUNCTION static T change(Lame<T> const& p, AnyState const& s,
                                              Mat3<T> const& dF) {
    return energy_change<Model>(p, s, dF);
  }
  /// First Piola-Kirchhoff stress P(F), Pa.
  template <class T>
  KOKKOS_FORCEINLINE_FUNCTION static Mat3<T> stress(State<T> const& s) {
    return taut::stress<Model>(s);
  }
  /// P b_a of the corner in place `a` below 3.
  template <class T>
  KOKKOS_FORCEINLINE_FUNCTION static Vec3<T> corner_stress(EdgeState<Model, T> const& s, int a) {
    return taut::corner_stress<Model>(s, a);
  }
  /// Filtered curvature of a vertex with dF = u b^T: diagonal and 3x3 block.
  template <class AnyState, class Corner>
  KOKKOS_FORCEINLINE_FUNCTION static auto diagonal(AnyState const& s, Corner const& b) {
    return Filter::template diagonal<Model>(s, b);
  }
  template <class AnyState, class Corner>
  KOKKOS_FORCEINLINE_FUNCTION static auto block(AnyState const& s, Corner const& b) {
    return Filter::template block<Model>(s, b);
  }
  /// The same of many b: `.diagonal(b)` and `.block(b)`. The state must outlive it.
  template <class T>
  KOKKOS_FORCEINLINE_FUNCTION static auto curvature(State<T> const& s) {
    return Filter::template at<Model>(s);
  }
  /// Filtered dF : H : dF.
  template <class AnyState, class T>
  KOKKOS_FORCEINLINE_FUNCTION static T quadratic(AnyState const& s, Mat3<T> const& dF) {
    return Filter::template quadratic<Model>(s, dF);
  }
  /// The exactly projected second derivative; `apply(dF)` and `vertex_pair(V^T b_a, V^T b_b)`.
  template <class T>
  KOKKOS_FORCEINLINE_FUNCTION static Frame<T> frame(State<T> const& s) {
    return singular_frame<Model>(s);
  }
};

}  // namespace taut

// A material at one tet with the edges D and the inverse B of those at rest, as the sweeps take it:
// by its deformation gradient F = D B, or by the edges alone where the material can do that.
#pragma once

#include <taut/core/fem/element_material.hpp>

namespace taut::kernels {

/// Row a of B (a = 0, 1, 2) or minus their sum (a = 3): the gradient of the shape function of the
/// corner in place a.
template <class T>
KOKKOS_FORCEINLINE_FUNCTION Vec3<T> shape_gradient(Mat3<T> const& B, int a) {
  if (a < 3) return {B(a, 0), B(a, 1), B(a, 2)};
  Vec3<T> b;
  for (int c = 0; c < 3; ++c) b[c] = -(B(0, c) + B(1, c) + B(2, c));
  return b;
}

template <class Material>
concept EdgeMaterial = ElementMaterial<Material> && requires {
  requires Material::by_edges;
};

/// What is asked for is per unit of rest volume until `weigh`, which comes once, and then for a
/// rest volume `weight`; d is a change of D. T may be a pack.
template <class Material, class T>
class TetState {
  template <class Real>
  using Parameters = typename Material::template Parameters<Real>;

public:
  KOKKOS_FORCEINLINE_FUNCTION TetState(Parameters<T> const& parameters, Mat3<T> const& B,
                                       Mat3<T> const& D)
      : parameters_(parameters), B_(B), state_(Material::evaluate(parameters, D * B)) {}

  /// Psi at D less Psi at D - d.
  KOKKOS_FORCEINLINE_FUNCTION T change(Mat3<T> const& d) const {
    return Material::change(parameters_, state_, d * B_);
  }
  /// The curvature along d.
  KOKKOS_FORCEINLINE_FUNCTION T quadratic(Mat3<T> const& d) const {
    return Material::quadratic(state_, d * B_);
  }
  KOKKOS_FORCEINLINE_FUNCTION void weigh(T const& weight) {
    Material::weigh(state_, weight);
    stress_ = Material::stress(state_);
  }
  /// The gradient with respect to the corner in place `a` below 3.
  KOKKOS_FORCEINLINE_FUNCTION Vec3<T> gradient(int a) const {
    return stress_ * shape_gradient(B_, a);
  }
  /// The curvature of the corner in place `a`.
  KOKKOS_FORCEINLINE_FUNCTION Vec3<T> diagonal(int a) const {
    return Material::diagonal(state_, shape_gradient(B_, a));
  }
  KOKKOS_FORCEINLINE_FUNCTION Sym3<T> block(int a) const {
    return Material::block(state_, shape_gradient(B_, a));
  }

private:
  Parameters<T> const& parameters_;
  Mat3<T> const B_;
  typename Material::template State<T> state_;
  Mat3<T> stress_;
};

template <EdgeMaterial Material, class T>
class TetState<Material, T> {
  template <class Real>
  using Parameters = typename Material::template Parameters<Real>;

public:
  KOKKOS_FORCEINLINE_FUNCTION TetState(Parameters<T> const& parameters, Mat3<T> const& B,
                                       Mat3<T> const& D)
      : parameters_(parameters), state_(Material::evaluate_edges(parameters, B, D)) {}

  KOKKOS_FORCEINLINE_FUNCTION T change(Mat3<T> const& d) const {
    return Material::change(parameters_, state_, d);
  }
  KOKKOS_FORCEINLINE_FUNCTION T quadratic(Mat3<T> const& d) const {
    return Material::quadratic(state_, d);
  }
  KOKKOS_FORCEINLINE_FUNCTION void weigh(T const& weight) { Material::weigh(state_, weight); }
  KOKKOS_FORCEINLINE_FUNCTION Vec3<T> gradient(int a) const {
    return Material::corner_stress(state_, a);
  }
  KOKKOS_FORCEINLINE_FUNCTION Vec3<T> diagonal(int a) const {
    return Material::diagonal(state_, a);
  }
  KOKKOS_FORCEINLINE_FUNCTION Sym3<T> block(int a) const { return Material::block(state_, a); }

private:
  Parameters<T> const& parameters_;
  decltype(Material::evaluate_edges(std::declval<Parameters<T> const&>(), Mat3<T>(),
                                    Mat3<T>())) state_;
};

}  // namespace taut::kernels

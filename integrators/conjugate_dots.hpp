// The scalar products that the formulas for beta are made of (beta.hpp), in one pass over the
// unknowns: of a scene as one, or summed per body (island_descent.hpp).
#pragma once

#include <taut/integrators/fields.hpp>
#include <taut/integrators/preconditioner.hpp>

namespace taut::kernels {

/// z = P g and w = P y, computed in passing or read from memory.
template <class P, class S>
struct PreconditionedGradient {
  using Real = typename P::real;
  using Vectors = VectorField<Real, S>;
  Vectors gradient, gradient_before;
  LocalMatrices<P, S> local;
  Vectors z, z_before;  ///< P g and P (g before), if P is not pointwise

  KOKKOS_FUNCTION Vec3<Real> change(int i) const {
    return load3<Real>(gradient, i) - load3<Real>(gradient_before, i);
  }
  KOKKOS_FUNCTION Vec3<Real> of_gradient(int i) const {
    return z.extent(0) > 0 ? load3<Real>(z, i) : local.product(i, load3<Real>(gradient, i));
  }
  KOKKOS_FUNCTION Vec3<Real> of_change(int i) const {
    return z.extent(0) > 0 ? load3<Real>(z, i) - load3<Real>(z_before, i)
                           : local.product(i, change(i));
  }
};

/// All scalar products of an iteration, between p of the last step and both gradients.
template <class P, class S>
struct ConjugateDots {
  enum { g_P_g, g_P_y, y_P_y, before_P_before, g_p, y_p, g_g, g_Minv_g, count };
  PreconditionedGradient<P, S> preconditioned;
  VectorField<typename P::real, S> p;
  Array<typename P::real, S> mass;

  KOKKOS_FUNCTION void operator()(int i, Sums<typename P::sum, count>& sums) const {
    using Sum = typename P::sum;
    auto const g = load3<Sum>(preconditioned.gradient, i);
    auto const y = convert<Sum>(preconditioned.change(i));
    auto const z = convert<Sum>(preconditioned.of_gradient(i));
    auto const w = convert<Sum>(preconditioned.of_change(i));
    auto const last = load3<Sum>(p, i);
    Sum const gg = dot(g, g);
    sums[g_P_g] += dot(g, z);
    sums[g_P_y] += dot(g, w);
    sums[y_P_y] += dot(y, w);
    sums[before_P_before] += dot(g - y, z - w);
    sums[g_p] += dot(g, last);
    sums[y_p] += dot(y, last);
    sums[g_g] += gg;
    if (gg > 0) sums[g_Minv_g] += gg / Sum(mass(i));
  }
};

}  // namespace taut::kernels

// The invariants in which every isotropic model of this library is written (Kim and Eberle 2022,
// chapter 5; Shen et al. 2024, section 3.1), with F = R S the rotation-variant polar decomposition:
//
//   I1 = tr S = s0 + s1 + s2 (signed),   I2 = F : F,   J = I3 = det F
//
// A model is a sum of functions of one invariant each, so three first and three second derivatives
// say all about it.
#pragma once

#include <taut/core/math/matrix.hpp>

namespace taut {

/// Lame parameters, Pa.
template <class T>
struct Lame {
  T mu, lambda;
};

/// Lame parameters of small-strain elasticity. young in Pa, poisson in (-1, 0.5).
inline Lame<double> lame_parameters(double young, double poisson) {
  return {young / (2 * (1 + poisson)), young * poisson / ((1 + poisson) * (1 - 2 * poisson))};
}

template <class T>
struct Invariants {
  T I1;  ///< valid only for models that use it
  T I2;
  T J;
};

/// dPsi/dI_i and d2Psi/dI_i^2, Pa.
template <class T>
struct InvariantDerivatives {
  T d1, d2, d3;
  T d11, d22, d33;
};
template <class T>
KOKKOS_FORCEINLINE_FUNCTION InvariantDerivatives<T> operator*(T const& w,
                                                              InvariantDerivatives<T> const& d) {
  return {w * d.d1, w * d.d2, w * d.d3, w * d.d11, w * d.d22, w * d.d33};
}

/// Which derivatives a model has at all; what is false costs nothing.
struct InvariantUse {
  bool d1 = false;   ///< depends on I1: needs the polar decomposition
  bool d3 = false;   ///< depends on J
  bool d11 = false;  ///< not linear in I1
  bool d22 = false;  ///< not linear in I2
};

}  // namespace taut

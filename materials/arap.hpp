// As-rigid-as-possible energy, Psi = mu |F - R|^2 = mu (I2 - 2 I1 + 3). Poisson's ratio has no
// effect.
#pragma once

#include <taut/materials/invariants.hpp>

namespace taut {

struct Arap {
  static constexpr char const* name = "arap";
  static constexpr bool allows_inversion = true;
  static constexpr InvariantUse use{.d1 = true};

  template <class T>
  KOKKOS_FORCEINLINE_FUNCTION static T energy(Lame<T> const& m, Invariants<T> const& i) {
    return m.mu * (i.I2 - T(2) * i.I1 + T(3));
  }
  template <class T>
  KOKKOS_FORCEINLINE_FUNCTION static T change(Lame<T> const& m, Invariants<T> const&,
                                              Invariants<T> const& d) {
    return m.mu * (d.I2 - T(2) * d.I1);
  }
  template <class T>
  KOKKOS_FORCEINLINE_FUNCTION static InvariantDerivatives<T> derivatives(Lame<T> const& m,
                                                                         Invariants<T> const&) {
    return {.d1 = T(-2) * m.mu, .d2 = m.mu, .d3 = T(0), .d11 = T(0), .d22 = T(0), .d33 = T(0)};
  }
};

}  // namespace taut

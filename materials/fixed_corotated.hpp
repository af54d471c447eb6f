// Fixed corotated energy, Psi = mu |F - R|^2 + lambda/2 (J - 1)^2 (Stomakhin et al. 2012).
#pragma once

#include <taut/materials/invariants.hpp>

namespace taut {

struct FixedCorotated {
  static constexpr char const* name = "fixed_corotated";
  static constexpr bool allows_inversion = true;
  static constexpr InvariantUse use{.d1 = true, .d3 = true};

  template <class T>
  KOKKOS_FORCEINLINE_FUNCTION static T energy(Lame<T> const& m, Invariants<T> const& i) {
    return m.mu * (i.I2 - T(2) * i.I1 + T(3)) + T(0.5) * m.lambda * square(i.J - T(1));
  }
  template <class T>
  KOKKOS_FORCEINLINE_FUNCTION static T change(Lame<T> const& m, Invariants<T> const& i,
                                              Invariants<T> const& d) {
    return m.mu * (d.I2 - T(2) * d.I1) + m.lambda * d.J * (i.J - T(1) - T(0.5) * d.J);
  }
  template <class T>
  KOKKOS_FORCEINLINE_FUNCTION static InvariantDerivatives<T> derivatives(Lame<T> const& m,
                                                                         Invariants<T> const& i) {
    return {.d1 = T(-2) * m.mu,
            .d2 = m.mu,
            .d3 = m.lambda * (i.J - T(1)),
            .d11 = T(0),
            .d22 = T(0),
            .d33 = m.lambda};
  }
};

}  // namespace taut

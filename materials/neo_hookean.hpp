// Neo-Hookean energy of Bonet and Wood, Psi = mu/2 (I2 - 3) - mu ln J + lambda/2 (ln J)^2. It is
// infinite at J = 0 and undefined below: a step must keep J > 0.
#pragma once

#include <taut/core/math/logarithm.hpp>
#include <taut/materials/invariants.hpp>

namespace taut {

struct NeoHookean {
  static constexpr char const* name = "neo_hookean";
  static constexpr bool allows_inversion = false;
  static constexpr InvariantUse use{.d3 = true};

  template <class T>
  KOKKOS_FORCEINLINE_FUNCTION static T energy(Lame<T> const& m, Invariants<T> const& i) {
    T const log_j = log(i.J);
    return T(0.5) * m.mu * (i.I2 - T(3)) + log_j * (T(0.5) * m.lambda * log_j - m.mu);
  }
  template <class T>
  KOKKOS_FORCEINLINE_FUNCTION static T change(Lame<T> const& m, Invariants<T> const& i,
                                              Invariants<T> const& d) {
    T const log_j = log(i.J);
    T const d_log = -log1p(-d.J * (T(1) / i.J));  // the reciprocal is known from the stress
    return T(0.5) * m.mu * d.I2 + d_log * (m.lambda * (log_j - T(0.5) * d_log) - m.mu);
  }
  template <class T>
  KOKKOS_FORCEINLINE_FUNCTION static InvariantDerivatives<T> derivatives(Lame<T> const& m,
                                                                         Invariants<T> const& i) {
    T const log_j = log(i.J);
    T const inverse = T(1) / i.J;
    return {.d1 = T(0),
            .d2 = T(0.5) * m.mu,
            .d3 = (m.lambda * log_j - m.mu) * inverse,
            .d11 = T(0),
            .d22 = T(0),
            .d33 = (m.lambda * (T(1) - log_j) + m.mu) * square(inverse)};
  }
};

}  // namespace taut

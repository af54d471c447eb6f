// The two stable neo-Hookean energies; both are finite for inverted elements.
#pragma once

#include <taut/core/math/logarithm.hpp>
#include <taut/materials/invariants.hpp>

namespace taut {

/// As in Shen et al. 2024: Psi = mu/2 (I2 - 3) - mu (J - 1) + lambda/2 (J - 1)^2. Its small-strain
/// first Lame parameter is lambda - mu: a nominal nu = 0.4 behaves like 0.375.
/// Its bulk modulus there is lambda - mu / 3: it is unstable at rest for nu below 1/8.
struct StableNeoHookean {
  static constexpr char const* name = "stable_neo_hookean";
  static constexpr bool allows_inversion = true;
  static constexpr InvariantUse use{.d3 = true};

  template <class T>
  KOKKOS_FORCEINLINE_FUNCTION static T energy(Lame<T> const& m, Invariants<T> const& i) {
    T const v = i.J - T(1);
    return T(0.5) * m.mu * (i.I2 - T(3)) + v * (T(0.5) * m.lambda * v - m.mu);
  }
  template <class T>
  KOKKOS_FORCEINLINE_FUNCTION static T change(Lame<T> const& m, Invariants<T> const& i,
                                              Invariants<T> const& d) {
    return T(0.5) * m.mu * d.I2 + d.J * (m.lambda * (i.J - T(1) - T(0.5) * d.J) - m.mu);
  }
  template <class T>
  KOKKOS_FORCEINLINE_FUNCTION static InvariantDerivatives<T> derivatives(Lame<T> const& m,
                                                                         Invariants<T> const& i) {
    return {.d1 = T(0),
            .d2 = T(0.5) * m.mu,
            .d3 = m.lambda * (i.J - T(1)) - m.mu,
            .d11 = T(0),
            .d22 = T(0),
            .d33 = m.lambda};
  }
};

/// Smith et al. 2018: Psi = m/2 (I2 - 3) + l/2 (J - a)^2 - m/2 ln(I2 + 1) + const, with m = 4/3 mu,
/// l = lambda + 5/6 mu and a = 1 + 3 m / (4 l), so that the small-strain moduli are the nominal
/// ones; the constant makes the rest energy zero.
struct StableNeoHookean2018 {
  static constexpr char const* name = "stable_neo_hookean_2018";
  static constexpr bool allows_inversion = true;
  static constexpr InvariantUse use{.d3 = true, .d22 = true};

  template <class T>
  KOKKOS_FORCEINLINE_FUNCTION static T energy(Lame<T> const& m, Invariants<T> const& i) {
    auto const [mu, lambda, v] = reparametrised(m, i);
    T const rest = T(0.75) * mu / lambda;
    return T(0.5) * (mu * (i.I2 - T(3) - log1p(T(0.25) * (i.I2 - T(3)))) +
                     lambda * (square(v) - square(rest)));
  }
  template <class T>
  KOKKOS_FORCEINLINE_FUNCTION static T change(Lame<T> const& m, Invariants<T> const& i,
                                              Invariants<T> const& d) {
    auto const [mu, lambda, v] = reparametrised(m, i);
    return T(0.5) * mu * (d.I2 + log1p(-d.I2 / (i.I2 + T(1)))) + lambda * d.J * (v - T(0.5) * d.J);
  }
  template <class T>
  KOKKOS_FORCEINLINE_FUNCTION static InvariantDerivatives<T> derivatives(Lame<T> const& m,
                                                                         Invariants<T> const& i) {
    auto const [mu, lambda, v] = reparametrised(m, i);
    T const inverse = T(1) / (i.I2 + T(1));
    return {.d1 = T(0),
            .d2 = T(0.5) * mu * (T(1) - inverse),
            .d3 = lambda * v,
            .d11 = T(0),
            .d22 = T(0.5) * mu * square(inverse),
            .d33 = lambda};
  }

private:
  template <class T>
  struct Reparametrised {
    T mu, lambda, volume;  ///< volume = J - a
  };
  template <class T>
  KOKKOS_FORCEINLINE_FUNCTION static Reparametrised<T> reparametrised(Lame<T> const& m,
                                                                      Invariants<T> const& i) {
    T const mu = T(4.0 / 3.0) * m.mu;
    T const lambda = m.lambda + T(5.0 / 6.0) * m.mu;
    return {mu, lambda, i.J - T(1) - T(0.75) * mu / lambda};
  }
};

}  // namespace taut

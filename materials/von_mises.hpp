// Metals: the deviator of the Kirchhoff stress tau may not exceed what a bar bears at its yield
// stress, |dev tau| <= sqrt(2/3) tau_Y (von Mises 1913).
#pragma once

#include <taut/materials/return_map.hpp>

namespace taut {

/// In logarithmic strain e = ln s, with tau = 2 mu dev e + ... and linear isotropic hardening, the
/// radial return (Simo and Hughes 1998, box 3.1)
///
///   |dev e'| = |dev e| - g,   g = (2 mu |dev e| - sqrt(2/3) (tau_Y + H a)) / (2 mu + 2/3 H),
///   a' = a + sqrt(2/3) g,     tr e' = tr e,
///
/// which preserves the volume exactly. It is the default for every elastic model, with the model's
/// shear modulus.
struct VonMises {
  static constexpr char const* name = "von_mises";
  double mu = 1;            ///< Pa
  double yield_stress = 1;  ///< of the virgin material, Pa
  double hardening = 0;     ///< H: yield stress per plastic strain, Pa

  template <class T>
  struct State {
    T strain = 0;  ///< a: equivalent plastic strain so far
  };

  template <class T>
  KOKKOS_FUNCTION Returned<T> map(Mat3<T> const& trial, State<T>& state) const {
    T const root = Kokkos::sqrt(T(2) / 3), two_mu = T(2 * mu), h = T(hardening);
    Svd<T> const d = svd(trial);
    Vec3<T> const s = kernels::raised(d.s);
    Vec3<T> const e{Kokkos::log(s[0]), Kokkos::log(s[1]), Kokkos::log(s[2])};
    Vec3<T> const dev = kernels::deviator(e);
    T const size = norm(dev), limit = root * (T(yield_stress) + h * state.strain) / two_mu;
    // ln s of a thin gradient is as inexact as its smallest singular value.
    T const round_off = kernels::svd_round_off<T> * s[0] / s[2];
    if (!(size > limit + round_off)) return {trial, false};
    T const g = (size - limit) / (1 + h * T(2) / (3 * two_mu)), m = kernels::mean(e);
    state.strain += root * g;
    Vec3<T> returned;
    for (int c = 0; c < 3; ++c) returned[c] = Kokkos::exp(m + (1 - g / size) * dev[c]);
    return {kernels::compose(d, returned), true};
  }
  template <class T>
  KOKKOS_FUNCTION T stiffening(State<T> const&) const {
    return T(1);
  }
};

/// As in the public code of Wang et al. 2020 (HOT), for its fixed corotated model: with the volume
/// ratio frozen at that of the trial, tau = 2 mu (s - 1) s + lambda (J - 1) J, whose deviator is
/// cut to the limit. With x = s (s - 1) that is
///
///   x' = a x + (1 - a) mean(x),   a = limit / |dev tau|,   s' = (1 + sqrt(1 + 4 x')) / 2.
///
/// The deviator lands on the limit, but the volume changes (by a factor of 4 at large stretches),
/// and no singular value ever returns below 1/2. For comparisons; `VonMises` is better.
struct VonMisesFixedCorotated {
  static constexpr char const* name = "von_mises_fixed_corotated";
  double mu = 1;            ///< Pa
  double yield_stress = 1;  ///< Pa

  template <class T>
  struct State {};

  template <class T>
  KOKKOS_FUNCTION Returned<T> map(Mat3<T> const& trial, State<T>&) const {
    T const limit = Kokkos::sqrt(T(2) / 3) * T(yield_stress) / T(2 * mu);
    Svd<T> const d = svd(trial);
    Vec3<T> const s = kernels::raised(d.s);
    Vec3<T> const x{s[0] * (s[0] - 1), s[1] * (s[1] - 1), s[2] * (s[2] - 1)};
    T const size = norm(kernels::deviator(x)), m = kernels::mean(x);
    if (!(size > limit + kernels::svd_round_off<T> * (1 + s[0] * s[0]))) return {trial, false};
    T const a = limit / size;
    Vec3<T> returned;
    for (int c = 0; c < 3; ++c) {
      returned[c] = (1 + Kokkos::sqrt(1 + 4 * (a * x[c] + (1 - a) * m))) / 2;
    }
    return {kernels::compose(d, returned), true};
  }
  template <class T>
  KOKKOS_FUNCTION T stiffening(State<T> const&) const {
    return T(1);
  }
};

}  // namespace taut

// Snow and sand.
#pragma once

#include <taut/materials/return_map.hpp>

namespace taut {

/// Singular values are cut to [1 - compression, 1 + stretch], and what volume that takes hardens or
/// softens the material (Stomakhin et al. 2013):
///
///   Jp' = clamp(Jp det F / det F_e, least, most),   mu, lambda = exp(psi (1 - Jp)) times the
///   given.
///
/// psi = 0 gives the crumbling boards of HOT. An inverted gradient is taken for the most
/// compressed.
struct SnowClamp {
  static constexpr char const* name = "snow";
  double compression = 2e-2, stretch = 7.5e-3;
  double psi = 10;  ///< hardening
  double least = 0.6, most = 20;

  template <class T>
  struct State {
    T volume = 1;  ///< Jp: det of the plastic part of the gradient
  };

  template <class T>
  KOKKOS_FUNCTION Returned<T> map(Mat3<T> const& trial, State<T>& state) const {
    Svd<T> const d = svd(trial);
    T const low = T(1 - compression), high = T(1 + stretch);
    T const slack = kernels::svd_round_off<T>;
    // s is sorted. Written so that what is not a number is not cut.
    if (!(d.s[0] > high + slack) && !(d.s[2] < low - slack)) return {trial, false};
    Vec3<T> s;
    T ratio = 1;
    for (int c = 0; c < 3; ++c) {
      s[c] = Kokkos::min(Kokkos::max(d.s[c], low), high);
      ratio *= d.s[c] / s[c];
    }
    state.volume = Kokkos::min(Kokkos::max(state.volume * ratio, T(least)), T(most));
    return {kernels::compose(d, s), true};
  }
  template <class T>
  KOKKOS_FUNCTION T stiffening(State<T> const& state) const {
    return Kokkos::exp(T(psi) * (1 - state.volume));
  }
};

/// Sand without cohesion (Drucker and Prager 1952, as by Klar et al. 2016): in logarithmic strain
/// e = ln s, shear stress is at most proportional to pressure,
///
///   2 mu |dev e| <= -a (3 lambda + 2 mu) tr e,   a = sqrt(2/3) 2 sin phi / (3 - sin phi);
///
/// above that dev e shrinks, which preserves the volume; sand that expands (tr e >= 0) bears
/// nothing and becomes free of strain. What volume it gains by that must be lost again before it
/// bears a load: it is remembered and added to the next e (Tampubolon et al. 2017). With hardening,
/// phi grows with the plastic strain q: phi = angle + (h1 q - h3) exp(-h2 q).
struct DruckerPrager {
  static constexpr char const* name = "sand";
  double mu = 1, lambda = 1;        ///< Pa
  double angle = 35;                ///< of friction, degrees
  double h1 = 0, h2 = 0.2, h3 = 0;  ///< hardening: degrees, 1, degrees; Klar et al. have 9, 0.2, 10

  template <class T>
  struct State {
    T strain = 0;  ///< q
    T gained = 0;  ///< logarithm of the volume gained without stress
  };

  /// a at the plastic strain q.
  template <class T>
  KOKKOS_FUNCTION T slope(T const& q) const {
    T const degrees = T(angle) + (T(h1) * q - T(h3)) * Kokkos::exp(-T(h2) * q);
    T const sine = Kokkos::sin(degrees * T(Kokkos::numbers::pi / 180));
    return Kokkos::sqrt(T(2) / 3) * 2 * sine / (3 - sine);
  }

  template <class T>
  KOKKOS_FUNCTION Returned<T> map(Mat3<T> const& trial, State<T>& state) const {
    Svd<T> const d = svd(trial);
    Vec3<T> const s = kernels::raised(d.s);
    Vec3<T> e{Kokkos::log(s[0]), Kokkos::log(s[1]), Kokkos::log(s[2])};
    T const own = e[0] + e[1] + e[2], round_off = kernels::svd_round_off<T> * s[0] / s[2];
    T const trace = own + state.gained;
    Vec3<T> const dev = kernels::deviator(e);
    T const size = norm(dev);
    if (trace >= 0) {
      bool const strained = size > round_off || Kokkos::abs(own) > round_off;
      if (!strained) return {trial, false};
      state.gained = trace;
      state.strain += norm(e);
      return {kernels::compose(d, Vec3<T>{1, 1, 1}), true};
    }
    T const excess = size + slope(state.strain) * T((3 * lambda + 2 * mu) / (2 * mu)) * trace;
    bool const slides = excess > round_off;
    if (!slides && state.gained == 0) return {trial, false};
    if (!(trace < 0)) return {trial, false};  // not a number
    T const kept = slides ? 1 - excess / size : T(1), m = trace / 3;
    if (slides) state.strain += excess;
    state.gained = 0;
    Vec3<T> returned;
    for (int c = 0; c < 3; ++c) returned[c] = Kokkos::exp(m + kept * dev[c]);
    return {kernels::compose(d, returned), true};
  }
  template <class T>
  KOKKOS_FUNCTION T stiffening(State<T> const&) const {
    return T(1);
  }
};

}  // namespace taut

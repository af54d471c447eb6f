// Hencky's elasticity, quadratic in logarithmic strain, with plasticity inside the energy: for
// implicit steps in which a body yields while it moves. With F = U diag(s) V^T, e = ln s,
//
//   Psi(F) = K/2 v^2 + mu (|d|^2 - c y^2),   v = tr e,  d = dev e,  y = max(|d| - r, 0),
//
// K = lambda + 2/3 mu, and r the size of the deviator at which the material yields. For r without
// bound this is Hencky's model (1928). Otherwise F is the trial gradient of a step, all of which is
// taken to be elastic, and Psi the least that elasticity and plastic flow can make of it,
//
//   min_g  K/2 v^2 + mu (|d| - g)^2 + 2 mu r g + H/3 g^2,     c = 1 / (1 + H / (3 mu)),
//
// where g is what flow takes from the deviator, 2 mu r g what it dissipates and H/3 g^2 what goes
// into linear isotropic hardening (Ortiz and Stainier 1999). Its derivative is the stress after the
// radial return of VonMises (von_mises.hpp), its second derivative the consistent tangent (Simo and
// Hughes 1998, box 3.2), which is symmetric. A step that minimises Psi and then maps F by VonMises
// has solved the elastoplastic step.
//
// Sand does not dilate as it slides: its flow is not associated, and no energy has its stress as
// derivative. Here r is a number that a step keeps, taken from a pressure: that where the step
// began or, from minimisation to minimisation, that where the last one ended (the Lagging passes of
// a time stepper). Where those settle, the stress is that of DruckerPrager (granular.hpp), pressure
// and deviator both those of the end of the step. Sand bears no tension: v = min(tr e + gained, 0).
//
// In the singular frame (singular_frame.hpp), with the principal Kirchhoff stresses t_i = K v + 2
// mu f d_i and a_ij = d2Psi / de_i de_j,
//
//   P_i = t_i / s_i,    scaling_ij = (a_ij - delta_ij t_i) / (s_i s_j),
//   twist = (P_i + P_j) / (s_i + s_j),    flip = (P_i - P_j) / (s_i - s_j).
#pragma once

#include <taut/core/math/logarithm.hpp>
#include <taut/materials/curvature_filter.hpp>
#include <taut/materials/granular.hpp>
#include <taut/materials/von_mises.hpp>
#include <taut/materials/yield_memory.hpp>

namespace taut {

template <class T>
struct HenckyParameters {
  /// Of r where nothing yields.
  static constexpr double never = 1e30;

  T mu, bulk;          ///< Pa
  T share = T(1);      ///< c
  T tension = T(1);    ///< 1 or 0: whether it is borne
  T limit = T(never);  ///< r
  T gained = T(0);
  // Of r, for a point that remembers `plastic`: yield + hardening plastic + friction max(-v, 0).
  double yield = never, hardening = 0, friction = 0;
};

/// Elastic.
inline HenckyParameters<double> hencky(Lame<double> const& lame) {
  return {lame.mu, lame.lambda + 2 * lame.mu / 3};
}
/// Yields as `metal` maps; elastic until told what a point remembers (Hencky::with).
inline HenckyParameters<double> hencky(Lame<double> const& lame, VonMises const& metal) {
  HenckyParameters<double> m = hencky(lame);
  double const root = Kokkos::sqrt(2.0 / 3) / (2 * lame.mu);
  m.share = 1 / (1 + metal.hardening / (3 * lame.mu));
  m.yield = root * metal.yield_stress;
  m.hardening = root * metal.hardening;
  return m;
}
/// Yields as `sand` maps; its friction does not harden.
inline HenckyParameters<double> hencky(Lame<double> const& lame, DruckerPrager const& sand) {
  HenckyParameters<double> m = hencky(lame);
  m.tension = 0;
  m.yield = 0;
  m.friction = sand.slope(0.0) * 3 * m.bulk / (2 * lame.mu);
  return m;
}

/// At one F. T may be a pack of points.
template <class T>
struct HenckyState {
  Mat3<T> F;
  T J;
  Svd<T> svd;
  Vec3<T> d;     ///< dev e
  T trace;       ///< tr e + gained
  T size, over;  ///< |d|, y
  // What follows is per volume until the state is weighed.
  T pressure;         ///< K v, of either sign as stresses are
  T bulk;             ///< d2Psi / dv2
  T secant, tangent;  ///< 2 mu f, where f = 1 - c y / |d|, and 2 mu (1 - c) where it yields

  KOKKOS_FORCEINLINE_FUNCTION Vec3<T> kirchhoff() const {
    return {pressure + secant * d[0], pressure + secant * d[1], pressure + secant * d[2]};
  }
};

namespace kernels {

/// v of a trace: what of it is borne.
template <class T>
KOKKOS_FORCEINLINE_FUNCTION T borne(HenckyParameters<T> const& m, T const& trace) {
  return select(trace <= T(0), T(1), m.tension);
}

/// The second derivative of Psi; `project` = false keeps its negative eigenvalues, for tests.
template <bool project = true, class T>
KOKKOS_FORCEINLINE_FUNCTION SingularFrame<T> hencky_frame(HenckyState<T> const& state) {
  constexpr int off[3] = {4, 5, 3};
  SingularFrame<T> frame;
  frame.U = state.svd.U;
  frame.V = state.svd.V;
  Vec3<T> const &s = state.svd.s, tau = state.kirchhoff();
  // n n^T has this factor: for |d| = 0 it is zero, for there is no direction.
  T const radial = select(state.size > T(0), state.tangent - state.secant, T(0)) /
                   select(state.size > T(0), square(state.size), T(1));
  T const sphere = state.bulk - state.secant * T(1.0 / 3);
  for (int k = 0; k < 3; ++k) {
    int const i = (k + 1) % 3, j = (k + 2) % 3;
    T const per_minor = T(1) / (s[i] * s[j]);
    frame.scaling.s[k] =
        (sphere + state.secant + radial * square(state.d[k]) - tau[k]) / square(s[k]);
    frame.scaling.s[off[k]] = (sphere + radial * state.d[i] * state.d[j]) * per_minor;
    frame.twist[k] = (tau[i] / s[i] + tau[j] / s[j]) / (s[i] + s[j]);
    // t_i - t_j = 2 mu f (e_i - e_j), and (e_i - e_j) (s_i + s_j) / (s_i - s_j) = 2 artanh(x) / x.
    T const x = (s[i] - s[j]) / (s[i] + s[j]), z = square(x);
    auto const near = z < T(1e-4);
    T const series = T(1) + z * (T(1.0 / 3) + z * (T(0.2) + z * (T(1.0 / 7) + z * T(1.0 / 9))));
    T const quotient =
        select(near, series, T(0.5) * (state.d[i] - state.d[j]) / select(near, T(1), x));
    frame.flip[k] = (state.secant * quotient - T(0.5) * (tau[i] + tau[j])) * per_minor;
  }
  if constexpr (project) frame.project();
  return frame;
}

}  // namespace kernels

/// An ElementMaterial, elastic by its parameters alone. What remembers (RememberingMaterial of
/// mpm/particle_memory.hpp) yields. Its curvature is the exactly projected one.
struct Hencky {
  static constexpr char const* name = "hencky";
  static constexpr bool allows_inversion = false;
  template <class T>
  using Parameters = HenckyParameters<T>;
  template <class T>
  using State = HenckyState<T>;
  template <class T>
  using Frame = SingularFrame<T>;

  template <class T>
  KOKKOS_FORCEINLINE_FUNCTION static Parameters<T> cast(Parameters<double> const& p) {
    using V = ValueType<T>;
    return {T(V(p.mu)),     T(V(p.bulk)), T(V(p.share)), T(V(p.tension)), T(V(p.limit)),
            T(V(p.gained)), p.yield,      p.hardening,   p.friction};
  }
  /// What a point with the elastic gradient F and the number `plastic` (mpm/plastic_flow.hpp)
  /// brings into a step.
  KOKKOS_FUNCTION static YieldMemory<double> remember(Parameters<double> const& p,
                                                      Mat3<double> const& F, double plastic) {
    if (p.tension > 0) return {p.yield + p.hardening * plastic, 0};
    // A flat gradient counts as a thin one, as it does for return maps.
    double const thin = 1e-12, trace = Kokkos::log(Kokkos::max(determinant(F), thin)) + plastic;
    return {p.friction * Kokkos::max(-trace, 0.0), plastic};
  }
  /// Whether r follows a pressure.
  KOKKOS_FUNCTION static bool lags(Parameters<double> const& p) { return p.friction > 0; }
  template <class T>
  KOKKOS_FORCEINLINE_FUNCTION static Parameters<T> with(Parameters<T> p,
                                                        YieldMemory<T> const& memory) {
    p.limit = memory.limit;
    p.gained = memory.gained;
    return p;
  }

  template <class T>
  KOKKOS_FORCEINLINE_FUNCTION static State<T> evaluate(Parameters<T> const& p, Mat3<T> const& F) {
    State<T> s;
    s.F = F;
    s.J = determinant(F);
    s.svd = svd(F);
    Vec3<T> const& l = s.svd.s;
    s.d = kernels::deviator(Vec3<T>{log(l[0]), log(l[1]), log(l[2])});
    s.size = norm(s.d);
    s.trace = log(s.J) + p.gained;
    auto const yields = s.size >= p.limit;
    s.over = select(yields, s.size - p.limit, T(0));
    T const two_mu = T(2) * p.mu, borne = kernels::borne(p, s.trace);
    s.pressure = p.bulk * borne * s.trace;
    s.bulk = p.bulk * borne;
    // Where there is no deviator and none is borne, |d| = r = 0.
    T const part = select(s.size > T(0), s.over / select(s.size > T(0), s.size, T(1)), T(1));
    s.secant = select(yields, two_mu * (T(1) - p.share * part), two_mu);
    s.tangent = select(yields, two_mu * (T(1) - p.share), two_mu);
    return s;
  }
  /// Psi(F), Pa.
  template <class T>
  KOKKOS_FORCEINLINE_FUNCTION static T energy(Parameters<T> const& p, Mat3<T> const& F) {
    Vec3<T> const l = svd(F).s;
    Vec3<T> const d = kernels::deviator(Vec3<T>{log(l[0]), log(l[1]), log(l[2])});
    T const square_size = dot(d, d), over = max(sqrt(square_size) - p.limit, T(0));
    T const trace = log(determinant(F)) + p.gained;
    return T(0.5) * p.bulk * kernels::borne(p, trace) * square(trace) +
           p.mu * (square_size - p.share * square(over));
  }
  /// Makes stress and curvature of the state those of a volume `weight`.
  template <class T>
  KOKKOS_FORCEINLINE_FUNCTION static void weigh(State<T>& s, T const& weight) {
    s.pressure = weight * s.pressure;
    s.bulk = weight * s.bulk;
    s.secant = weight * s.secant;
    s.tangent = weight * s.tangent;
  }
  /// Psi(F) - Psi(F - dF). What volume changes is accurate relative to the difference; what the
  /// deviator does to the round-off of singular values times the stress.
  template <class T>
  KOKKOS_FORCEINLINE_FUNCTION static T change(Parameters<T> const& p, State<T> const& s,
                                              Mat3<T> const& dF) {
    T const dt = -log1p(-cofactor_change(s.F, dF).J / s.J), trace0 = s.trace - dt;
    T const borne = kernels::borne(p, s.trace), borne0 = kernels::borne(p, trace0);
    T const v = borne * s.trace, dv = borne0 * dt + (borne - borne0) * s.trace;

    Vec3<T> const &l = s.svd.s, l0 = svd(Mat3<T>(s.F - dF)).s;
    Vec3<T> de;
    for (int k = 0; k < 3; ++k) de[k] = -log1p((l0[k] - l[k]) / l[k]);
    Vec3<T> const dd = kernels::deviator(de), d0 = s.d - dd;
    T const squares = dot(dd, s.d + d0), size0 = norm(d0), sum = s.size + size0;
    T const dsize = squares / select(sum > T(0), sum, T(1));
    T const over0 = max(size0 - p.limit, T(0));
    T const both = min(s.over, over0);
    T const dover = select(both > T(0), dsize, s.over - over0);
    return T(0.5) * p.bulk * dv * (T(2) * v - dv) +
           p.mu * (squares - p.share * dover * (s.over + over0));
  }
  /// First Piola-Kirchhoff stress P(F), Pa.
  template <class T>
  KOKKOS_FORCEINLINE_FUNCTION static Mat3<T> stress(State<T> const& s) {
    Vec3<T> const tau = s.kirchhoff(), &l = s.svd.s;
    return kernels::compose(s.svd, Vec3<T>{tau[0] / l[0], tau[1] / l[1], tau[2] / l[2]});
  }
  template <class T>
  KOKKOS_FORCEINLINE_FUNCTION static Frame<T> frame(State<T> const& s) {
    return kernels::hencky_frame(s);
  }
  /// Of many b: `.diagonal(b)` and `.block(b)`.
  template <class T>
  KOKKOS_FORCEINLINE_FUNCTION static FullProjection::At<T> curvature(State<T> const& s) {
    return {frame(s)};
  }
  template <class T>
  KOKKOS_FORCEINLINE_FUNCTION static Vec3<T> diagonal(State<T> const& s, Vec3<T> const& b) {
    return curvature(s).diagonal(b);
  }
  template <class T>
  KOKKOS_FORCEINLINE_FUNCTION static Sym3<T> block(State<T> const& s, Vec3<T> const& b) {
    return curvature(s).block(b);
  }
  template <class T>
  KOKKOS_FORCEINLINE_FUNCTION static T quadratic(State<T> const& s, Mat3<T> const& dF) {
    return contract(frame(s).apply(dF), dF);
  }
};

}  // namespace taut

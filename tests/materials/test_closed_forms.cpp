// F10: the stress of homogeneous deformations against closed forms, written down per model from the
// principal stretches and the rotation of a simple shear, without invariants.
#include "samples.hpp"

#include <catch2/catch_test_macros.hpp>

using namespace taut;
using namespace taut::test;

namespace {

double const mu = lame.mu, lambda = lame.lambda;

/// Stress of F = diag(l, t, t): P00, and P11 = P22.
struct Axial {
  double along, across;
};

/// Stress of F = I + g e0 e1'.
struct Shear {
  double p00, p01, p10, p11, p22;
};

/// The rotation by which a simple shear turns: cosine and sine, clockwise.
struct Turn {
  double c, s;
  explicit Turn(double g) : c(2 / std::sqrt(4 + g * g)), s(g / std::sqrt(4 + g * g)) {}
};

template <class Model>
Axial axial_stress(double l, double t);
template <class Model>
Shear shear_stress(double g);

// mu Sum (s_i - 1)^2
template <>
Axial axial_stress<Arap>(double l, double t) {
  return {2 * mu * (l - 1), 2 * mu * (t - 1)};
}
template <>
Shear shear_stress<Arap>(double g) {
  Turn const r(g);
  return {2 * mu * (1 - r.c), 2 * mu * (g - r.s), 2 * mu * r.s, 2 * mu * (1 - r.c), 0};
}

// The same and lambda/2 (l t^2 - 1)^2; a shear keeps the volume.
template <>
Axial axial_stress<FixedCorotated>(double l, double t) {
  double const pressure = lambda * (l * t * t - 1);
  return {2 * mu * (l - 1) + pressure * t * t, 2 * mu * (t - 1) + pressure * l * t};
}
template <>
Shear shear_stress<FixedCorotated>(double g) {
  return shear_stress<Arap>(g);
}

// P = mu (F - F^-T) + lambda ln J F^-T
template <>
Axial axial_stress<NeoHookean>(double l, double t) {
  double const pressure = lambda * std::log(l * t * t);
  return {mu * (l - 1 / l) + pressure / l, mu * (t - 1 / t) + pressure / t};
}
template <>
Shear shear_stress<NeoHookean>(double g) {
  return {0, mu * g, mu * g, 0, 0};
}

// mu/2 (l^2 + 2 t^2 - 3) - mu (l t^2 - 1) + lambda/2 (l t^2 - 1)^2
template <>
Axial axial_stress<StableNeoHookean>(double l, double t) {
  double const pressure = lambda * (l * t * t - 1) - mu;
  return {mu * l + pressure * t * t, mu * t + pressure * l * t};
}
template <>
Shear shear_stress<StableNeoHookean>(double g) {
  return {0, mu * g, mu * g, 0, 0};
}

// P = m (1 - 1 / (F:F + 1)) F + (L (J - 1) - 3/4 m) J F^-T, m = 4/3 mu, L = lambda + 5/6 mu
template <>
Axial axial_stress<StableNeoHookean2018>(double l, double t) {
  double const m = 4 * mu / 3, L = lambda + 5 * mu / 6;
  double const stretch = m * (1 - 1 / (l * l + 2 * t * t + 1));
  double const pressure = L * (l * t * t - 1) - mu;
  return {stretch * l + pressure * t * t, stretch * t + pressure * l * t};
}
template <>
Shear shear_stress<StableNeoHookean2018>(double g) {
  double const stretch = 4 * mu / 3 * (1 - 1 / (4 + g * g));
  return {stretch - mu, stretch * g, mu * g, stretch - mu, stretch - mu};
}

template <class Model>
void check(Mat3<double> const& F, Mat3<double> const& expected) {
  std::mt19937 rng(3);
  // As it is, and turned: P(Q F) = Q P(F).
  for (Mat3<double> const& Q : {identity3<double>(), random_rotation(rng)}) {
    Mat3<double> const P = stress(evaluate<Model>(lame, Q * F));
    double const size = frobenius(expected) + lame.lambda * frobenius(F);
    CHECK(frobenius(P - Q * expected) < 1e-12 * size);
  }
}

template <class Model>
void check_model() {
  INFO(Model::name);
  for (double l : {0.5, 1.5, 3.0}) {
    for (double t : {1.0, 0.8}) {
      Axial const p = axial_stress<Model>(l, t);
      check<Model>({{l, 0, 0, 0, t, 0, 0, 0, t}},
                   {{p.along, 0, 0, 0, p.across, 0, 0, 0, p.across}});
    }
    Shear const p = shear_stress<Model>(l);
    check<Model>({{1, 0, 0, l, 1, 0, 0, 0, 1}}, {{p.p00, p.p10, 0, p.p01, p.p11, 0, 0, 0, p.p22}});
  }
}

}  // namespace

TEST_CASE("F10: uniaxial stretch and simple shear have their closed forms", "[materials][F10]") {
  check_model<Arap>();
  check_model<FixedCorotated>();
  check_model<NeoHookean>();
  check_model<StableNeoHookean>();
  check_model<StableNeoHookean2018>();
}

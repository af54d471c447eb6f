// The models against finite differences and closed forms, one representation against the other.
#include "samples.hpp"

#include <catch2/catch_template_test_macros.hpp>
#include <catch2/catch_test_macros.hpp>
#include <catch2/matchers/catch_matchers_floating_point.hpp>

using namespace taut;
using namespace taut::test;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

TEMPLATE_TEST_CASE("value, stress and curvature agree by finite differences", "[materials]", Arap,
                   FixedCorotated, NeoHookean, StableNeoHookean, StableNeoHookean2018) {
  using Model = TestType;
  std::mt19937 rng(11);
  for (Mat3<double> const& F : deformations<Model>()) {
    auto const state = evaluate<Model>(lame, F);
    Mat3<double> const dF = random_matrix(rng);
    // Richardson-extrapolated central differences.
    double const h = 1e-3;
    auto const at = [&](double t) { return F + t * dF; };
    auto const slope = [&](double s) {
      return (energy<Model>(lame, at(s)) - energy<Model>(lame, at(-s))) / (2 * s);
    };
    auto const stress_slope = [&](double s) {
      return (0.5 / s) *
             (stress(evaluate<Model>(lame, at(s))) - stress(evaluate<Model>(lame, at(-s))));
    };
    // The flattest cases have large higher derivatives.
    double const size = frobenius(stress_change(state, dF)) + lame.lambda * contract(dF, dF);
    double const first = (4 * slope(h / 2) - slope(h)) / 3;
    CHECK_THAT(first, WithinAbs(contract(stress(state), dF), 2e-8 * size));
    Mat3<double> const second = (4.0 / 3) * stress_slope(h / 2) - (1.0 / 3) * stress_slope(h);
    Mat3<double> const exact = stress_change(state, dF);
    CHECK(frobenius(second - exact) < 2e-7 * size);

    // dF : dP three ways: the six terms, the directional derivative, the singular frame.
    double const form = contract(exact, dF);
    CHECK_THAT(quadratic_form(state, dF), WithinAbs(form, 1e-10 * size));
    Mat3<double> const framed = singular_frame<Model, false>(state).apply(dF);
    CHECK(frobenius(framed - exact) < 1e-9 * size);
  }
}

TEMPLATE_TEST_CASE("central differences close in on stress and curvature at second order",
                   "[materials][F3]", Arap, FixedCorotated, NeoHookean, StableNeoHookean,
                   StableNeoHookean2018) {
  using Model = TestType;
  std::mt19937 rng(12);
  int asserted = 0;
  for (Mat3<double> const& F : deformations<Model>()) {
    // Where s1 + s2 is small, or J for a model that is infinite at zero, steps would have to be too
    // small for an order to show above round-off.
    if (Model::use.d1 && svd(F).s[1] + svd(F).s[2] < 0.2) continue;
    if (!Model::allows_inversion && determinant(F) < 0.1) continue;
    auto const state = evaluate<Model>(lame, F);
    Mat3<double> const direction = random_matrix(rng);
    Mat3<double> const dF = (1 / frobenius(direction)) * direction;
    auto const at = [&](double t) { return F + t * dF; };
    auto const energy_error = [&](double h) {
      double const slope = (energy<Model>(lame, at(h)) - energy<Model>(lame, at(-h))) / (2 * h);
      return std::abs(slope - contract(stress(state), dF));
    };
    auto const stress_error = [&](double h) {
      Mat3<double> const slope = (0.5 / h) * (stress(evaluate<Model>(lame, at(h))) -
                                              stress(evaluate<Model>(lame, at(-h))));
      return frobenius(slope - stress_change(state, dF));
    };
    double const h = 4e-3;
    double const round_off = 1e-16 * lame.lambda * std::pow(1 + contract(F, F), 3) / h;
    auto const check = [&](auto const& error) {
      double const coarse = error(2 * h), fine = error(h);
      if (fine < 1e3 * round_off) return;  // no third derivative to speak of
      CHECK_THAT(std::log2(coarse / fine), WithinAbs(2, 0.1));
      ++asserted;
    };
    check(energy_error);
    check(stress_error);
  }
  CHECK(asserted >= 30);
}

TEMPLATE_TEST_CASE("vertex blocks and pairs are those of the full second derivative", "[materials]",
                   Arap, FixedCorotated, NeoHookean, StableNeoHookean, StableNeoHookean2018) {
  using Model = TestType;
  std::mt19937 rng(13);
  for (Mat3<double> const& F : deformations<Model>()) {
    auto const state = evaluate<Model>(lame, F);
    auto const frame = singular_frame<Model, false>(state);
    Mat3<double> const B = random_matrix(rng);
    Vec3<double> const b = B.column(0), c = B.column(1);
    Sym3<double> const block = vertex_block<Model, false>(state, b);
    Mat3<double> const full = to_matrix(block);
    Mat3<double> const pair =
        frame.vertex_pair(transpose_times(frame.V, b), transpose_times(frame.V, c));
    for (int i = 0; i < 3; ++i) {
      Vec3<double> u{};
      u[i] = 1;
      Mat3<double> const response = stress_change(state, outer(u, b));
      double const size = frobenius(response) * norm(b) + 1;
      double const size_c = frobenius(response) * norm(c) + 1;
      for (int j = 0; j < 3; ++j) {
        CHECK_THAT(full(j, i), WithinAbs((response * b)[j], 1e-9 * size));
        // H_bc: force at b from a motion of c, which is the transpose of the force at c.
        CHECK_THAT(pair(i, j), WithinAbs((response * c)[j], 1e-9 * size_c));
      }
    }
  }
}

TEMPLATE_TEST_CASE("energy changes are exact where plain differences cancel", "[materials]", Arap,
                   FixedCorotated, NeoHookean, StableNeoHookean, StableNeoHookean2018) {
  using Model = TestType;
  std::mt19937 rng(17);
  for (Mat3<double> const& F : deformations<Model>()) {
    Mat3<double> const direction = random_matrix(rng);
    for (double size : {1e-1, 1e-3, 1e-6, 1e-9, 1e-12}) {
      Mat3<double> const dF = size * direction;
      auto const state = evaluate<Model>(lame, F);
      if (!Model::allows_inversion && !(determinant(F - dF) > 0)) continue;
      double const change = energy_change<Model>(lame, state, dF);
      if (size >= 1e-3) {
        double const plain = energy<Model>(lame, F) - energy<Model>(lame, F - dF);
        double const scale = lame.lambda * (1 + contract(F, F) * contract(F, F));
        CHECK_THAT(change, WithinAbs(plain, 1e-11 * scale));
      } else {
        // Taylor: P:dF - dF:dP/2 + O(|dF|^3); relative to what the step changes.
        double const taylor = contract(stress(state), dF) - 0.5 * quadratic_form(state, dF);
        // The stress itself carries round-off of the moduli.
        double const round_off = 1e-14 * lame.lambda * (1 + contract(F, F));
        double const unit =
            frobenius(stress(state)) * frobenius(dF) + lame.lambda * contract(dF, dF);
        CHECK_THAT(change,
                   WithinAbs(taylor, (100 * size + 1e-10) * unit + round_off * frobenius(dF)));
      }
    }
  }
}

TEMPLATE_TEST_CASE("energies vanish at rest and do not see rotations", "[materials][F2]", Arap,
                   FixedCorotated, NeoHookean, StableNeoHookean, StableNeoHookean2018) {
  using Model = TestType;
  std::mt19937 rng(23);
  for (int k = 0; k < 100; ++k) {
    Mat3<double> const R = random_rotation(rng);
    CHECK_THAT(energy<Model>(lame, R), WithinAbs(0, 1e-11 * lame.lambda));
    CHECK(frobenius(stress(evaluate<Model>(lame, R))) < 1e-11 * lame.lambda);
    Mat3<double> const F = with_stretches(rng, 1.4, 1.1, 0.6);
    CHECK_THAT(energy<Model>(lame, R * F), WithinRel(energy<Model>(lame, F), 1e-11));
  }
}

TEST_CASE("small-strain moduli", "[materials][F10]") {
  // E : C : E at rest for the strain of a uniaxial stretch and of a simple shear.
  auto const moduli = []<class Model>() {
    auto const state = evaluate<Model>(lame, identity3<double>());
    Mat3<double> uniaxial{}, shear{};
    uniaxial(0, 0) = 1;
    shear(0, 1) = shear(1, 0) = 0.5;
    double const mu = quadratic_form(state, shear);
    double const lambda = quadratic_form(state, uniaxial) - 2 * mu;
    return Lame<double>{mu, lambda};
  };
  auto const fcr = moduli.operator()<FixedCorotated>(), nh = moduli.operator()<NeoHookean>(),
             snh = moduli.operator()<StableNeoHookean>(),
             smith = moduli.operator()<StableNeoHookean2018>(), arap = moduli.operator()<Arap>();
  for (auto const& nominal : {fcr, nh, smith}) {
    CHECK_THAT(nominal.mu, WithinRel(lame.mu, 1e-12));
    CHECK_THAT(nominal.lambda, WithinRel(lame.lambda, 1e-12));
  }
  // The paper's SNH is softer in volume by mu, and ARAP has none.
  CHECK_THAT(snh.mu, WithinRel(lame.mu, 1e-12));
  CHECK_THAT(snh.lambda, WithinRel(lame.lambda - lame.mu, 1e-12));
  CHECK_THAT(arap.mu, WithinRel(lame.mu, 1e-12));
  CHECK_THAT(arap.lambda, WithinAbs(0, 1e-10 * lame.mu));
}

// The constitutive models against the shared vectors.
#include "../support/data.hpp"
#include "matrix_rows.hpp"
#include "samples.hpp"

#include <catch2/catch_test_macros.hpp>
#include <catch2/matchers/catch_matchers_floating_point.hpp>

using namespace taut;
using namespace taut::test;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

namespace {

Vec3<double> shape(Mat3<double> const& B, int a) {
  if (a > 0) return {B(a - 1, 0), B(a - 1, 1), B(a - 1, 2)};
  Vec3<double> b;
  for (int c = 0; c < 3; ++c) b[c] = -(B(0, c) + B(1, c) + B(2, c));
  return b;
}

Mat3<double> edges(nlohmann::json const& flat, Mat3<double> const& B) {
  Mat3<double> d;
  for (int a = 0; a < 3; ++a)
    for (int c = 0; c < 3; ++c) {
      d(c, a) = double(flat[3 * (a + 1) + c]) - double(flat[c]);
    }
  return d * B;
}

}  // namespace

namespace {

/// The nine numbers of vec(A), the columns stacked.
Mat3<double> stacked(nlohmann::json const& numbers) {
  Mat3<double> m;
  for (int k = 0; k < 9; ++k) m.a[k] = numbers[k];
  return m;
}

void check_close(Mat3<double> const& found, Mat3<double> const& expected) {
  CHECK(frobenius(found - expected) < 1e-11 * frobenius(expected));
}

}  // namespace

TEST_CASE("rotation, cofactor and twist modes reproduce the shared vectors", "[materials]") {
  for (auto const& c : test::vectors("elastic")) {
    INFO(c["name"]);
    Mat3<double> const B = matrix_of(c["B"]), F = matrix_of(c["F"]), dF = edges(c["p"], B);
    auto const state = evaluate<Arap>(lame_parameters(c["E"], c["nu"]), F);
    check_close(state.R, matrix_of(c["R"]));
    check_close(state.C, stacked(c["g3"]));
    check_close(dF, stacked(c["dFdx_p"]));
    CHECK_THAT(state.invariants.I1, WithinRel(double(c["I1"]), 1e-11));
    CHECK_THAT(state.invariants.I2, WithinRel(double(c["I2"]), 1e-11));
    CHECK_THAT(state.invariants.J, WithinRel(double(c["I3"]), 1e-11));
    Svd<double> const f = svd(F);
    for (int k = 0; k < 3; ++k)
      CHECK_THAT(f.s[k], WithinAbs(double(c["sigma"][k]), 1e-11 * f.s[0]));
    // dR = lambda_i Q_i for dF = Q_i, and the form a . G^-1 a is Sum lambda_i (Q_i : dF)^2.
    double form = 0;
    for (auto const& mode : c["lambda_q"]) {
      double const eigenvalue = mode["lam"];
      Mat3<double> const Q = stacked(mode["q"]);
      Vec3<double> const w = state.G_inv * axial(transpose_times(state.R, Q));
      Mat3<double> const dR =
          state.R * Mat3<double>{{0, w[2], -w[1], -w[2], 0, w[0], w[1], -w[0], 0}};
      check_close(dR, eigenvalue * Q);
      form += eigenvalue * contract(Q, dF) * contract(Q, dF);
    }
    double const found = quadratic(state.G_inv, axial(transpose_times(state.R, dF)));
    CHECK_THAT(found, WithinRel(form, 1e-11));
  }
}

TEST_CASE("the six terms reproduce the shared vectors", "[materials]") {
  for (auto const& c : test::vectors("elastic")) {
    INFO(c["name"]);
    Mat3<double> const B = matrix_of(c["B"]), F = matrix_of(c["F"]), dF = edges(c["p"], B);
    auto const state = evaluate<FixedCorotated>(lame_parameters(c["E"], c["nu"]), F);
    auto const& terms = c["materials"]["FCR"]["diag_h"];
    for (int a = 0; a < 4; ++a) {
      Vec3<double> const b = shape(B, a), Cb = state.C * b;
      double const size = dot(b, b) * (1 + contract(state.C, state.C));
      for (int k = 0; k < 3; ++k) {
        Vec3<double> e{};
        e[k] = 1;
        Vec3<double> const turn = axial(transpose_times(state.R, outer(e, b)));
        int const i = 3 * a + k;
        CHECK_THAT(Cb[k] * Cb[k], WithinAbs(double(terms["h3"][i]), 1e-11 * size));
        CHECK_THAT(quadratic(state.G_inv, turn), WithinAbs(double(terms["h4"][i]), 1e-11 * size));
        CHECK_THAT(2 * dot(b, b), WithinRel(double(terms["h5"][i]), 1e-11));
        CHECK(double(terms["h6"][i]) == 0);
      }
    }
    auto const& forms = c["materials"]["FCR"]["p_h_p"];
    double const size = contract(dF, dF) * (1 + contract(F, F));
    CHECK_THAT(square(contract(state.C, dF)), WithinRel(double(forms["h3"]), 1e-11));
    CHECK_THAT(quadratic(state.G_inv, axial(transpose_times(state.R, dF))),
               WithinRel(double(forms["h4"]), 1e-11));
    CHECK_THAT(2 * contract(dF, dF), WithinRel(double(forms["h5"]), 1e-11));
    CHECK_THAT(2 * contract(F, cofactor(dF)), WithinAbs(double(forms["h6"]), 1e-11 * size));
    // The terms do not depend on the model.
    for (auto const& [key, material] : c["materials"].items()) {
      INFO(key);
      if (!material.is_null()) CHECK(material["p_h_p"] == forms);
    }
  }
}

TEST_CASE("the models reproduce the shared vectors", "[materials]") {
  for (auto const& c : test::vectors("elastic")) {
    INFO(c["name"]);
    Lame<double> const m = lame_parameters(c["E"], c["nu"]);
    Mat3<double> const B = matrix_of(c["B"]), F = matrix_of(c["F"]);
    Mat3<double> const dF = edges(c["p"], B);
    auto const check = [&]<class Model>(char const* key) {
      if (!c["materials"].contains(key) || c["materials"][key].is_null()) return;
      auto const& expected = c["materials"][key];
      INFO(key);
      auto const state = evaluate<Model>(m, F);
      double const force_size = frobenius(stress(state)) * frobenius(B);
      CHECK_THAT(energy<Model>(m, F), WithinRel(double(expected["Psi"]), 1e-11));
      double diagonal_size = 0;
      for (double d : expected["diagH"]) diagonal_size = std::max(diagonal_size, std::abs(d));
      for (int a = 0; a < 4; ++a) {
        Vec3<double> const b = shape(B, a), f = stress(state) * b;
        Sym3<double> const h = vertex_block<Model, true>(state, b);
        Vec3<double> const clamped = ClampElement::diagonal<Model>(state, b);
        Vec3<double> const limited = LimitLambda::diagonal<Model>(state, b);
        for (int k = 0; k < 3; ++k) {
          CHECK_THAT(f[k], WithinAbs(double(expected["grad"][3 * a + k]), 1e-11 * force_size));
          CHECK_THAT(h.s[k],
                     WithinAbs(double(expected["diagH"][3 * a + k]), 1e-11 * diagonal_size));
          CHECK_THAT(clamped[k], WithinAbs(double(expected["diagH_clamped"][3 * a + k]),
                                           1e-11 * diagonal_size));
          if (expected.contains("lambda_min1")) {
            CHECK_THAT(limited[k],
                       WithinAbs(std::max(0.0, double(expected["lambda_min1"]["diagH"][3 * a + k])),
                                 1e-11 * diagonal_size));
          }
        }
      }
      double const form_size = diagonal_size * contract(dF, dF);
      CHECK_THAT(quadratic_form(state, dF), WithinAbs(double(expected["pHp"]), 1e-11 * form_size));
      CHECK_THAT((ClampElement::quadratic<Model>(state, dF)),
                 WithinAbs(double(expected["pHp_clamped"]), 1e-11 * form_size));
      if (expected.contains("lambda_min1")) {
        // The vectors limit lambda alone; a negative volumetric term is dropped besides, and the
        // element clamped.
        double const volumetric = 2 * state.d.d3 * contract(F, cofactor(dF));
        double const limited = double(expected["lambda_min1"]["pHp"]) - std::min(volumetric, 0.0);
        CHECK_THAT((LimitLambda::quadratic<Model>(state, dF)),
                   WithinAbs(std::max(limited, 0.0), 1e-11 * form_size));
      }
      double const first[3] = {state.d.d1, state.d.d2, state.d.d3};
      double const second[3] = {state.d.d11, state.d.d22, state.d.d33};
      for (int k = 0; k < 3; ++k) {
        CHECK_THAT(first[k], WithinAbs(double(expected["dPsi_dI"][k]), 1e-11 * m.lambda));
        double const curvature = expected["d2Psi_dI2"][k];
        CHECK_THAT(second[k], WithinAbs(curvature, 1e-11 * std::abs(curvature)));
      }
    };
    check.template operator()<Arap>("ARAP");
    check.template operator()<FixedCorotated>("FCR");
    check.template operator()<NeoHookean>("NH");
    check.template operator()<StableNeoHookean>("SNH");
  }
}

TEST_CASE("the projected 9x9 of fixed corotated reproduces the shared vectors", "[materials]") {
  auto const cases = test::hot_vectors("fcr");
  for (auto const& c : cases) {
    INFO(c["name"]);
    Lame<double> const m{c["mu"], c["lam"]};
    auto const state = evaluate<FixedCorotated>(m, matrix_of(c["F"]));
    CHECK_THAT((energy<FixedCorotated>(m, state.F)), WithinRel(double(c["psi"]), 1e-11));
    double const size = double(c["frob_projected"]);
    auto const projected = singular_frame<FixedCorotated>(state);
    auto const plain = singular_frame<FixedCorotated, false>(state);
    for (int q = 0; q < 9; ++q) {
      Mat3<double> e{};
      e.a[q] = 1;
      Mat3<double> const column = projected.apply(e), exact = plain.apply(e);
      Mat3<double> const direct = stress_change(state, e);
      for (int r = 0; r < 9; ++r) {
        CHECK_THAT(column.a[r], WithinAbs(double(c["dPdF_projected"][r][q]), 1e-10 * size));
        CHECK_THAT(exact.a[r], WithinAbs(double(c["dPdF"][r][q]), 1e-10 * size));
        CHECK_THAT(direct.a[r], WithinAbs(double(c["dPdF"][r][q]), 1e-10 * size));
      }
    }
  }
}

// The constitutive models against the shared vectors.
#include "../support/data.hpp"
#include "samples.hpp"

#include <catch2/catch_test_macros.hpp>
#include <catch2/matchers/catch_matchers_floating_point.hpp>

using namespace taut;
using namespace taut::test;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

namespace {

Mat3<double> matrix(nlohmann::json const& rows) {
  Mat3<double> m;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) m(i, j) = rows[i][j];
  return m;
}

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

TEST_CASE("the models reproduce the shared vectors", "[materials]") {
  for (auto const& c : test::vectors("elastic")) {
    INFO(c["name"]);
    Lame<double> const m = lame_parameters(c["E"], c["nu"]);
    Mat3<double> const B = matrix(c["B"]), F = matrix(c["F"]);
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
      CHECK_THAT(state.d.d3, WithinAbs(double(expected["dPsi_dI"][2]), 1e-10 * m.lambda));
      CHECK_THAT(state.d.d33, WithinRel(double(expected["d2Psi_dI2"][2]), 1e-10) ||
                                  WithinAbs(double(expected["d2Psi_dI2"][2]), 1e-10));
    };
    check.template operator()<Arap>("ARAP");
    check.template operator()<FixedCorotated>("FCR");
    check.template operator()<NeoHookean>("NH");
    check.template operator()<StableNeoHookean>("SNH");
  }
}

TEST_CASE("the projected 9x9 of fixed corotated reproduces the shared vectors", "[materials]") {
  auto const cases =
      nlohmann::json::parse(std::ifstream(test::data_file("vectors/hot_vectors.json")))["fcr"];
  for (auto const& c : cases) {
    INFO(c["name"]);
    Lame<double> const m{c["mu"], c["lam"]};
    auto const state = evaluate<FixedCorotated>(m, matrix(c["F"]));
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

// Every beta against numbers computed independently, and the identities that define them.
#include <taut/integrators/beta.hpp>

#include <support/data.hpp>

#include <catch2/catch_test_macros.hpp>
#include <catch2/matchers/catch_matchers_floating_point.hpp>
#include <catch2/matchers/catch_matchers_string.hpp>

#include <vector>

using namespace taut;
using Catch::Matchers::ContainsSubstring;
using Catch::Matchers::WithinRel;

namespace {

using Vector = std::vector<double>;

/// a' diag(w) b
double dot(Vector const& a, Vector const& b, Vector const& w) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += a[i] * w[i] * b[i];
  return sum;
}

/// One random state: gradients before and after a step, the step, and both diagonals of the
/// Hessian.
struct State {
  Vector g, g1, p, y, P, P1, one;
  double alpha;

  explicit State(nlohmann::json const& data)
      : g(data["g_k"]), g1(data["g_k1"]), p(data["p_k"]), y(data["y"]), alpha(data["alpha_k"]) {
    for (double d : Vector(data["diagH_k"])) P.push_back(1 / d);
    for (double d : Vector(data["diagH_k1"])) P1.push_back(1 / d);
    one.assign(g.size(), 1);
  }
  Dots dots() const {
    return {.g1_P1_g1 = dot(g1, g1, P1),
            .g1_P1_y = dot(g1, y, P1),
            .y_P1_y = dot(y, y, P1),
            .g_P1_g = dot(g, g, P1),
            .g_P_g = dot(g, g, P),
            .g1_p = dot(g1, p, one),
            .g_p = dot(g, p, one),
            .y_p = dot(y, p, one),
            .p_p = dot(p, p, one),
            .g_g = dot(g, g, one),
            .g1_g1 = dot(g1, g1, one),
            .alpha = alpha};
  }
  /// -P1 g1 + beta p + gamma P1 y
  Vector direction(Coefficients const& c) const {
    Vector d;
    for (std::size_t i = 0; i < g.size(); ++i)
      d.push_back(-P1[i] * g1[i] + c.beta * p[i] + c.gamma * P1[i] * y[i]);
    return d;
  }
};

}  // namespace

TEST_CASE("betas have the values of the vectors") {
  auto const data = test::vectors("beta_formulas");
  State const state(data);
  Dots const d = state.dots();
  auto const is = [&](char const* key) { return WithinRel(data[key].get<double>(), 1e-11); };

  CHECK_THAT(d.y_p, is("yTp"));
  CHECK_THAT(d.g1_P1_y, is("gPy"));
  CHECK_THAT(d.y_P1_y, is("yPy"));

  CHECK_THAT(DaiKou()(d).beta, is("DK"));
  CHECK_THAT(DaiKouPlus()(d).beta, is("DK"));
  CHECK_THAT(HagerZhang()(d).beta, is("HZ_standard_preconditioned"));
  CHECK_THAT(FletcherReeves()(d).beta, is("FR_textbook_uses_P_k"));
  CHECK_THAT(ConjugateDescent()(d).beta, is("CD"));
  CHECK_THAT(LiuStorey()(d).beta, is("PRP_supplement_is_LiuStorey"));
  CHECK_THAT(PolakRibiere()(d).beta, is("PRP_textbook_uses_P_k"));
  CHECK_THAT(PolakRibierePlus()(d).beta, is("PRP_textbook_uses_P_k"));
  CHECK_THAT(MemorylessBfgs()(d).beta, is("BFGS_beta"));
  CHECK_THAT(MemorylessBfgs()(d).gamma, is("BFGS_gamma"));
  CHECK_THAT(HestenesStiefel()(d).beta, WithinRel(d.g1_P1_y / d.y_p, 1e-15));
  CHECK(SteepestDescent()(d).beta == 0);

  // The printed variants that are not used, from the same scalars.
  CHECK_THAT(d.g1_P1_g1 / d.g_P1_g, is("FR_code"));
  CHECK_THAT(d.g1_P1_g1 / d.g_g, is("FR_supplement_no_P_in_denominator"));
  CHECK_THAT(dot(state.g1, state.y, state.one) / -d.g_p, is("PRP_code_no_P"));
  CHECK_THAT(0.01 * d.g1_p / d.p_p, is("DK_plus_floor_code"));

  for (auto const& [key, beta] :
       {std::pair("DK_direction", AnyBeta("dk")), std::pair("BFGS_direction", AnyBeta("bfgs"))}) {
    Vector const direction = state.direction(beta(d)), expected = data[key];
    for (std::size_t i = 0; i < direction.size(); ++i)
      CHECK_THAT(direction[i], WithinRel(expected[i], 1e-11));
  }
}

TEST_CASE("SSML-BFGS is -H g with the dense BFGS update of P") {
  auto const data = test::vectors("beta_formulas");
  State const state(data);
  Dots const d = state.dots();
  // H = (1 - r s y') P (1 - r y s') + r s s', s = alpha p, r = 1 / s'y
  std::size_t const n = state.g.size();
  double const r = 1 / (state.alpha * d.y_p);
  Vector const three_terms = state.direction(MemorylessBfgs()(d));
  double const s_g = state.alpha * d.g1_p;
  Vector inner(n);  // P (1 - r y s') g
  for (std::size_t i = 0; i < n; ++i) inner[i] = state.P1[i] * (state.g1[i] - r * s_g * state.y[i]);
  double const y_inner = dot(state.y, inner, state.one);
  for (std::size_t i = 0; i < n; ++i) {
    double const s = state.alpha * state.p[i];
    CHECK_THAT(three_terms[i], WithinRel(-(inner[i] - r * s * y_inner + r * s * s_g), 1e-11));
  }
}

TEST_CASE("truncated betas stay above their floors") {
  // y'p > 0 and a large y'Py make DK and HZ strongly negative.
  Dots const d{.g1_P1_y = 1, .y_P1_y = 50, .g_P_g = 1, .g1_p = 2, .y_p = 1, .p_p = 4, .g_g = 9};
  CHECK(DaiKou()(d).beta == -99);
  CHECK(DaiKouPlus{.eta = 0.5}(d).beta == 0.25);
  CHECK(HagerZhang()(d).beta == -1 / (2 * 0.01));
  CHECK(PolakRibierePlus()({.g1_P1_y = -1, .g_P_g = 1}).beta == 0);
}

TEST_CASE("betas can be chosen by name") {
  CHECK(AnyBeta().name() == "dk");
  CHECK(AnyBeta("bfgs")({.g1_p = 1, .y_p = 2}).gamma == 0.5);
  CHECK_THROWS_WITH(AnyBeta("DY"), ContainsSubstring("\"DY\"") && ContainsSubstring("dk, dk+, fr"));
}

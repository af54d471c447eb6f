// The patch sweeps against the serial oracle: every kernel, every precision, both layouts, any team
// and patch size.
#include "elastic_samples.hpp"

#include <catch2/catch_template_test_macros.hpp>
#include <catch2/catch_test_macros.hpp>
#include <catch2/matchers/catch_matchers_floating_point.hpp>

using namespace taut;
using namespace taut::test;
using Catch::Matchers::WithinRel;

namespace {

/// Compares every sweep with the oracle, to `tolerance` relative to the largest entry.
template <class Material, class Precision, class S>
void compare(Sample const& body, SweepParams const& params, double tolerance) {
  using Term = ElasticTets<Material, Precision, S>;
  Term const term(body.rest, two_materials, body.material_of_tet, params);
  test::ElasticOracle<typename Material::Model, typename Material::Filter> const oracle{
      body.rest, two_materials, body.material_of_tet};
  std::size_t const n = body.rest.points.size();
  double const scale = 0.25, alpha = 1e-3;
  auto const x = test::to_field(body.x, typename Term::Positions());
  auto const p = test::to_field(body.p, typename Term::Vectors());
  FixedMask<S> const fixed("fixed", n);
  typename Term::Vectors const g("g", n), d("d", n), hp("hp", n);
  typename Term::Blocks const h("h", n);

  CHECK_THAT(term.value(x, scale), WithinRel(scale * oracle.value(body.x), tolerance));
  CHECK_THAT(term.quadratic_form(x, p, scale),
             WithinRel(scale * oracle.quadratic_form(body.x, body.p), tolerance));
  std::vector<Point> moved = body.x;
  for (std::size_t i = 0; i < n; ++i)
    for (int c = 0; c < 3; ++c) moved[i][c] += alpha * body.p[i][c];
  double const change = scale * (oracle.value(moved) - oracle.value(body.x));
  CHECK_THAT(term.change(x, p, alpha, scale), WithinRel(change, std::max(100 * tolerance, 1e-9)));

  auto const close = [&](auto const& field, std::vector<Point> const& expected) {
    auto const f = host(field);
    double const unit = scale * largest(expected);
    double worst = 0;
    for (std::size_t i = 0; i < n; ++i)
      for (int c = 0; c < 3; ++c) {
        worst = std::max(worst, std::abs(double(f(i, c)) - scale * expected[i][c]) / unit);
      }
    CHECK(worst < tolerance);
  };
  auto const clear = [&] {
    assign(g, 0);
    assign(d, 0);
    assign(h, 0);
  };
  clear();
  term.add_gradient(x, scale, fixed, g);
  close(g, oracle.gradient(body.x));
  clear();
  term.add_gradient(x, scale, fixed, g, d);
  close(g, oracle.gradient(body.x));
  close(d, oracle.diagonal(body.x));
  clear();
  auto const arrived = test::to_field(moved, typename Term::Positions());
  CHECK_THAT(term.add_gradient_after(arrived, p, alpha, scale, fixed, g, h),
             WithinRel(change, std::max(100 * tolerance, 1e-9)));
  close(g, oracle.gradient(moved));
  auto const blocks = oracle.blocks(moved);
  auto const hh = host(h);
  double unit = 0, worst = 0;
  for (auto const& b : blocks)
    for (double e : b.s) unit = std::max(unit, std::abs(e));
  for (std::size_t i = 0; i < n; ++i)
    for (int k = 0; k < 6; ++k) {
      worst = std::max(worst, std::abs(double(hh(i, k)) / scale - blocks[i].s[k]) / unit);
    }
  CHECK(worst < tolerance);
  assign(hp, 0);
  term.add_product(x, p, scale, fixed, hp);
  close(hp, oracle.product(body.x, body.p));
}

}  // namespace

TEMPLATE_TEST_CASE("sweeps agree with the serial oracle", "[fem]", Arap, FixedCorotated,
                   StableNeoHookean, StableNeoHookean2018) {
  Sample const body;
  SECTION("fp64") { compare<Elastic<TestType>, Fp64, Right>(body, {}, 1e-11); }
  SECTION("mixed") { compare<Elastic<TestType>, Mixed, Right>(body, {}, 2e-4); }
}

TEST_CASE("sweeps with other filters agree with the serial oracle", "[fem]") {
  Sample const body;
  compare<Elastic<Arap, LimitLambda>, Fp64, Right>(body, {}, 1e-11);
  compare<Elastic<StableNeoHookean2018, FullProjection>, Fp64, Right>(body, {}, 1e-11);
}

TEST_CASE("neo-Hookean sweeps agree with the serial oracle", "[fem]") {
  Sample const body(6, 0.002);  // no inverted element
  compare<Elastic<NeoHookean>, Fp64, Right>(body, {}, 1e-11);
  compare<Elastic<NeoHookean>, Fp32, Right>(body, {}, 1e-3);
}

TEST_CASE("sweeps do not depend on layout, patch or team size", "[fem]") {
  Sample const body;
  using Material = Elastic<FixedCorotated>;
  compare<Material, Fp64, Left>(body, {.patch_size = 64}, 1e-11);
  compare<Material, Fp64, Right>(body, {.patch_size = 37, .team_size = 1}, 1e-11);
}

// What may happen on the way: cuts, prescribed motion, energies that are not numbers, nothing to
// do.
#include "oracle.hpp"

#include <taut/integrators/ncg.hpp>

#include <catch2/catch_test_macros.hpp>
#include <catch2/matchers/catch_matchers_floating_point.hpp>

#include <cmath>
#include <limits>
#include <vector>

using namespace taut;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

namespace {

template <class LineSearch = SufficientDecrease>
using DaiKouNcg = Ncg<DaiKou, BlockJacobi, LineSearch, DecrementWindow, Fp64>;

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

/// A chain whose gradients are not numbers from the given evaluation on, and no energies either.
struct Breaking : toy::Chain<toy::Anisotropic> {
  int breaks_at = 0;
  mutable int evaluations = 0;

  using Chain::Chain;
  template <class... Curvature>
  void gradient(Positions const& at, Field const& g, Curvature const&... curvature) const {
    Chain::gradient(at, g, curvature...);
    if (evaluations++ >= breaks_at) g(3, 1) = nan;
  }
  template <class... Curvature>
  double gradient_after(Positions const& at, Field const& p, double alpha, Field const& g,
                        Curvature const&... curvature) const {
    double const change = Chain::gradient_after(at, p, alpha, g, curvature...);
    return evaluations++ >= breaks_at ? nan : change;
  }
};

template <class X>
std::vector<double> values(X const& x) {
  std::vector<double> result;
  for (std::size_t i = 0; i < x.extent(0); ++i)
    for (int c = 0; c < 3; ++c) result.push_back(x(i, c));
  return result;
}

}  // namespace

TEST_CASE("a cut step is followed by a restart") {
  toy::Chain<toy::Barrier> chain;
  auto const x = chain.start();
  bool cut = false, any = false;
  auto const report = DaiKouNcg<>().minimise(chain, x, [&](auto const& step) {
    if (cut) CHECK(step.beta == 0);
    // Newton's step would be longer than half of what is valid.
    cut = step.length < -step.slope / step.curvature * (1 - 1e-12);
    any = any || cut;
  });
  CHECK(any);
  CHECK(report.backtracks == 0);
  CHECK(report.cuts > 0);
  CHECK(report.cuts == report.restarts.cut);
  CHECK(report.converged());
}

TEST_CASE("prescribed unknowns that arrive in pieces") {
  toy::ChainParams const params{.pinned = 2, .pieces = 5, .travel = -0.3};
  toy::Chain<toy::Barrier> chain(params);
  auto const x = chain.start();
  auto const start = values(chain.start());
  auto const report = DaiKouNcg<>().minimise(chain, x);
  CHECK(report.restarts.prescribed == 5);
  CHECK(report.converged());
  CHECK(report.iterations > 5);
  for (std::size_t k = 0; k < 6; ++k) CHECK_THAT(values(x)[k], WithinAbs(start[k] - 0.3, 1e-14));
  CHECK(toy::distance_to_minimum(chain, x) < 1e-3 * chain.scale().length);
}

TEST_CASE("prescribed motion that is still to come is not mistaken for convergence") {
  toy::ChainParams params{.pinned = 1};
  toy::Chain<toy::Anisotropic> const still(params);
  auto const rest = toy::minimum(still, still.start());
  params.pieces = 3;
  params.travel = 0.2;
  toy::Chain<toy::Anisotropic> chain(params);
  double const pin = rest(0, 2);
  auto const report = DaiKouNcg<>().minimise(chain, rest);
  CHECK(report.restarts.prescribed == 3);
  CHECK(report.converged());
  CHECK_THAT(rest(0, 2), WithinAbs(pin + 0.2, 1e-14));
  CHECK(toy::distance_to_minimum(chain, rest) < 1e-3 * chain.scale().length);
}

TEST_CASE("nothing to do") {
  // Both bonds at rest, no inertia: the gradient is exactly zero.
  toy::Chain<toy::Anisotropic> chain({.size = 3, .has_inertia = false});
  toy::Chain<toy::Anisotropic>::Positions const x("x", 3);
  auto const rest = toy::Anisotropic().rest<double>();
  for (int i = 0; i < 3; ++i)
    for (int c = 0; c < 3; ++c) x(i, c) = i * rest[c];
  auto const before = values(x);
  auto const report = DaiKouNcg<>().minimise(chain, x);
  CHECK(report.stop == Stop::converged_by_gradient);
  CHECK(report.iterations == 0);
  CHECK(report.error_estimate_m == report.error_floor_m);
  CHECK(report.error_floor_m < 1e-15);
  CHECK(values(x) == before);
}

TEST_CASE("at the minimum to round-off it is converged, not stalled") {
  toy::Chain<toy::Quartic> chain;
  auto const x = toy::minimum(chain, chain.start());
  auto const report = DaiKouNcg<>().minimise(chain, x);
  CHECK(report.converged());
  CHECK(report.error_estimate_m < 1e-10);
}

TEST_CASE("the budget is not convergence") {
  toy::Chain<toy::Quartic> chain;
  DaiKouNcg<>::Params params;
  params.budget.max_iterations = 5;
  auto report = DaiKouNcg<>(params).minimise(chain, chain.start());
  CHECK(report.stop == Stop::budget_iterations);
  CHECK(report.iterations == 5);
  CHECK_FALSE(report.converged());
  CHECK(std::isfinite(report.error_estimate_m));

  params.budget = {.max_seconds = 0};
  report = DaiKouNcg<>(params).minimise(chain, chain.start());
  CHECK(report.stop == Stop::budget_seconds);
  CHECK(report.iterations == 0);
}

TEST_CASE("a gradient that is not a number leaves the last good iterate") {
  SECTION("at once") {
    Breaking chain;
    auto const x = chain.start();
    auto const report = DaiKouNcg<>().minimise(chain, x);
    CHECK(report.stop == Stop::non_finite);
    CHECK(values(x) == values(chain.start()));
  }
  SECTION("after an unchecked step") {
    Breaking chain;
    chain.breaks_at = 3;
    auto const x = chain.start();
    std::vector<std::vector<double>> iterates;
    auto const report = DaiKouNcg<NewtonStep>().minimise(
        chain, x, [&](auto const& step) { iterates.push_back(values(step.x)); });
    CHECK(report.stop == Stop::non_finite);
    CHECK(report.iterations == 3);
    REQUIRE(iterates.size() == 3);
    CHECK(values(x) == iterates[1]);  // the gradient was good there
  }
  SECTION("in a line search") {
    Breaking chain;
    chain.breaks_at = 4;
    auto const x = chain.start();
    std::vector<std::vector<double>> iterates;
    auto const report = DaiKouNcg<>().minimise(
        chain, x, [&](auto const& step) { iterates.push_back(values(step.x)); });
    CHECK(report.stop == Stop::non_finite);
    CHECK_FALSE(report.converged());
    REQUIRE(iterates.size() == 3);
    CHECK(values(x) == iterates.back());
  }
}

TEST_CASE("the paper's configuration: no checks, no restarts, predicted energies") {
  using Paper = Ncg<DaiKou, Jacobi, NewtonStep, EnergyDrop, Fp64>;
  toy::Chain<toy::Anisotropic> chain;
  auto const x = chain.start();
  Paper::Params params;
  params.line_search.bound.fraction = std::numeric_limits<double>::infinity();
  params.stop.tolerance = 1e-4;
  params.safeguard.on = false;
  std::vector<double> decrements;
  auto const report = Paper(params).minimise(
      chain, x, [&](auto const& step) { decrements.push_back(-step.energy_change); });
  CHECK(report.stop == Stop::converged_by_energy_drop);
  CHECK(report.restarts.total() == 0);
  REQUIRE(decrements.size() == std::size_t(report.iterations));
  for (std::size_t k = 0; k + 1 < decrements.size(); ++k)
    CHECK(decrements[k] >= 1e-4 * decrements[0]);
  CHECK(decrements.back() < 1e-4 * decrements[0]);
  // The model is exact on a quadratic.
  CHECK_THAT(report.energy_change, WithinRel(chain.value(x) - chain.value(chain.start()), 1e-10));
}

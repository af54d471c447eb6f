// L-BFGS against the two-loop recursion as it is printed, and that it finds minima.
#include "oracle.hpp"

#include <taut/integrators/any_preconditioner.hpp>
#include <taut/integrators/lbfgs.hpp>

#include <catch2/catch_test_macros.hpp>
#include <catch2/generators/catch_generators.hpp>
#include <catch2/matchers/catch_matchers_string.hpp>

#include <deque>
#include <string>
#include <vector>

using namespace taut;

namespace {

using ByLbfgs = Lbfgs<AnyPreconditioner, SufficientDecrease, DecrementWindow, Fp64>;
using Numbers = std::vector<double>;

template <class Field>
Numbers numbers(Field const& field) {
  Numbers to;
  for (std::size_t i = 0; i < field.extent(0); ++i)
    for (int c = 0; c < 3; ++c) to.push_back(field(i, c));
  return to;
}
double dot(Numbers const& a, Numbers const& b) {
  double sum = 0;
  for (std::size_t k = 0; k < a.size(); ++k) sum += a[k] * b[k];
  return sum;
}
/// a + f b
Numbers plus(Numbers a, double f, Numbers const& b) {
  for (std::size_t k = 0; k < a.size(); ++k) a[k] += f * b[k];
  return a;
}

struct Pair {
  Numbers s, y;
};

/// -H g (Nocedal and Wright, algorithm 7.4) with H0 = 1; the newest pair is the last.
Numbers two_loops(std::deque<Pair> const& pairs, Numbers const& g) {
  Numbers q = g, a(pairs.size());
  for (std::size_t k = pairs.size(); k-- > 0;) {
    a[k] = dot(pairs[k].s, q) / dot(pairs[k].y, pairs[k].s);
    q = plus(q, -a[k], pairs[k].y);
  }
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    double const b = dot(pairs[k].y, q) / dot(pairs[k].y, pairs[k].s);
    q = plus(q, a[k] - b, pairs[k].s);
  }
  return plus(Numbers(q.size(), 0), -1, q);
}

/// P = 1, said to be another one now and then.
template <class P = Mixed, class S = DefaultSpace>
struct Renewed : Identity<P, S> {
  static constexpr int every = 4;
  using Identity<P, S>::Identity;
  Refresh refresh() const { return Refresh::lagged(every); }
};

}  // namespace

TEST_CASE("directions are those of the two-loop recursion, also after a rejected pair") {
  auto const window = std::size_t(GENERATE(1, 3, 8, 13, 20));
  CAPTURE(window);
  // Not convex: s'y is negative now and then.
  toy::Chain<toy::Quartic> chain({.size = 12});
  ByLbfgs::Params params;
  params.lbfgs.window = int(window);
  params.lbfgs.least_curvature = 0.1;
  params.preconditioner = AnyPreconditioner<Fp64>::by_name("identity");
  params.stop.tolerance = 0;
  params.budget.max_iterations = 60;

  auto const x = chain.start();
  toy::Chain<toy::Quartic>::Field const field("gradient", chain.size());
  auto const gradient = [&](auto const& at) {
    chain.gradient(at, field);
    return numbers(field);
  };
  Numbers from = numbers(x), g = gradient(x);
  std::deque<Pair> pairs;
  int rejected = 0;
  double worst = 0;
  auto const report = ByLbfgs(params).minimise(chain, x, [&](auto const& step) {
    Numbers const p = two_loops(pairs, g), to = numbers(step.x), g_to = gradient(step.x);
    Pair const pair{plus(to, -1, from), plus(g_to, -1, g)};
    Numbers const off = plus(pair.s, -step.length, p);
    worst = std::max(worst, std::sqrt(dot(off, off) / dot(pair.s, pair.s)));
    // A pair that is not kept has used up the oldest one's place.
    bool const keep = dot(pair.s, pair.y) > 0.1 * std::abs(dot(pair.s, g));
    rejected += !keep;
    if (pairs.size() == window) pairs.pop_front();
    if (keep) pairs.push_back(pair);
    from = to;
    g = g_to;
  });
  CHECK(report.iterations == 60);
  CHECK(report.restarts.total() == 0);
  CHECK(worst < 1e-6);
  CHECK(rejected > 0);
  // The last step's pair was never looked at.
  CHECK(report.skipped_pairs >= rejected - 1);
  CHECK(report.skipped_pairs <= rejected);
}

TEST_CASE("pairs are forgotten with the metric where that is asked for") {
  bool const forget = GENERATE(false, true);
  CAPTURE(forget);
  toy::Chain<toy::Quartic> chain({.size = 12});
  using Renewing = Lbfgs<Renewed, SufficientDecrease, DecrementWindow, Fp64>;
  Renewing::Params params;
  params.lbfgs = {.window = 8, .forget_when_renewed = forget, .least_curvature = 0.1};
  params.stop.tolerance = 0;
  params.budget.max_iterations = 40;
  auto const x = chain.start();
  toy::Chain<toy::Quartic>::Field const field("gradient", chain.size());
  auto const gradient = [&](auto const& at) {
    chain.gradient(at, field);
    return numbers(field);
  };
  Numbers from = numbers(x), g = gradient(x);
  std::deque<Pair> pairs;
  double worst = 0;
  auto const report = Renewing(params).minimise(chain, x, [&](auto const& step) {
    if (forget && step.index % Renewed<>::every == 0) pairs.clear();
    Numbers const p = two_loops(pairs, g), to = numbers(step.x), g_to = gradient(step.x);
    Pair const pair{plus(to, -1, from), plus(g_to, -1, g)};
    Numbers const off = plus(pair.s, -step.length, p);
    worst = std::max(worst, std::sqrt(dot(off, off) / dot(pair.s, pair.s)));
    if (pairs.size() == 8) pairs.pop_front();
    if (dot(pair.s, pair.y) > 0.1 * std::abs(dot(pair.s, g))) pairs.push_back(pair);
    from = to;
    g = g_to;
  });
  REQUIRE(report.iterations == 40);
  CHECK(report.restarts.total() == 0);
  CHECK(report.refreshes == 10);
  CHECK(worst < 1e-6);
}

TEST_CASE("L-BFGS finds the minimum, with all preconditioners") {
  std::string const preconditioner = GENERATE("identity", "jacobi", "block_jacobi", "schwarz");
  // The unit step suits only what is close to an inverse.
  bool const newton_step = preconditioner != "schwarz";
  CAPTURE(preconditioner);
  toy::Chain<toy::Barrier> chain;
  auto const x = chain.start();
  ByLbfgs::Params params;
  params.lbfgs.newton_step = newton_step;
  params.preconditioner = AnyPreconditioner<Fp64>::by_name(preconditioner);
  params.stop.tolerance = 1e-5;
  auto const report = ByLbfgs(params).minimise(chain, x, [](auto const& iteration) {
    CHECK(iteration.slope < 0);
    CHECK(iteration.energy_change < 1e-12);  // but for round-off
  });
  CHECK(report.converged());
  CHECK(toy::distance_to_minimum(chain, x) < 3e-5 * chain.scale().length);
}

TEST_CASE("after a step that had to be shortened, L-BFGS asks the model how far to go") {
  auto const run = [](bool asks) {
    toy::Chain<toy::Barrier> chain;
    auto const x = chain.start();
    ByLbfgs::Params params;
    params.lbfgs.newton_step = false;
    params.lbfgs.newton_after_backtracks = asks;
    params.preconditioner = AnyPreconditioner<Fp64>::by_name("identity");
    params.stop.tolerance = 1e-5;
    auto const report = ByLbfgs(params).minimise(chain, x);
    CHECK(report.converged());
    CHECK(toy::distance_to_minimum(chain, x) < 3e-5 * chain.scale().length);
    return report.backtracks;
  };
  int const asking = run(true), trying = run(false);
  CAPTURE(asking, trying);
  CHECK(3 * asking < 2 * trying);
}

TEST_CASE("a window that cannot be kept is refused") {
  ByLbfgs::Params params;
  params.lbfgs.window = GENERATE(0, 21);
  CHECK_THROWS_WITH(ByLbfgs(params), Catch::Matchers::ContainsSubstring("choose 1 to 20"));
}

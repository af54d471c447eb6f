// Projected Newton: its error estimate, prescribed motion, and why it stops.
#include "newton_samples.hpp"

#include <taut/integrators/schwarz.hpp>

#include <catch2/catch_test_macros.hpp>

namespace {

using namespace taut;
using namespace taut::test;

}  // namespace

TEST_CASE("the reported error is the true one") {
  Chain<toy::Barrier> chain({.size = 60});
  auto const minimum = minimum_of(chain);
  auto const mass = chain.mass();
  for (double const tolerance : {1e-1, 1e-2, 1e-4, 1e-6}) {
    auto const x = chain.start();
    Assembled::Params params;
    params.stop.tolerance = tolerance;
    auto const report = Assembled(params).minimise(chain, x);
    double square = 0;
    for (int i = 0; i < chain.size(); ++i)
      for (int c = 0; c < 3; ++c) square += mass(i) * std::pow(x(i, c) - minimum(i, c), 2);
    double const error = std::sqrt(square / chain.scale().mass);
    CHECK(report.converged());
    CHECK(report.error_estimate_m <= tolerance * chain.scale().length);
    CHECK(error <= report.error_estimate_m);
  }
}

TEST_CASE("the energy never rises, also where it is concave") {
  Chain<toy::Quartic> chain({.size = 30});
  auto const x = chain.start();
  double energy = chain.value(x);
  Assembled newton;
  auto const report = newton.minimise(chain, x, [&](auto const& step) {
    double const next = chain.value(step.x);
    CHECK(next <= energy + 1e-12 * std::abs(energy));
    CHECK(std::abs(next - energy - step.energy_change) < 1e-9 * std::abs(energy));
    energy = next;
  });
  CHECK(report.converged());
  CHECK(report.linear_failures == 0);
}

TEST_CASE("a step that would leave the domain is cut and counted") {
  Chain<toy::Barrier> chain({.size = 30}, {.stiffness = 1e4, .strength = 1e-6});
  auto const x = chain.start();
  double least = toy::infinity;
  auto const report = Assembled().minimise(chain, x, [&](auto const& step) {
    for (int i = 0; i + 1 < chain.size(); ++i)
      least = std::min(least, double(step.x(i + 1, 0) - step.x(i, 0)));
  });
  CHECK(least > 0);
  CHECK(report.cuts > 0);
  CHECK(report.converged());
}

TEST_CASE("prescribed motion is carried through the iterations") {
  toy::ChainParams const params{.size = 40, .pinned = 3, .pieces = 4, .travel = 0.3};
  Chain<toy::Barrier> pieces(params), once({.size = 40, .pinned = 3, .pieces = 1, .travel = 0.3});
  auto const x = pieces.start(), y = once.start();
  Assembled::Params precise;
  precise.stop.tolerance = 1e-12;
  auto const report = Assembled(precise).minimise(pieces, x);
  Assembled(precise).minimise(once, y);
  CHECK(report.converged());
  CHECK(report.restarts.prescribed == 4);
  CHECK(distance(x, y) < 1e-11);
  auto const start = pieces.start();
  for (int i = 0; i < 3; ++i)
    for (int c = 0; c < 3; ++c) CHECK(std::abs(x(i, c) - start(i, c) - 0.3) < 1e-14);
}

TEST_CASE("Newton says why it stops") {
  Chain<toy::Barrier> chain({.size = 20});
  auto const x = chain.start();
  Assembled::Params params;
  SECTION("budget") {
    params.budget.max_iterations = 2;
    auto const report = Assembled(params).minimise(chain, x);
    CHECK(report.stop == Stop::budget_iterations);
    CHECK_FALSE(report.converged());
    CHECK(report.iterations == 2);
    CHECK(report.linear_iterations > 0);
  }
  SECTION("not a number") {
    x(7, 1) = std::nan("");
    CHECK(Assembled(params).minimise(chain, x).stop == Stop::non_finite);
  }
  SECTION("round-off, from afar and from the minimum") {
    params.stop.tolerance = 0;
    Assembled newton(params);
    for (int const most : {25, 10}) {
      auto const report = newton.minimise(chain, x);
      CHECK(report.stop == Stop::stalled);
      CHECK(report.iterations < most);
      CHECK(report.error_estimate_m < 1e-12);
    }
  }
}

TEST_CASE("a singular Hessian: conjugate gradients manage, the direct solver says that it failed") {
  Chain<toy::Anisotropic> chain({.size = 20, .has_inertia = false});  // free to translate
  auto const x = chain.start();
  auto const report = Assembled().minimise(chain, x);
  CHECK(report.converged());
  CHECK(report.linear_failures == 0);
  CHECK(chain.value(x) < 1e-8);

  auto const y = chain.start();
  double const before = chain.value(y);
  Exact::Params params;
  params.budget.max_iterations = 20;
  auto const failed = Exact(params).minimise(chain, y);
  CHECK(failed.linear_failures == failed.iterations);
  CHECK(chain.value(y) < before);
}

TEST_CASE("Newton runs with Schwarz, in mixed and in single precision") {
  auto const check = [](auto precision, double tolerance) {
    using P = decltype(precision);
    Chain<toy::Barrier, P> chain({.size = 200});
    auto const x = chain.start();
    using M = Method<AssembledPcg, Schwarz, P>;
    typename M::Params params;
    params.stop.tolerance = tolerance;
    auto const report = M(params).minimise(chain, x);
    CHECK(report.converged());
    auto const minimum = minimum_of(Chain<toy::Barrier>({.size = 200}));
    CHECK(distance(x, minimum) < 10 * tolerance);
  };
  check(Mixed(), 1e-5);
  check(Fp32(), 1e-3);
}

TEST_CASE("Newton is bitwise repeatable for any number of threads") {
  toy::Chain<toy::Barrier, Fp64, DefaultSpace> threads({.size = 3000});
  toy::Chain<toy::Barrier, Fp64, SerialSpace> serial({.size = 3000});
  auto const x = threads.start();
  auto const y = serial.start();
  Newton<AssembledPcg, BlockJacobi, SufficientDecrease, DecrementWindow, Fp64, DefaultSpace>()
      .minimise(threads, x);
  Newton<AssembledPcg, BlockJacobi, SufficientDecrease, DecrementWindow, Fp64, SerialSpace>()
      .minimise(serial, y);
  CHECK(distance(x, y) == 0);
}

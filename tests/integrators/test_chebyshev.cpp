// Chebyshev's semi-iteration against its recursion, and what it is worth.
#include "oracle.hpp"

#include <taut/integrators/any_preconditioner.hpp>
#include <taut/integrators/chebyshev.hpp>
#include <taut/integrators/ncg.hpp>

#include <catch2/catch_test_macros.hpp>
#include <catch2/generators/catch_generators.hpp>

#include <string>
#include <vector>

using namespace taut;

namespace {

using ByChebyshev = Chebyshev<AnyPreconditioner, SufficientDecrease, DecrementWindow, Fp64>;

}  // namespace

TEST_CASE("on a quadratic iterates are those of the recursion") {
  toy::Chain<toy::Anisotropic> chain({.size = 20}, {.stiffest = 40});
  ByChebyshev::Params params;
  params.chebyshev = {.rho = 0.8, .delay = 4};
  params.preconditioner = AnyPreconditioner<Fp64>::by_name("identity");
  params.stop.tolerance = 0;
  params.budget.max_iterations = 30;
  int const n = chain.size();
  toy::Chain<toy::Anisotropic>::Field const g("g", n), hg("hg", n);
  auto const now = chain.start();
  toy::Chain<toy::Anisotropic>::Positions const before("before", n);
  double omega = 1, worst = 0, travel = 0;
  auto const x = chain.start();
  auto const report = ByChebyshev(params).minimise(chain, x, [&](auto const& step) {
    chain.gradient(now, g);
    chain.product(now, g, hg);
    double gg = 0, ghg = 0;
    for (int i = 0; i < n; ++i)
      for (int c = 0; c < 3; ++c) {
        gg += g(i, c) * g(i, c);
        ghg += g(i, c) * hg(i, c);
      }
    if (step.index == 4) omega = 2 / (2 - 0.8 * 0.8);
    if (step.index > 4) omega = 4 / (4 - 0.8 * 0.8 * omega);
    for (int i = 0; i < n; ++i)
      for (int c = 0; c < 3; ++c) {
        double const hat = now(i, c) - gg / ghg * g(i, c);
        double const next = omega * (hat - before(i, c)) + before(i, c);
        travel = std::max(travel, std::abs(next - now(i, c)));
        worst = std::max(worst, std::abs(next - step.x(i, c)));
        before(i, c) = now(i, c);
        now(i, c) = next;
      }
  });
  CHECK(report.iterations == 30);
  CHECK(report.backtracks == 0);
  CHECK(report.restarts.total() == 0);
  CHECK(travel > 0.01);
  CHECK(worst < 1e-9);
}

TEST_CASE("Chebyshev finds the minimum, with all preconditioners") {
  std::string const preconditioner = GENERATE("identity", "jacobi", "block_jacobi", "schwarz");
  double const rho = GENERATE(0.0, 0.9);
  CAPTURE(preconditioner, rho);
  toy::Chain<toy::Barrier> chain;
  auto const x = chain.start();
  ByChebyshev::Params params;
  params.chebyshev.rho = rho;
  params.preconditioner = AnyPreconditioner<Fp64>::by_name(preconditioner);
  params.stop.tolerance = 1e-5;
  params.budget.max_iterations = 20000;
  auto const report = ByChebyshev(params).minimise(chain, x, [](auto const& iteration) {
    CHECK(iteration.slope < 0);
    CHECK(iteration.energy_change <= 0);
  });
  CHECK(report.converged());
  CHECK(toy::distance_to_minimum(chain, x) < 1e-4 * chain.scale().length);
}

TEST_CASE("with a measured radius it needs a third of the iterations of gradient descent") {
  toy::Chain<toy::Anisotropic> chain({.size = 20}, {.stiffest = 60});
  ByChebyshev::Params params;
  params.chebyshev.rho = 0;
  params.preconditioner = AnyPreconditioner<Fp64>::by_name("jacobi");
  params.stop.tolerance = 1e-4;
  params.budget.max_iterations = 4000;
  auto const accelerated = ByChebyshev(params).minimise(chain, chain.start());
  CHECK(accelerated.converged());

  using Gradient = Ncg<AnyBeta, AnyPreconditioner, SufficientDecrease, DecrementWindow, Fp64>;
  Gradient::Params plain;
  plain.beta = AnyBeta("gradient");
  plain.preconditioner = params.preconditioner;
  plain.stop = params.stop;
  plain.budget = params.budget;
  auto const descent = Gradient(plain).minimise(chain, chain.start());
  CHECK(descent.converged());
  CHECK(3 * accelerated.iterations < descent.iterations);
}

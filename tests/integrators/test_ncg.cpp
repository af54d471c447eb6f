// Nonlinear CG: it is linear CG where the function is quadratic, and finds minima where it is not.
#include "oracle.hpp"

#include <taut/integrators/any_preconditioner.hpp>
#include <taut/integrators/ncg.hpp>

#include <catch2/catch_test_macros.hpp>
#include <catch2/generators/catch_generators.hpp>
#include <catch2/matchers/catch_matchers_floating_point.hpp>

#include <string>

using namespace taut;
using Catch::Matchers::WithinRel;

namespace {

template <class LineSearch = SufficientDecrease>
using NcgOfAnyBeta = Ncg<AnyBeta, AnyPreconditioner, LineSearch, DecrementWindow, Fp64>;

}  // namespace

TEST_CASE("all betas find the minimum, with all preconditioners") {
  std::string const beta =
      GENERATE("dk", "dk+", "fr", "prp", "prp+", "hs", "cd", "ls", "hz", "bfgs", "gradient");
  std::string const preconditioner = GENERATE("identity", "jacobi", "block_jacobi", "schwarz");
  CAPTURE(beta, preconditioner);
  toy::Chain<toy::Barrier> chain;
  auto const x = chain.start();
  double const before = chain.value(x);

  NcgOfAnyBeta<>::Params params;
  params.beta = AnyBeta(beta);
  params.preconditioner = AnyPreconditioner<Fp64>::by_name(preconditioner);
  params.stop.tolerance = 1e-5;
  params.budget.max_iterations = 20000;
  double energy = 0;
  auto const report = NcgOfAnyBeta<>(params).minimise(chain, x, [&](auto const& iteration) {
    CHECK(iteration.slope < 0);
    CHECK(iteration.energy_change <= 0);
    energy += iteration.energy_change;
    CHECK(energy == iteration.energy_change_so_far);
  });
  CHECK(report.converged());
  CHECK(report.energy_change == energy);
  CHECK_THAT(energy, WithinRel(chain.value(x) - before, 1e-10));
  CHECK(report.error_estimate_m < 1e-5 * chain.scale().length);
  CHECK_THAT(report.error_estimate_mps,
             WithinRel(report.error_estimate_m / chain.scale().time_step, 1e-15));
  // Descent without momentum converges so slowly here that eight steps say little about the rest.
  double const factor = beta == "gradient" ? 10 : 3;
  CHECK(toy::distance_to_minimum(chain, x) < factor * 1e-5 * chain.scale().length);
}

TEST_CASE("a function that is not convex") {
  // FR and CD are left out: without exact line searches they jam on it.
  std::string const beta = GENERATE("dk", "dk+", "prp", "prp+", "hs", "ls", "hz", "bfgs");
  CAPTURE(beta);
  toy::Chain<toy::Quartic> chain;
  auto const x = chain.start();
  NcgOfAnyBeta<>::Params params;
  params.beta = AnyBeta(beta);
  params.stop.tolerance = 1e-6;
  params.budget.max_iterations = 5000;
  auto const report = NcgOfAnyBeta<>(params).minimise(
      chain, x, [](auto const& iteration) { CHECK(iteration.slope < 0); });
  CHECK(report.converged());
  CHECK(report.backtracks > 0);
  CHECK(toy::distance_to_minimum(chain, x) < 5e-6 * chain.scale().length);
}

TEST_CASE("on a quadratic with exact steps all betas are linear CG") {
  // Mild, or round-off costs conjugacy before the end.
  toy::Chain<toy::Anisotropic> chain({.size = 4}, {.stiffest = 60});
  std::string const preconditioner = GENERATE("identity", "jacobi", "block_jacobi");
  CAPTURE(preconditioner);

  // Linear CG on H s = -g, with the same P.
  auto const start = chain.start();
  int const n = chain.size();
  toy::Chain<toy::Anisotropic>::Field const r("r", n), z("z", n), p("p", n), hp("hp", n);
  AnyPreconditioner<Fp64> metric(AnyPreconditioner<Fp64>::by_name(preconditioner));
  metric.resize(n);
  auto const& curvature = metric.curvature();
  if (curvature.blocks.extent(0) > 0) chain.gradient(start, r, curvature.blocks);
  if (curvature.diagonal.extent(0) > 0) chain.gradient(start, r, curvature.diagonal);
  chain.gradient(start, r);
  metric.update(chain, start);
  auto const product = [n](auto const& a, auto const& b) {
    double sum = 0;
    for (int i = 0; i < n; ++i)
      for (int c = 0; c < 3; ++c) sum += a(i, c) * b(i, c);
    return sum;
  };
  std::vector<double> expected;  // energy changes
  for (double last = 1; expected.size() < 12;) {
    metric.apply(r, z);
    double const descent = product(r, z), beta = expected.empty() ? 0 : descent / last;
    last = descent;
    for (int i = 0; i < n; ++i)
      for (int c = 0; c < 3; ++c) p(i, c) = beta * p(i, c) - z(i, c);
    chain.product(start, p, hp);
    double const alpha = descent / product(p, hp);
    expected.push_back(-0.5 * alpha * descent);
    for (int i = 0; i < n; ++i)
      for (int c = 0; c < 3; ++c) r(i, c) += alpha * hp(i, c);
  }

  std::string const beta = GENERATE("dk", "fr", "prp", "prp+", "hs", "cd", "ls", "hz", "bfgs");
  CAPTURE(beta);
  NcgOfAnyBeta<ExactLineSearch>::Params params;
  params.beta = AnyBeta(beta);
  params.preconditioner = AnyPreconditioner<Fp64>::by_name(preconditioner);
  params.stop.tolerance = 0;
  params.budget.max_iterations = 3 * n + 6;  // a few for what round-off has cost
  auto const x = chain.start();
  auto const report =
      NcgOfAnyBeta<ExactLineSearch>(params).minimise(chain, x, [&](auto const& step) {
        // Later ones are a small difference of what round-off has made of conjugacy.
        if (step.index < 10)
          CHECK_THAT(step.energy_change, WithinRel(expected[std::size_t(step.index)], 1e-6));
      });
  CHECK(report.restarts.total() == 0);
  CHECK(toy::distance_to_minimum(chain, x) < 1e-5);
}

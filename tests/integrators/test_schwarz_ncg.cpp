// Schwarz inside nonlinear CG: rebuilt rarely, without a restart.
#include "elastic_bar.hpp"
#include "toy_objectives.hpp"

#include <taut/integrators/ncg.hpp>
#include <taut/integrators/schwarz.hpp>
#include <taut/integrators/time_stepper.hpp>

#include <catch2/catch_test_macros.hpp>

#include <cstdint>

namespace {

using namespace taut;

/// Of Kokkos. The coarse solve has no others by construction.
int allocations = 0;
void count_allocation(Kokkos_Profiling_SpaceHandle, char const*, void const*, std::uint64_t) {
  ++allocations;
}

}  // namespace

TEST_CASE("nonlinear CG needs fewer iterations with Schwarz") {
  using Chain = toy::Chain<toy::Anisotropic, Fp64>;
  Chain chain({.size = 600});
  auto const x = chain.start(), y = chain.start();

  Ncg<DaiKou, BlockJacobi, SufficientDecrease, DecrementWindow, Fp64> jacobi(
      {.stop = {.tolerance = 1e-8}});
  Ncg<DaiKou, Schwarz, SufficientDecrease, DecrementWindow, Fp64> schwarz(
      {.stop = {.tolerance = 1e-8}});
  auto const slow = jacobi.minimise(chain, x);
  auto const fast = schwarz.minimise(chain, y);
  CAPTURE(slow.iterations, fast.iterations, fast.refreshes);
  CHECK(slow.converged());
  CHECK(fast.converged());
  CHECK(2 * fast.iterations < slow.iterations);
  CHECK(fast.refreshes <= 1 + fast.iterations / 10);
  double largest = 0;
  for (int i = 0; i < chain.size(); ++i)
    for (int c = 0; c < 3; ++c) largest = std::max(largest, std::abs(x(i, c) - y(i, c)));
  CHECK(largest < 1e-6);
}

TEST_CASE("a coarse level that can turn carries bending") {
  using Method = Ncg<DaiKou, Schwarz, SufficientDecrease, DecrementWindow, Fp64>;
  test::Bar<Fp64> const bar({1, 0.1, 0.1}, 30, 1e6);
  auto const iterations = [&](int max_levels) {
    auto potential = bar.potential({0, 0, 0}, -1);
    State<Fp64> state(bar.positions());
    Method::Params params;
    params.preconditioner.levels.max_levels = max_levels;
    params.budget.max_iterations = 5000;
    auto const report = QuasiStatic<Method>(params).step(potential, state, 0.01);
    CHECK(report.converged());
    return report.iterations;
  };
  int const with = iterations(10), without = iterations(1);
  CAPTURE(with, without);
  CHECK(4 * with < without);
}

TEST_CASE("applying Schwarz allocates nothing") {
  toy::Chain<toy::Anisotropic, Fp64> chain({.size = 600});
  Schwarz<Fp64> schwarz;
  schwarz.resize(chain.size());
  schwarz.update(chain, chain.start());
  REQUIRE(schwarz.levels().has_coarse_level());
  VectorField<double, DefaultSpace> const g("g", chain.size()), z("z", chain.size());
  schwarz.apply(g, z);

  allocations = 0;
  Kokkos::Tools::Experimental::set_allocate_data_callback(count_allocation);
  VectorField<double, DefaultSpace> const counted("counted", 1);
  int const by_test = allocations;
  schwarz.apply(g, z);
  Kokkos::Tools::Experimental::set_allocate_data_callback(nullptr);
  CHECK(by_test == 1);
  CHECK(allocations == by_test);
}

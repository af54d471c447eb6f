// No iteration allocates memory.
#include "toy_objectives.hpp"

#include <taut/integrators/chebyshev.hpp>
#include <taut/integrators/lbfgs.hpp>
#include <taut/integrators/ncg.hpp>

#include <catch2/catch_template_test_macros.hpp>
#include <catch2/catch_test_macros.hpp>

#include <cstdint>

using namespace taut;

namespace {

int allocations = 0;
void count(Kokkos_Profiling_SpaceHandle, char const*, void const*, std::uint64_t) { ++allocations; }

/// Allocations of the second minimisation, which must find all memory in place.
template <class Method>
int allocations_of(int iterations) {
  toy::Chain<toy::Quartic> chain({.size = 1500});
  auto const x = chain.start();
  typename Method::Params params;
  params.stop.tolerance = 0;
  params.budget.max_iterations = iterations;
  Method method(params);
  method.minimise(chain, x);
  allocations = 0;
  Kokkos::Tools::Experimental::set_allocate_data_callback(count);
  auto const report = method.minimise(chain, x);
  Kokkos::Tools::Experimental::set_allocate_data_callback(nullptr);
  CHECK(report.iterations == iterations);
  return allocations;
}

}  // namespace

TEMPLATE_TEST_CASE("iterations allocate nothing", "",
                   (Ncg<DaiKou, BlockJacobi, SufficientDecrease, DecrementWindow, Fp64>),
                   (Lbfgs<BlockJacobi, SufficientDecrease, DecrementWindow, Fp64>),
                   (Chebyshev<Jacobi, SufficientDecrease, DecrementWindow, Fp64>)) {
  CHECK(allocations_of<TestType>(20) == 0);

  // The counter counts.
  allocations = 0;
  Kokkos::Tools::Experimental::set_allocate_data_callback(count);
  { Array<double, DefaultSpace> const array("array", 3); }
  Kokkos::Tools::Experimental::set_allocate_data_callback(nullptr);
  CHECK(allocations == 1);
}

// No iteration on real elements allocates memory, neither through Kokkos nor on the heap.
#include "elastic_bar.hpp"

#include <support/heap.hpp>

#include <taut/integrators/lbfgs.hpp>
#include <taut/integrators/ncg.hpp>

#include <catch2/catch_template_test_macros.hpp>
#include <catch2/catch_test_macros.hpp>
#include <catch2/generators/catch_generators.hpp>

#include <cstdint>

namespace {

std::atomic<long> in_kokkos{0};

void count(Kokkos_Profiling_SpaceHandle, char const*, void const*, std::uint64_t) { ++in_kokkos; }

struct Allocations {
  long kokkos, heap;
};
template <class F>
Allocations allocations_of(F const& f) {
  Kokkos::Tools::Experimental::set_allocate_data_callback(count);
  in_kokkos = 0;
  long const before = taut::test::heap_allocations;
  f();
  long const heap = taut::test::heap_allocations - before;
  Kokkos::Tools::Experimental::set_allocate_data_callback(nullptr);
  return {in_kokkos, heap};
}

}  // namespace

using namespace taut;
using namespace taut::test;

TEMPLATE_TEST_CASE("iterations on tets, inertia and gravity allocate nothing", "",
                   (Ncg<DaiKou, BlockJacobi, SufficientDecrease, DecrementWindow, Fp64>),
                   (Lbfgs<BlockJacobi, SufficientDecrease, DecrementWindow, Fp64>)) {
  Bar<Fp64> const bar({1, 0.3, 0.3}, 10, 1e6);
  auto potential = bar.potential({0, -9.81, 0});
  bool const has_inertia = GENERATE(true, false);
  potential.template term<Inertia<Fp64>>().switch_on(has_inertia);
  auto const x = bar.positions();
  potential.begin_step(x, has_inertia ? 1e-4 : 1, 0.01, has_inertia);
  auto const run = [&](int iterations) {
    typename TestType::Params params;
    params.stop.tolerance = 0;
    params.budget.max_iterations = iterations;
    TestType method(params);
    method.minimise(potential, x);  // sizes what it works on
    return allocations_of([&] { CHECK(method.minimise(potential, x).iterations == iterations); });
  };
  Allocations const ten = run(10), thirty = run(30);
  CHECK(thirty.kokkos == 0);
  CHECK(thirty.heap == ten.heap);

  Allocations const counted = allocations_of([] {
    std::vector<double> const numbers(100);
    Array<double, DefaultSpace> const array("array", 100);
  });
  CHECK(counted.kokkos == 1);
  CHECK(counted.heap > 0);
}

// No iteration on real elements allocates memory, neither through Kokkos nor on the heap.
#include "elastic_bar.hpp"

#include <taut/integrators/lbfgs.hpp>
#include <taut/integrators/ncg.hpp>

#include <catch2/catch_template_test_macros.hpp>
#include <catch2/catch_test_macros.hpp>
#include <catch2/generators/catch_generators.hpp>

#include <atomic>
#include <cstdint>
#include <cstdlib>
#include <new>

namespace {

/// Names of loops and of fences, which Kokkos copies, are no longer than this; a field always is.
constexpr std::size_t longest_label = 256;
std::atomic<bool> counting{false};
std::atomic<int> on_heap{0}, in_kokkos{0};

void count(Kokkos_Profiling_SpaceHandle, char const*, void const*, std::uint64_t) { ++in_kokkos; }

void start_counting() {
  on_heap = in_kokkos = 0;
  Kokkos::Tools::Experimental::set_allocate_data_callback(count);
  counting = true;
}
void stop_counting() {
  counting = false;
  Kokkos::Tools::Experimental::set_allocate_data_callback(nullptr);
}

}  // namespace

// Not inlined: compilers take malloc here and delete there for a mismatch.
[[gnu::noinline]] void* operator new(std::size_t size) {
  if (counting && size > longest_label) ++on_heap;
  if (void* p = std::malloc(size > 0 ? size : 1)) return p;
  throw std::bad_alloc();
}
[[gnu::noinline]] void operator delete(void* p) noexcept { std::free(p); }
[[gnu::noinline]] void operator delete(void* p, std::size_t) noexcept { std::free(p); }

using namespace taut;
using namespace taut::test;

TEMPLATE_TEST_CASE("iterations on tets, inertia and gravity allocate nothing", "",
                   (Ncg<DaiKou, BlockJacobi, SufficientDecrease, DecrementWindow, Fp64>),
                   (Lbfgs<BlockJacobi, SufficientDecrease, DecrementWindow, Fp64>)) {
  Bar<Fp64> const bar({1, 0.3, 0.3}, 10, 1e6);
  auto potential = bar.potential({0, -9.81, 0});
  bool const has_inertia = GENERATE(true, false);
  potential.template term<Inertia<Fp64>>().switch_on(has_inertia);
  potential.begin_step(has_inertia ? 1e-4 : 1, 0.01, has_inertia);
  auto const x = bar.positions();
  typename TestType::Params params;
  params.stop.tolerance = 0;
  params.budget.max_iterations = 20;
  TestType method(params);
  method.minimise(potential, x);
  start_counting();
  auto const report = method.minimise(potential, x);
  stop_counting();
  CHECK(report.iterations == 20);
  CHECK(in_kokkos == 0);
  CHECK(on_heap == 0);

  start_counting();
  { std::vector<double> const numbers(100); }
  { Array<double, DefaultSpace> const array("array", 100); }
  stop_counting();
  CHECK(in_kokkos == 1);
  CHECK(on_heap > 0);
}

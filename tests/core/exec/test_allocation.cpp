// Loops and sums allocate nothing after their first use, not even for a name.
#include <support/heap.hpp>

#include <taut/core/exec/parallel.hpp>

#include <catch2/catch_test_macros.hpp>

using namespace taut;

namespace {

using S = DefaultSpace;
using Values = Kokkos::View<double*, S::memory>;

struct Increment {
  Values value;
  KOKKOS_FUNCTION void operator()(int i) const { value(i) += 1; }
};
struct AddUp {
  Values value;
  KOKKOS_FUNCTION void operator()(int i, Sums<double, 2>& sums) const { sums[0] += value(i); }
};

template <class F>
long allocations_of(F const& f) {
  f();
  long const before = test::heap_allocations;
  f();
  return test::heap_allocations - before;
}

}  // namespace

TEST_CASE("a loop that is run again allocates nothing", "[exec]") {
  int const n = 10'000;
  Values const value("value", n);
  CHECK(allocations_of([&] {
          for_each<S>("a name of more than fifteen characters", n, Increment{value});
        }) == 0);
  Reducer<S> const reducer(n);
  CHECK(allocations_of([&] {
          reducer.sum<2>("another name of more than fifteen characters", n, AddUp{value});
        }) == 0);
  CHECK(allocations_of([] { ::operator delete(::operator new(8)); }) == 1);  // the counter counts
}

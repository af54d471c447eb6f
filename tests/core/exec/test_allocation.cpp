// Loops and sums allocate nothing after their first use, not even for a name.
#include <taut/core/exec/parallel.hpp>

#include <catch2/catch_test_macros.hpp>

#include <atomic>
#include <cstdlib>
#include <new>

namespace {

std::atomic<int> allocations = 0;

}  // namespace

// Of the whole executable. Not inlined, where the compiler would take new and free for mismatched.
[[gnu::noinline]] void* operator new(std::size_t size) {
  ++allocations;
  if (void* const memory = std::malloc(size)) return memory;
  throw std::bad_alloc();
}
[[gnu::noinline]] void operator delete(void* memory) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }

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
int allocations_of(F const& f) {
  f();
  int const before = allocations;
  f();
  return allocations - before;
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

// Numbers of threads and sizes of teams to run a kernel with, for what must not depend on them.
#pragma once

#include <Kokkos_Core.hpp>
#include <catch2/catch_test_macros.hpp>

#include <exception>
#include <vector>

#ifdef KOKKOS_ENABLE_OPENMP
#include <omp.h>
#endif

namespace taut::test {

/// Calls f() with every host loop on one thread. Kokkos keeps the number of threads that it started
/// with, whatever omp_set_num_threads says; but it does not open a parallel region within another.
/// Where the host has one thread anyway, this is a plain call.
template <class F>
void on_one_thread(F const& f) {
#ifdef KOKKOS_ENABLE_OPENMP
  std::exception_ptr thrown;  // must not leave the region
  int const levels = omp_get_max_active_levels();
  omp_set_max_active_levels(1);
#pragma omp parallel num_threads(1)
  {
    try {
      REQUIRE(Kokkos::DefaultHostExecutionSpace().concurrency() == 1);
      f();
    } catch (...) {
      thrown = std::current_exception();
    }
  }
  omp_set_max_active_levels(levels);
  if (thrown) std::rethrow_exception(thrown);
#else
  f();
#endif
}

/// f() as it is and on one thread, to be compared.
template <class F>
auto on_one_thread_and_all(F const& f) {
  std::vector<decltype(f())> results{f()};
  on_one_thread([&] { results.push_back(f()); });
  return results;
}

/// Sizes of teams that the space can run.
template <class S>
std::vector<int> team_sizes() {
  if constexpr (S::on_host) {
    return typename S::execution().concurrency() > 1 ? std::vector<int>{1, 2} : std::vector<int>{1};
  } else {
    return {32, 64, 128};
  }
}

}  // namespace taut::test

#include <taut/core/exec/host_loop.hpp>

#include <algorithm>

namespace taut::kernels {
namespace {

struct Ranges {
  int n, length;

  template <class Execution>
  Ranges(Execution const& execution, int terms)
      : n(terms), length(terms / std::min(terms, execution.concurrency())) {
    length += length * std::min(terms, execution.concurrency()) < terms;
  }
  int count() const { return n / length + (n % length > 0); }
  int first(int r) const { return r * length; }
  int last(int r) const { return first(r) + std::min(length, n - first(r)); }
};

struct Loop {
  RangeFunction run;
  void const* functor;
  Ranges ranges;
  void operator()(int r) const { run(functor, ranges.first(r), ranges.last(r)); }
};

struct Scan {
  ScanFunction run;
  void const* functor;
  Ranges ranges;
  void operator()(int r, std::int64_t& sum, bool last) const {
    run(functor, ranges.first(r), ranges.last(r), sum, last);
  }
};

template <class Execution>
struct TeamLoop {
  TeamFunction<Execution> run;
  void const* functor;
  void operator()(typename Kokkos::TeamPolicy<Execution>::member_type const& team) const {
    run(functor, team);
  }
};

}  // namespace

template <class Execution>
void host_loop(Execution const& execution, std::string const& label, int n, RangeFunction run,
               void const* functor) {
  if (n <= 0) return;
  Ranges const ranges(execution, n);
  if (ranges.count() == 1) {  // no other thread has to wake for it
    run(functor, 0, n);
    return;
  }
  Kokkos::parallel_for(label, Kokkos::RangePolicy<Execution>(execution, 0, ranges.count()),
                       Loop{run, functor, ranges});
}

template <class Execution>
std::int64_t host_scan(Execution const& execution, std::string const& label, int n,
                       ScanFunction run, void const* functor) {
  std::int64_t total = 0;
  if (n <= 0) return total;
  Ranges const ranges(execution, n);
  Kokkos::parallel_scan(label, Kokkos::RangePolicy<Execution>(execution, 0, ranges.count()),
                        Scan{run, functor, ranges}, total);
  return total;
}

template <class Execution>
void host_team_loop(Kokkos::TeamPolicy<Execution> const& policy, std::string const& label,
                    TeamFunction<Execution> run, void const* functor) {
  Kokkos::parallel_for(label, policy, TeamLoop<Execution>{run, functor});
}

#define TAUT_HOST_LOOPS(E)                                                                        \
  template void host_loop(E const&, std::string const&, int, RangeFunction, void const*);         \
  template std::int64_t host_scan(E const&, std::string const&, int, ScanFunction, void const*);  \
  template void host_team_loop(Kokkos::TeamPolicy<E> const&, std::string const&, TeamFunction<E>, \
                               void const*)
#ifdef KOKKOS_ENABLE_SERIAL
TAUT_HOST_LOOPS(Kokkos::Serial);
#endif
#ifdef KOKKOS_ENABLE_OPENMP
TAUT_HOST_LOOPS(Kokkos::OpenMP);
#endif
#undef TAUT_HOST_LOOPS

}  // namespace taut::kernels

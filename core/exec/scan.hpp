// Prefix sums: where each part of a list begins, from the lengths of the parts.
//
// Integers only: their sums are the same in any order, so a scan repeats bitwise on any number of
// threads.
#pragma once

#include <taut/core/exec/parallel.hpp>

#include <concepts>

namespace taut {

namespace kernels {

template <class T, class View, class Functor>
struct ExclusiveScan {
  using value_type = T;
  Functor functor;
  View to;
  KOKKOS_FUNCTION void operator()(int i, T& sum, bool last) const {
    T const term = functor(i);  // before the writing, for `functor` may read to(i)
    if (last) to(i) = sum;
    sum += term;
  }
};

/// The same over a range of iterations.
template <class T, class View, class Functor>
void scan_range(void const* functor, int first, int last, std::int64_t& sum, bool write) {
  auto const& scan = *static_cast<ExclusiveScan<T, View, Functor> const*>(functor);
  T upto = static_cast<T>(sum);
  for (int i = first; i < last; ++i) scan(i, upto, write);
  sum = upto;
}

template <class View>
struct ReadEntry {
  View from;
  KOKKOS_FUNCTION auto operator()(int i) const { return from(i); }
};

}  // namespace kernels

/// to(i) = functor(0) + ... + functor(i - 1) for i in [0, n); returns the sum of all n terms.
/// `functor(i)` is called more than once and may read to(i). Waits for the result.
template <class S, class T, class Functor>
requires std::integral<T> T exclusive_scan(char const* name, int n, Functor const& functor,
                                           Kokkos::View<T*, typename S::memory> const& to) {
  using View = Kokkos::View<T*, typename S::memory>;
  kernels::ExclusiveScan<T, View, Functor> const scan{functor, to};
  if constexpr (S::on_host) {
    return static_cast<T>(kernels::host_scan(S::instance(), label(name), n,
                                             kernels::scan_range<T, View, Functor>, &scan));
  } else {
    T total = 0;
    if (n > 0) {
      Kokkos::parallel_scan(label(name),
                            Kokkos::RangePolicy<typename S::execution>(S::instance(), 0, n), scan,
                            total);
    }
    return total;
  }
}

/// The same over the entries of `values`, in place.
template <class S, class T>
requires std::integral<T> T exclusive_scan(char const* name,
                                           Kokkos::View<T*, typename S::memory> const& values) {
  using Read = kernels::ReadEntry<Kokkos::View<T*, typename S::memory>>;
  return exclusive_scan<S, T>(name, static_cast<int>(values.extent(0)), Read{values}, values);
}

}  // namespace taut

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
  T total = 0;
  if (n == 0) return total;
  using Scan = kernels::ExclusiveScan<T, Kokkos::View<T*, typename S::memory>, Functor>;
  Kokkos::parallel_scan(label(name),
                        Kokkos::RangePolicy<typename S::execution>(S::instance(), 0, n),
                        Scan{functor, to}, total);
  return total;
}

/// The same over the entries of `values`, in place.
template <class S, class T>
requires std::integral<T> T exclusive_scan(char const* name,
                                           Kokkos::View<T*, typename S::memory> const& values) {
  using Read = kernels::ReadEntry<Kokkos::View<T*, typename S::memory>>;
  return exclusive_scan<S, T>(name, static_cast<int>(values.extent(0)), Read{values}, values);
}

}  // namespace taut

// Whole numbers as sets of bits, by instructions of the machine. Kokkos' functions of these names
// are loops on the host, because they have to be constant expressions as well.
#pragma once

#include <taut/core/exec/side_by_side.hpp>

#include <Kokkos_Core.hpp>

namespace taut {

/// The place of the lowest bit that is set; the number of bits if none is.
template <class Word>
KOKKOS_FORCEINLINE_FUNCTION int lowest_bit(Word word) {
  return Kokkos::Experimental::countr_zero_builtin(word);
}

template <class Word>
KOKKOS_FORCEINLINE_FUNCTION int count_bits(Word word) {
  return Kokkos::Experimental::popcount_builtin(word);
}

/// The set of b in [0, n) of which `holds(b)`. The host asks side by side: let `holds` have no
/// branches.
template <int n, class Holds>
KOKKOS_FORCEINLINE_FUNCTION unsigned bits_where(Holds const& holds) {
  static_assert(0 < n && n <= 32);
  unsigned bits = 0;
  TAUT_SIDE_BY_SIDE
  for (int b = 0; b < n; ++b) bits |= static_cast<unsigned>(holds(b)) << b;
  return bits;
}

}  // namespace taut

// Rows of eight numbers in memory that hold two 3-vectors of a vertex, in places 0 to 2 and 4 to 6:
// one index finds both, and where a register holds eight numbers or more one load fetches them.
#pragma once

#include <taut/core/math/rows.hpp>

namespace taut {

/// a[c] = number c of the row from[2 begin[lane]...] in every lane, b[c] = number 4 + c.
template <class T, class Index>
KOKKOS_FORCEINLINE_FUNCTION void load_row_pairs(ValueType<T> const* from, Index const* begin,
                                                T (&a)[3], T (&b)[3]) {
#if defined(__GNUC__) && !defined(__CUDACC__)
  if constexpr (kernels::has_quads<T>) {
    using Registers = kernels::QuadsOf<T>;
    using Vector = typename Registers::Vector;
    constexpr int lanes = ScalarTraits<T>::lanes;
    if constexpr (lanes >= 8) {
      // The rows of every eighth lane in one register.
      auto const rows = [&](int lane) __attribute__((always_inline)) {
        return Registers::template load<8, 2>(from, begin + lane);
      };
      Vector low[4] = {rows(0), rows(1), rows(2), rows(3)},
             high[4] = {rows(4), rows(5), rows(6), rows(7)};
      // Even quads of these are of the first vectors, odd ones of the second.
      Registers::transpose(low);
      Registers::transpose(high);
      constexpr std::make_integer_sequence<int, lanes> numbers;
      for (int c = 0; c < 3; ++c) {
        a[c] = std::bit_cast<T>(Registers::template every_other<0>(low[c], high[c], numbers));
        b[c] = std::bit_cast<T>(Registers::template every_other<1>(low[c], high[c], numbers));
      }
    } else {
      load_rows<2>(from, begin, a);
      load_rows<2>(from + 4, begin, b);
    }
    return;
  }
#endif
  load_rows<2>(from, begin, a);
  load_rows<2>(from + 4, begin, b);
}

#if defined(__GNUC__) && !defined(__CUDACC__)

namespace kernels {
template <class Real>
using Row __attribute__((vector_size(4 * sizeof(Real)))) = Real;
}

/// The row to[0...3] = (numbers of `field` at i) - origin, and a zero.
template <class Real, class Field, class Position>
KOKKOS_FORCEINLINE_FUNCTION void store_relative(Field const& field, int i,
                                                Position const (&origin)[3], Real* to) {
  kernels::Row<Position> const value = {field(i, 0), field(i, 1), field(i, 2), 0};
  kernels::Row<Position> const zero = {origin[0], origin[1], origin[2], 0};
  auto const row = __builtin_convertvector(value - zero, kernels::Row<Real>);
  std::memcpy(to, &row, sizeof row);
}

/// The largest number of rows of four, without sign; what is not a number is passed over.
template <class Real>
class LargestOfRows {
public:
  KOKKOS_FORCEINLINE_FUNCTION void add(Real const* from) {
    kernels::Row<Real> row;
    std::memcpy(&row, from, sizeof row);
    most_ = row > most_ ? row : most_;
    least_ = row < least_ ? row : least_;
  }
  KOKKOS_FORCEINLINE_FUNCTION Real get() const {
    Real largest = 0;
    for (int c = 0; c < 4; ++c) largest = Kokkos::max(largest, Kokkos::max(most_[c], -least_[c]));
    return largest;
  }

private:
  kernels::Row<Real> most_ = {}, least_ = {};
};

#else

template <class Real, class Field, class Position>
KOKKOS_FORCEINLINE_FUNCTION void store_relative(Field const& field, int i,
                                                Position const (&origin)[3], Real* to) {
  for (int c = 0; c < 3; ++c) to[c] = static_cast<Real>(field(i, c) - origin[c]);
  to[3] = 0;
}

template <class Real>
class LargestOfRows {
public:
  KOKKOS_FORCEINLINE_FUNCTION void add(Real const* row) {
    for (int c = 0; c < 3; ++c) largest_ = max(largest_, abs(row[c]));
  }
  KOKKOS_FORCEINLINE_FUNCTION Real get() const { return largest_; }

private:
  Real largest_ = 0;
};

#endif

}  // namespace taut

// Rows of four numbers in memory, one row per lane of a pack: what a host kernel reads from and
// adds to the vertices of its elements. Four loads of a row and a transposition in registers cost
// a third of what gathering twelve single numbers costs.
#pragma once

#include <taut/core/math/scalar.hpp>

#include <bit>
#include <cstring>
#include <utility>

namespace taut {

#if defined(__GNUC__) && !defined(__CUDACC__)

namespace kernels {

/// A register of W numbers as the compiler's vectors, seen as W / 4 quads.
template <class Real, int W>
struct Quads {
  static constexpr bool wide = sizeof(Real) == 8;
  typedef Real Vector __attribute__((vector_size(W * sizeof(Real))));
  typedef Real Quad __attribute__((vector_size(4 * sizeof(Real))));
  union Split {
    Vector vector;
    Quad quad[W / 4];
  };

  template <bool high, int... k>
  static Vector interleave(Vector a, Vector b, std::integer_sequence<int, k...>) {
    // Per quad: a0 b0 a2 b2, or a1 b1 a3 b3 where halves of a quad are as wide as what an
    // instruction interleaves; else a0 b0 a1 b1, or a2 b2 a3 b3.
    if constexpr (wide) {
      return __builtin_shufflevector(a, b, (k / 2 * 2 + high + k % 2 * W)...);
    } else {
      return __builtin_shufflevector(a, b, (k / 4 * 4 + 2 * high + k % 4 / 2 + k % 2 * W)...);
    }
  }
  template <bool high, int... k>
  static Vector join(Vector a, Vector b, std::integer_sequence<int, k...>) {
    // Per quad: a0 a1 b0 b1, or a2 a3 b2 b3.
    return __builtin_shufflevector(a, b, (k / 4 * 4 + 2 * high + k % 2 + k % 4 / 2 * W)...);
  }
  /// `row` numbers from from[scale begin[j row]...] after those of j - 1: whole rows of 4 or 8.
  template <int row, int scale, class Index>
  static Vector load(Real const* from, Index const* begin) {
    if constexpr (W == row) {
      Vector v;
      std::memcpy(&v, from + scale * std::size_t(*begin), sizeof v);
      return v;
    } else {
      using Half = Quads<Real, W / 2>;
      return concatenate(Half::template load<row, scale>(from, begin),
                         Half::template load<row, scale>(from, begin + W / 2),
                         std::make_integer_sequence<int, W>());
    }
  }
  /// Quads `which`, 2 + `which` and so on of two registers, by turns.
  template <int which, int... k>
  static Vector every_other(Vector a, Vector b, std::integer_sequence<int, k...>) {
    return __builtin_shufflevector(a, b, (k / 8 * 8 + 4 * which + k % 4 + k % 8 / 4 * W)...);
  }
  template <class Half, int... k>
  static Vector concatenate(Half a, Half b, std::integer_sequence<int, k...>) {
    return __builtin_shufflevector(a, b, k...);
  }
  /// The transpose of each 4 x 4 block: quad j of v[i] is its row i. The last two may be zero.
  template <bool half = false>
  static void transpose(Vector (&v)[4]) {
    constexpr std::make_integer_sequence<int, W> lanes;
    Vector const a = interleave<false>(v[0], v[1], lanes), b = interleave<true>(v[0], v[1], lanes);
    Vector const c = half ? v[2] : interleave<false>(v[2], v[3], lanes);
    Vector const d = half ? v[3] : interleave<true>(v[2], v[3], lanes);
    v[0] = join<false>(a, c, lanes);
    v[wide ? 2 : 1] = join<true>(a, c, lanes);
    v[wide ? 1 : 2] = join<false>(b, d, lanes);
    v[3] = join<true>(b, d, lanes);
  }
};

/// Whether T is a register that the compiler's vectors can hold.
template <class T>
inline constexpr bool has_quads = [] {
  if constexpr (ScalarTraits<T>::lanes % 4 == 0) {
    return sizeof(T) == ScalarTraits<T>::lanes * sizeof(ValueType<T>);
  } else {
    return false;
  }
}();

template <class T>
using QuadsOf = Quads<ValueType<T>, ScalarTraits<T>::lanes>;

}  // namespace kernels

#else

namespace kernels {
template <class T>
inline constexpr bool has_quads = false;
}

#endif

/// to[c] = number c of the row from[scale begin[lane]...] in every lane, c < 3.
template <int scale = 1, class T, class Index>
KOKKOS_FORCEINLINE_FUNCTION void load_rows(ValueType<T> const* from, Index const* begin,
                                           T (&to)[3]) {
  if constexpr (kernels::has_quads<T>) {
#if defined(__GNUC__) && !defined(__CUDACC__)
    using Registers = kernels::QuadsOf<T>;
    typename Registers::Vector v[4];
    for (int i = 0; i < 4; ++i) {
      v[i] = Registers::template load<4, scale>(from, begin + i);
    }
    Registers::transpose(v);
    for (int c = 0; c < 3; ++c) to[c] = std::bit_cast<T>(v[c]);
#endif
  } else if constexpr (is_pack<T>) {
    for (int c = 0; c < 3; ++c) {
      to[c] = T([&](std::size_t lane) { return from[scale * begin[lane] + c]; });
    }
  } else {
    for (int c = 0; c < 3; ++c) to[c] = from[scale * *begin + c];
  }
}

namespace kernels {

/// Adds rows of up to four numbers.
template <int numbers, int scale, class T, class Index>
KOKKOS_FORCEINLINE_FUNCTION void add_quads(T const* row, ValueType<T>* to, Index const* begin) {
  constexpr int lanes = ScalarTraits<T>::lanes;
  if constexpr (has_quads<T>) {
#if defined(__GNUC__) && !defined(__CUDACC__)
    using Registers = QuadsOf<T>;
    typename Registers::Vector v[4] = {};
    for (int c = 0; c < numbers; ++c) {
      v[c] = std::bit_cast<typename Registers::Vector>(row[c]);
    }
    Registers::template transpose<(numbers <= 2)>(v);
    for (int lane = 0; lane < lanes; ++lane) {
      typename Registers::Split rows{v[lane % 4]};
      typename Registers::Quad sum;
      ValueType<T>* const at = to + scale * std::size_t(begin[lane]);
      std::memcpy(&sum, at, sizeof sum);
      sum += rows.quad[lane / 4];
      std::memcpy(at, &sum, sizeof sum);
    }
#endif
  } else {
    for (int i = 0; i < lanes; ++i)
      for (int c = 0; c < numbers; ++c) to[scale * begin[i] + c] += lane(row[c], i);
  }
}

#if defined(__GNUC__) && !defined(__CUDACC__)
/// Adds rows of five to eight numbers, eight at a time: half the loads and stores of two quads.
template <int numbers, int scale, class T, class Index>
KOKKOS_FORCEINLINE_FUNCTION void add_octets(T const* row, ValueType<T>* to, Index const* begin) {
  using Registers = QuadsOf<T>;
  using Vector = typename Registers::Vector;
  using Octet = typename Quads<ValueType<T>, 8>::Vector;
  constexpr int lanes = ScalarTraits<T>::lanes;
  Vector a[4], b[4] = {};
  for (int c = 0; c < 4; ++c) a[c] = std::bit_cast<Vector>(row[c]);
  for (int c = 4; c < numbers; ++c) b[c - 4] = std::bit_cast<Vector>(row[c]);
  Registers::transpose(a);
  Registers::template transpose<(numbers <= 6)>(b);
  auto const add = [&]<int quad>(std::integral_constant<int, quad>) __attribute__((always_inline)) {
    for (int j = 0; j < 4; ++j) {
      constexpr int q = 4 * quad, r = lanes + q;
      Octet const more =
          __builtin_shufflevector(a[j], b[j], q, q + 1, q + 2, q + 3, r, r + 1, r + 2, r + 3);
      Octet sum;
      ValueType<T>* const at = to + scale * std::size_t(begin[q + j]);
      std::memcpy(&sum, at, sizeof sum);
      sum += more;
      std::memcpy(at, &sum, sizeof sum);
    }
  };
  [&]<int... quad>(std::integer_sequence<int, quad...>) __attribute__((always_inline)) {
    (add(std::integral_constant<int, quad>()), ...);
  }
  (std::make_integer_sequence<int, lanes / 4>());
}
#endif

}  // namespace kernels

/// Adds the lanes of `numbers` packs to the rows to[scale begin[lane]...], each `numbers` long and
/// padded to a multiple of four, in the order of the lanes.
template <int numbers, int scale, class T, class Index>
KOKKOS_FORCEINLINE_FUNCTION void add_rows(T const* row, ValueType<T>* to, Index const* begin) {
#if defined(__GNUC__) && !defined(__CUDACC__)
  if constexpr (numbers > 4 && kernels::has_quads<T> && ScalarTraits<T>::lanes >= 8) {
    kernels::add_octets<Kokkos::min(numbers, 8), scale>(row, to, begin);
    if constexpr (numbers > 8) add_rows<numbers - 8, scale>(row + 8, to + 8, begin);
    return;
  }
#endif
  kernels::add_quads<Kokkos::min(numbers, 4), scale>(row, to, begin);
  if constexpr (numbers > 4) add_rows<numbers - 4, scale>(row + 4, to + 4, begin);
}

}  // namespace taut

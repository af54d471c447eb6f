// Natural logarithm for scalars and packs. Kokkos takes the logarithm of a pack one lane after the
// other; here all lanes go through the same arithmetic:
//
//   x = 2^k (1 + f),  1 + f in [1/sqrt 2, sqrt 2),   s = f / (2 + f),
//   ln(1 + f) = 2 artanh s = f - s (f - 2 (s^3/3 + s^5/5 + ...) / s)
//
// whose last form has f, known exactly, as its leading term. Errors stay below 1.1 units in the
// last place.
#pragma once

#include <taut/core/math/scalar.hpp>

#include <bit>
#include <type_traits>

namespace taut {
namespace kernels {

template <class Real>
struct FloatFormat;

template <>
struct FloatFormat<float> {
  using Bits = std::uint32_t;
  static constexpr int mantissa_bits = 23, bias = 127;
  static constexpr Bits sqrt_half = 0x3f3504f3;  ///< of 1/sqrt 2
  static constexpr int terms = 4;                ///< of the series; the next is 2e-9 of the sum
  static constexpr float ln2_head = 0x1.62e4p-1f, ln2_tail = 0x1.7f7d1cp-20f;
};

template <>
struct FloatFormat<double> {
  using Bits = std::uint64_t;
  static constexpr int mantissa_bits = 52, bias = 1023;
  static constexpr Bits sqrt_half = 0x3fe6a09e667f3bcd;
  static constexpr int terms = 9;  ///< the next is 2e-17 of the sum
  static constexpr double ln2_head = 0x1.62e42feep-1, ln2_tail = 0x1.a39ef35793c76p-33;
};

/// Splits a normal positive number, x = 2^exponent mantissa, given and returned as bits. `Bits` may
/// be a register of unsigned integers; shifts to the right are logical.
template <class Real, class Bits>
struct SplitBits {
  Bits mantissa;
  Bits exponent;  ///< of exponent + exponent_offset
};
template <class Real>
inline constexpr Real exponent_offset = static_cast<Real>((typename FloatFormat<Real>::Bits(1)
                                                           << FloatFormat<Real>::mantissa_bits) +
                                                          FloatFormat<Real>::bias);

template <class Real, class Bits>
KOKKOS_FORCEINLINE_FUNCTION SplitBits<Real, Bits> split_exponent(Bits const& x) {
  using Format = FloatFormat<Real>;
  using Word = typename Format::Bits;
  constexpr Word one = static_cast<Word>(Format::bias) << Format::mantissa_bits;
  constexpr Word mask = (Word(1) << Format::mantissa_bits) - 1;
  // Below 2^(mantissa_bits + 1), the bits of 2^mantissa_bits + k are those of 2^mantissa_bits, plus
  // k.
  constexpr Word integers = static_cast<Word>(Format::bias + Format::mantissa_bits)
                            << Format::mantissa_bits;
  Bits const shifted = x + (one - Format::sqrt_half);
  return {(shifted & mask) + Format::sqrt_half, (shifted >> Format::mantissa_bits) | integers};
}

/// The same for the lanes of a pack: mantissas, and exponents as numbers.
template <class T>
KOKKOS_FORCEINLINE_FUNCTION void split_exponents(T const& x, T& mantissa, T& exponent) {
  using Real = ValueType<T>;
  using Word = typename FloatFormat<Real>::Bits;
  constexpr int lanes = ScalarTraits<T>::lanes;
#if defined(__GNUC__) && !defined(__CUDACC__)
  if constexpr (sizeof(T) == lanes * sizeof(Real) && std::is_trivially_copyable_v<T>) {
    // In registers: through memory, the compiler would take the logarithm of one number twice.
    typedef Word Register __attribute__((vector_size(sizeof(T))));
    auto const split = split_exponent<Real>(std::bit_cast<Register>(x));
    mantissa = std::bit_cast<T>(split.mantissa);
    exponent = std::bit_cast<T>(split.exponent) - T(exponent_offset<Real>);
    return;
  }
#endif
  Real m[lanes], e[lanes];
  for (int i = 0; i < lanes; ++i) {
    auto const split = split_exponent<Real>(Kokkos::bit_cast<Word>(lane(x, i)));
    m[i] = Kokkos::bit_cast<Real>(split.mantissa);
    e[i] = Kokkos::bit_cast<Real>(split.exponent) - exponent_offset<Real>;
  }
  mantissa = load<T>(m);
  exponent = load<T>(e);
}

}  // namespace kernels

template <class T>
requires std::is_floating_point_v<T> KOKKOS_FORCEINLINE_FUNCTION T log(T const& x) {
  return Kokkos::log(x);
}
template <class T>
requires std::is_floating_point_v<T> KOKKOS_FORCEINLINE_FUNCTION T log1p(T const& x) {
  return Kokkos::log1p(x);
}

/// ln x of each lane; -infinity at zero, NaN below, infinity and NaN as they are.
template <class Real, class Abi>
requires std::is_floating_point_v<Real> KOKKOS_FORCEINLINE_FUNCTION
    Kokkos::Experimental::basic_simd<Real, Abi>
    log(Kokkos::Experimental::basic_simd<Real, Abi> const& x) {
  using T = Kokkos::Experimental::basic_simd<Real, Abi>;
  using Format = kernels::FloatFormat<Real>;
  constexpr Real infinity = Kokkos::Experimental::infinity_v<Real>;
  constexpr Real nan = Kokkos::Experimental::quiet_NaN_v<Real>;
  // Subnormal numbers are scaled up first.
  constexpr Real two_to_mantissa =
      static_cast<Real>(typename Format::Bits(1) << Format::mantissa_bits);
  auto const subnormal = x < T(Kokkos::Experimental::norm_min_v<Real>);

  T mantissa, exponent;
  kernels::split_exponents(select(subnormal, x * T(two_to_mantissa), x), mantissa, exponent);
  T const f = mantissa - T(1);
  T const k = exponent - select(subnormal, T(Real(Format::mantissa_bits)), T(0));

  T const s = f / (T(2) + f), z = s * s;
  T series(Real(1) / (2 * Format::terms + 1));
  for (int n = Format::terms - 1; n > 0; --n) series = T(Real(1) / (2 * n + 1)) + z * series;
  T const log_1f = f - (s * (f - T(2) * z * series) - k * T(Format::ln2_tail));
  T const result = k * T(Format::ln2_head) + log_1f;
  T const extended = select(x < T(infinity), result, x);
  return select(x > T(0), extended, select(x < T(0), T(nan), x * T(0) - T(infinity)));
}

/// ln(1 + x) of each lane, accurate relative to x also for small x: the rounding error of 1 + x is
/// put back to first order.
template <class Real, class Abi>
requires std::is_floating_point_v<Real> KOKKOS_FORCEINLINE_FUNCTION
    Kokkos::Experimental::basic_simd<Real, Abi>
    log1p(Kokkos::Experimental::basic_simd<Real, Abi> const& x) {
  using T = Kokkos::Experimental::basic_simd<Real, Abi>;
  T const sum = T(1) + x;
  T const lost = (x - (sum - T(1))) / sum;
  // At x = -1 and infinity, `lost` is NaN.
  return log(sum) + select(abs(lost) < T(1), lost, T(0));
}

}  // namespace taut

// Natural logarithm for scalars and packs. Kokkos takes the logarithm of a pack one lane after the
// other; here all lanes go through the same arithmetic:
//
//   x = 2^k (1 + f),  1 + f in [1/sqrt 2, sqrt 2),   s = f / (2 + f),
//   ln(1 + f) = 2 artanh s = f - s (f - 2 (s^3/3 + s^5/5 + ...) / s)
//
// whose last form has f, known exactly, as its leading term. Errors stay below 1.1 units in the
// last place. What is close to one, as the volume ratio of an element nearly always is, is not
// split: k = 0. What a lane gives does not depend on the others.
#pragma once

#include <taut/core/math/scalar.hpp>

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

/// Splits normal positive numbers, count after count: x = 2^exponent mantissa. The integers stay
/// unsigned, with shifts to the right that are logical, for the loop over lanes to vectorise.
template <int count, class Real>
KOKKOS_FORCEINLINE_FUNCTION void split_exponents(Real const* x, Real* mantissa, Real* exponent) {
  using Format = FloatFormat<Real>;
  using Bits = typename Format::Bits;
  constexpr Bits one = static_cast<Bits>(Format::bias) << Format::mantissa_bits;
  constexpr Bits mask = (Bits(1) << Format::mantissa_bits) - 1;
  // Below 2^(mantissa_bits + 1), the bits of 2^mantissa_bits + k are those of 2^mantissa_bits, plus
  // k.
  constexpr Bits integers = static_cast<Bits>(Format::bias + Format::mantissa_bits)
                            << Format::mantissa_bits;
  constexpr Real offset = static_cast<Real>((Bits(1) << Format::mantissa_bits) + Format::bias);
  for (int i = 0; i < count; ++i) {
    Bits const shifted = Kokkos::bit_cast<Bits>(x[i]) + (one - Format::sqrt_half);
    exponent[i] =
        Kokkos::bit_cast<Real>(static_cast<Bits>((shifted >> Format::mantissa_bits) | integers)) -
        offset;
    mantissa[i] = Kokkos::bit_cast<Real>(static_cast<Bits>((shifted & mask) + Format::sqrt_half));
  }
}

/// ln(1 + f) for |s| <= largest_quotient, where s = f / (2 + f), as f less the second number.
template <class T>
KOKKOS_FORCEINLINE_FUNCTION T log_deficit(T const& f, T const& s) {
  using Real = ValueType<T>;
  constexpr int terms = FloatFormat<Real>::terms;
  T const z = s * s;
  T series(Real(1) / (2 * terms + 1));
  for (int n = terms - 1; n > 0; --n) series = T(Real(1) / (2 * n + 1)) + z * series;
  return s * (f - T(2) * z * series);
}
/// (sqrt 2 - 1)^2: of 1 + f = sqrt 2, and with the other sign of 1/sqrt 2.
inline constexpr double largest_quotient = 0.1715728752538099;

/// ln x of each lane, of any size.
template <class T>
KOKKOS_FORCEINLINE_FUNCTION T log_split(T const& x) {
  using Real = ValueType<T>;
  using Format = FloatFormat<Real>;
  constexpr int lanes = ScalarTraits<T>::lanes;
  constexpr Real infinity = Kokkos::Experimental::infinity_v<Real>;
  constexpr Real nan = Kokkos::Experimental::quiet_NaN_v<Real>;
  // Subnormal numbers are scaled up first.
  constexpr Real two_to_mantissa =
      static_cast<Real>(typename Format::Bits(1) << Format::mantissa_bits);
  auto const subnormal = x < T(Kokkos::Experimental::norm_min_v<Real>);

  Real in[lanes], mantissa[lanes], exponent[lanes];
  store(select(subnormal, x * T(two_to_mantissa), x), in);
  split_exponents<lanes>(in, mantissa, exponent);
  T const f = load<T>(mantissa) - T(1);
  T const k = load<T>(exponent) - select(subnormal, T(Real(Format::mantissa_bits)), T(0));

  T const log_1f = f - (log_deficit(f, T(f / (T(2) + f))) - k * T(Format::ln2_tail));
  T const result = k * T(Format::ln2_head) + log_1f;
  T const extended = select(x < T(infinity), result, x);
  return select(x > T(0), extended, select(x < T(0), T(nan), x * T(0) - T(infinity)));
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
  T const f = x - T(1), s = f / (T(2) + f);
  T result = f - kernels::log_deficit(f, s);
  auto const far = !(abs(s) <= T(Real(kernels::largest_quotient)));
  if (any_lane(far)) result = select(far, kernels::log_split(x), result);
  return result;
}

/// ln(1 + x) of each lane, accurate relative to x also for small x: the rounding error of 1 + x is
/// put back to first order where that sum is taken at all.
template <class Real, class Abi>
requires std::is_floating_point_v<Real> KOKKOS_FORCEINLINE_FUNCTION
    Kokkos::Experimental::basic_simd<Real, Abi>
    log1p(Kokkos::Experimental::basic_simd<Real, Abi> const& x) {
  using T = Kokkos::Experimental::basic_simd<Real, Abi>;
  T const s = x / (T(2) + x);
  T result = x - kernels::log_deficit(x, s);
  auto const far = !(abs(s) <= T(Real(kernels::largest_quotient)));
  if (any_lane(far)) {
    T const sum = T(1) + x, lost = (x - (sum - T(1))) / sum;
    // At x = -1 and infinity, `lost` is NaN.
    result = select(far, kernels::log_split(sum) + select(abs(lost) < T(1), lost, T(0)), result);
  }
  return result;
}

}  // namespace taut

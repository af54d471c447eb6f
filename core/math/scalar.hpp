// The scalar vocabulary of the kernels: one function name for a float, a double and a SIMD pack of
// them, so that a kernel is written once as straight-line arithmetic and instantiated with a pack
// of elements per register on the host and with a plain scalar per thread on the device.
//
// Packs are Kokkos' SIMD types; nothing here adds a SIMD layer of its own. What is added is a
// branch that works lane by lane (`select`) and the elementary functions that Kokkos evaluates one
// lane at a time (min, max, log).
#pragma once

#include <Kokkos_Core.hpp>
#include <Kokkos_SIMD.hpp>

#include <bit>
#include <cstdint>
#include <type_traits>

namespace taut {

template <class T>
struct ScalarTraits {
  using value_type = T;
  static constexpr int lanes = 1;
};

template <class T, class Abi>
struct ScalarTraits<Kokkos::Experimental::basic_simd<T, Abi>> {
  using value_type = T;
  static constexpr int lanes = static_cast<int>(Kokkos::Experimental::basic_simd<T, Abi>::size());
};

/// float or double behind a scalar or a pack.
template <class T>
using ValueType = typename ScalarTraits<T>::value_type;

template <class T>
inline constexpr bool is_pack = !std::is_arithmetic_v<T>;

/// Lanes of `Real` in one register of the host (1 where Kokkos knows no SIMD for it).
template <class Real>
inline constexpr int host_lanes = [] {
  constexpr auto doubles = Kokkos::Experimental::basic_simd<
      double,
      Kokkos::Experimental::simd_abi::Impl::native_fixed_abi<double, Kokkos::Serial>>::size();
  return doubles == 1 ? 1 : static_cast<int>(doubles * sizeof(double) / sizeof(Real));
}();

template <class Real, int lanes>
struct PackOf {
  using type = Kokkos::Experimental::basic_simd<
      Real, Kokkos::Experimental::simd_abi::Impl::native_abi<lanes, Kokkos::Serial>>;
};
template <class Real>
struct PackOf<Real, 1> {
  using type = Real;
};

/// The pack of `Real` that fills one register of the host.
template <class Real>
using HostPack = typename PackOf<Real, host_lanes<Real>>::type;

template <class T>
requires std::is_arithmetic_v<T> KOKKOS_FORCEINLINE_FUNCTION T select(bool mask, T a, T b) {
  return mask ? a : b;
}

template <class T, class Abi>
KOKKOS_FORCEINLINE_FUNCTION Kokkos::Experimental::basic_simd<T, Abi> select(
    Kokkos::Experimental::basic_simd_mask<T, Abi> const& mask,
    Kokkos::Experimental::basic_simd<T, Abi> const& a,
    Kokkos::Experimental::basic_simd<T, Abi> const& b) {
  return Kokkos::Experimental::condition(mask, a, b);
}

/// The smaller; a where either is not a number.
template <class T>
KOKKOS_FORCEINLINE_FUNCTION T min(T const& a, T const& b) {
#if defined(__AVX2__) && !defined(__CUDACC__)
  // One instruction, which yields its second operand where one is not a number.
  if constexpr (is_pack<T>) return Kokkos::min(b, a);
#endif
  return select(b < a, b, a);
}

/// The larger; a where either is not a number.
template <class T>
KOKKOS_FORCEINLINE_FUNCTION T max(T const& a, T const& b) {
#if defined(__AVX2__) && !defined(__CUDACC__)
  if constexpr (is_pack<T>) return Kokkos::max(b, a);
#endif
  return select(a < b, b, a);
}

template <class T>
KOKKOS_FORCEINLINE_FUNCTION T square(T const& a) {
  return a * a;
}

// Templates instead of `using Kokkos::sqrt`: that would be ambiguous with ::sqrt for whoever writes
// `using namespace taut`.
template <class T>
KOKKOS_FORCEINLINE_FUNCTION T abs(T const& a) {
  return Kokkos::abs(a);
}

template <class T>
KOKKOS_FORCEINLINE_FUNCTION T sqrt(T const& a) {
  return Kokkos::sqrt(a);
}

/// Lane `i` of a pack; a scalar has one lane.
template <class T>
KOKKOS_FORCEINLINE_FUNCTION ValueType<T> lane(T const& a, int i) {
  if constexpr (is_pack<T>) {
    return a[static_cast<std::size_t>(i)];
  } else {
    (void)i;
    return a;
  }
}

/// Loads lanes from consecutive memory.
template <class T>
KOKKOS_FORCEINLINE_FUNCTION T load(ValueType<T> const* from) {
  if constexpr (is_pack<T>) {
    T r;
    r.copy_from(from, Kokkos::Experimental::simd_flag_default);
    return r;
  } else {
    return *from;
  }
}

/// Stores lanes to consecutive memory.
template <class T>
KOKKOS_FORCEINLINE_FUNCTION void store(T const& a, ValueType<T>* to) {
  if constexpr (is_pack<T>) {
    a.copy_to(to, Kokkos::Experimental::simd_flag_default);
  } else {
    *to = a;
  }
}

/// The same, as numbers of another kind.
template <class T, class To>
KOKKOS_FORCEINLINE_FUNCTION void store_as(T const& a, To* to) {
  if constexpr (std::is_same_v<ValueType<T>, To>) {
    store(a, to);
  } else {
    constexpr int lanes = ScalarTraits<T>::lanes;
    ValueType<T> value[lanes];
    store(a, value);
    for (int i = 0; i < lanes; ++i) to[i] = static_cast<To>(value[i]);
  }
}

/// Collects lane i from `from[index[i]]`.
template <class T, class Index>
KOKKOS_FORCEINLINE_FUNCTION T gather(ValueType<T> const* from, Index const* index) {
  if constexpr (is_pack<T>) {
    return T([&](std::size_t i) { return from[index[i]]; });
  } else {
    return from[*index];
  }
}

/// Sum over the lanes in fp64: the first half of them to the second, and so on.
template <class T>
KOKKOS_FORCEINLINE_FUNCTION double sum_lanes(T const& a) {
  constexpr int lanes = ScalarTraits<T>::lanes;
  ValueType<T> value[lanes];
  store(a, value);
  double sum[lanes];
  for (int i = 0; i < lanes; ++i) sum[i] = static_cast<double>(value[i]);
  for (int half = lanes / 2; half > 0; half /= 2)
    for (int i = 0; i < half; ++i) sum[i] += sum[i + half];
  return sum[0];
}

/// Whether a mask holds in any lane.
template <class T, class Abi>
KOKKOS_FORCEINLINE_FUNCTION bool any_lane(
    Kokkos::Experimental::basic_simd_mask<T, Abi> const& mask) {
  // One instruction, where Kokkos asks lane after lane.
#if defined(KOKKOS_ARCH_AVX512XEON) && !defined(__CUDACC__)
  if constexpr (requires { static_cast<__mmask16>(mask); }) {
    return static_cast<__mmask16>(mask) != 0;
  } else if constexpr (requires { static_cast<__mmask8>(mask); }) {
    return static_cast<__mmask8>(mask) != 0;
  }
#endif
#if defined(KOKKOS_ARCH_AVX2) && !defined(__CUDACC__)
  if constexpr (requires { static_cast<__m256>(mask); }) {
    return _mm256_movemask_ps(static_cast<__m256>(mask)) != 0;
  } else if constexpr (requires { static_cast<__m256d>(mask); }) {
    return _mm256_movemask_pd(static_cast<__m256d>(mask)) != 0;
  }
#endif
  return Kokkos::Experimental::any_of(mask);
}
KOKKOS_FORCEINLINE_FUNCTION bool any_lane(bool mask) { return mask; }

/// Largest lane.
template <class T>
KOKKOS_FORCEINLINE_FUNCTION ValueType<T> max_lanes(T const& a) {
  constexpr int lanes = ScalarTraits<T>::lanes;
  ValueType<T> value[lanes];
  store(a, value);
  for (int i = 1; i < lanes; ++i) value[0] = Kokkos::max(value[0], value[i]);
  return value[0];
}

/// Smallest lane.
template <class T>
KOKKOS_FORCEINLINE_FUNCTION ValueType<T> min_lanes(T const& a) {
  constexpr int lanes = ScalarTraits<T>::lanes;
  ValueType<T> value[lanes];
  store(a, value);
  for (int i = 1; i < lanes; ++i) value[0] = Kokkos::min(value[0], value[i]);
  return value[0];
}

}  // namespace taut

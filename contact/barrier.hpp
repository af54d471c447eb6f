// Barriers: energies of a distance d that vanish from an activation distance D on and push apart
// below it. Every barrier is a shape g of the ratio x = d / D,
//
//   b(d) = D^2 g(x),   b' = D g'(x),   b'' = g''(x),   g(1) = g'(1) = g''(1) = 0,
//
// so b is in m^2 and a stiffness K in N/m makes K b an energy. A new barrier is a new g.
// `Normalised` scales it to b''(D/2) = 1: then K is the curvature of a half-closed contact,
// whatever the barrier.
//
// Near x = 1 everything is a power of the room 1 - x, and line searches add up changes of energy:
// both are handed to the shapes to full relative accuracy, so that no shape has to subtract. All
// are good to some ten units in the last place for x from 1e-6 to 1, in fp32 too.
#pragma once

#include <taut/core/math/logarithm.hpp>

#include <concepts>

namespace taut {

/// x = d / D in (0, 1), and what cannot be recovered from a rounded x.
template <class T>
struct RelativeDistance {
  T x;
  T room;  ///< 1 - x
  T log;   ///< ln x
};

/// The change between two relative distances, after - before.
template <class T>
struct RelativeStep {
  T x;
  T log;
};

/// The shape of a barrier: g and its derivatives in x, and g(after) - g(before) without
/// cancellation. Most have no state, and these functions are static.
template <class B>
concept Barrier = requires(B const& b, RelativeDistance<double> const& s,
                           RelativeStep<double> const& step) {
  { B::name } -> std::convertible_to<char const*>;
  { B::curvature_at_half } -> std::convertible_to<double>;  // g''(1/2)
  { b.value(s) } -> std::same_as<double>;
  { b.slope(s) } -> std::same_as<double>;
  { b.curvature(s) } -> std::same_as<double>;
  { b.change(s, s, step) } -> std::same_as<double>;  // before, after, step
};

namespace kernels {
inline constexpr double ln2 = 0.693147180559945309417232121458;
}

/// The logarithm of the unsquared distance, g = -(1 - x)^2 ln x (Shen et al. 2024, equation 2).
struct LogBarrier {
  static constexpr char const* name = "log";
  static constexpr double curvature_at_half = 5 + 2 * kernels::ln2;

  template <class T>
  KOKKOS_FORCEINLINE_FUNCTION static T value(RelativeDistance<T> const& s) {
    return -square(s.room) * s.log;
  }
  template <class T>
  KOKKOS_FORCEINLINE_FUNCTION static T slope(RelativeDistance<T> const& s) {
    return s.room * (T(2) * s.log - s.room / s.x);
  }
  template <class T>
  KOKKOS_FORCEINLINE_FUNCTION static T curvature(RelativeDistance<T> const& s) {
    T const r = s.room / s.x;
    return r * (T(4) + r) - T(2) * s.log;
  }
  template <class T>
  KOKKOS_FORCEINLINE_FUNCTION static T change(RelativeDistance<T> const& before,
                                              RelativeDistance<T> const& after,
                                              RelativeStep<T> const& step) {
    return step.x * (after.room + before.room) * before.log - square(after.room) * step.log;
  }
};

namespace kernels {
/// From x to z = x^2, with room 1 - z and logarithm ln z.
template <class T>
KOKKOS_FORCEINLINE_FUNCTION RelativeDistance<T> squared(RelativeDistance<T> const& s) {
  return {square(s.x), s.room * (T(1) + s.x), T(2) * s.log};
}
template <class T>
KOKKOS_FORCEINLINE_FUNCTION RelativeStep<T> squared(RelativeDistance<T> const& before,
                                                    RelativeDistance<T> const& after,
                                                    RelativeStep<T> const& step) {
  return {step.x * (after.x + before.x), T(2) * step.log};
}
}  // namespace kernels

/// The logarithm of the squared distance, g = -(1 - x^2)^2 ln x^2: the barrier of Incremental
/// Potential Contact (Li et al. 2020) as its code takes it, -(d^2 - D^2)^2 ln(d^2 / D^2), over D^2.
struct IpcBarrier {
  static constexpr char const* name = "ipc";
  static constexpr double curvature_at_half = 16.5 - 2 * kernels::ln2;

  template <class T>
  KOKKOS_FORCEINLINE_FUNCTION static T value(RelativeDistance<T> const& s) {
    return LogBarrier::value(kernels::squared(s));
  }
  template <class T>
  KOKKOS_FORCEINLINE_FUNCTION static T slope(RelativeDistance<T> const& s) {
    return T(2) * s.x * LogBarrier::slope(kernels::squared(s));
  }
  template <class T>
  KOKKOS_FORCEINLINE_FUNCTION static T curvature(RelativeDistance<T> const& s) {
    auto const z = kernels::squared(s);
    return T(4) * (T(1) - T(3) * z.x) * z.log + z.room * (T(16) + T(2) * z.room / z.x);
  }
  template <class T>
  KOKKOS_FORCEINLINE_FUNCTION static T change(RelativeDistance<T> const& before,
                                              RelativeDistance<T> const& after,
                                              RelativeStep<T> const& step) {
    return LogBarrier::change(kernels::squared(before), kernels::squared(after),
                              kernels::squared(before, after, step));
  }
};

/// The squared logarithm of the squared distance, g = (1 - x^2)^2 (ln x^2)^2 (Huang et al. 2024,
/// GIPC): flatter near D and wider at equal force.
struct LogSquaredBarrier {
  static constexpr char const* name = "log_squared";
  static constexpr double curvature_at_half =
      18 + 66 * kernels::ln2 - 4 * kernels::ln2 * kernels::ln2;

  template <class T>
  KOKKOS_FORCEINLINE_FUNCTION static T value(RelativeDistance<T> const& s) {
    auto const z = kernels::squared(s);
    return square(z.room * z.log);
  }
  template <class T>
  KOKKOS_FORCEINLINE_FUNCTION static T slope(RelativeDistance<T> const& s) {
    auto const z = kernels::squared(s);
    return T(4) * s.x * z.room * z.log * (z.room / z.x - z.log);
  }
  template <class T>
  KOKKOS_FORCEINLINE_FUNCTION static T curvature(RelativeDistance<T> const& s) {
    auto const z = kernels::squared(s);
    T const r = z.room / z.x;
    return z.log * ((T(12) * z.x - T(4)) * z.log - T(4) * z.room * (T(8) + r)) + T(8) * z.room * r;
  }
  template <class T>
  KOKKOS_FORCEINLINE_FUNCTION static T change(RelativeDistance<T> const& before,
                                              RelativeDistance<T> const& after,
                                              RelativeStep<T> const& step) {
    auto const z0 = kernels::squared(before), z1 = kernels::squared(after);
    auto const dz = kernels::squared(before, after, step);
    return (z1.room * dz.log - dz.x * z0.log) * (z1.room * z1.log + z0.room * z0.log);
  }
};

/// g = 2/3 (1 - x)^3 (Ando 2024): its curvature stays below 4. It is finite at contact, so only the
/// step bound and a stiffness that grows with the load keep things apart.
struct CubicBarrier {
  static constexpr char const* name = "cubic";
  static constexpr double curvature_at_half = 2;

  template <class T>
  KOKKOS_FORCEINLINE_FUNCTION static T value(RelativeDistance<T> const& s) {
    return T(2) / T(3) * s.room * square(s.room);
  }
  template <class T>
  KOKKOS_FORCEINLINE_FUNCTION static T slope(RelativeDistance<T> const& s) {
    return T(-2) * square(s.room);
  }
  template <class T>
  KOKKOS_FORCEINLINE_FUNCTION static T curvature(RelativeDistance<T> const& s) {
    return T(4) * s.room;
  }
  template <class T>
  KOKKOS_FORCEINLINE_FUNCTION static T change(RelativeDistance<T> const& before,
                                              RelativeDistance<T> const& after,
                                              RelativeStep<T> const& step) {
    return T(-2) / T(3) * step.x *
           (square(before.room) + before.room * after.room + square(after.room));
  }
};

/// A barrier scaled to b''(D/2) = 1.
template <Barrier B>
struct Normalised {
  static constexpr char const* name = B::name;
  static constexpr double curvature_at_half = 1;

  template <class T>
  KOKKOS_FORCEINLINE_FUNCTION static T value(RelativeDistance<T> const& s) {
    return factor<T>() * B::value(s);
  }
  template <class T>
  KOKKOS_FORCEINLINE_FUNCTION static T slope(RelativeDistance<T> const& s) {
    return factor<T>() * B::slope(s);
  }
  template <class T>
  KOKKOS_FORCEINLINE_FUNCTION static T curvature(RelativeDistance<T> const& s) {
    return factor<T>() * B::curvature(s);
  }
  template <class T>
  KOKKOS_FORCEINLINE_FUNCTION static T change(RelativeDistance<T> const& before,
                                              RelativeDistance<T> const& after,
                                              RelativeStep<T> const& step) {
    return factor<T>() * B::change(before, after, step);
  }

private:
  template <class T>
  KOKKOS_FORCEINLINE_FUNCTION static constexpr T factor() {
    return T(static_cast<ValueType<T>>(1 / B::curvature_at_half));
  }
};

/// b, b' and b'' at one distance.
template <class T>
struct BarrierValues {
  T value;      ///< m^2, >= 0
  T slope;      ///< m, <= 0
  T curvature;  ///< >= 0
};

namespace kernels {
template <class T>
KOKKOS_FORCEINLINE_FUNCTION RelativeDistance<T> relative_distance(T d, T activation) {
  T const x = d / activation, room = (activation - d) / activation;
  // Each logarithm where its argument is exact: activation - d has no error from D/2 on.
  if constexpr (is_pack<T>) {
    return {x, room, select(x < T(0.5), log(x), log1p(T(-room)))};
  } else {
    return {x, room, x < T(0.5) ? log(x) : log1p(-room)};
  }
}
}  // namespace kernels

/// At distance d >= 0, m. Zero from the activation distance on; at d = 0 the logarithms are
/// infinite, and their derivatives infinite or not a number.
template <Barrier B, class T>
KOKKOS_INLINE_FUNCTION BarrierValues<T> evaluate_barrier(B const& barrier, T d, T activation) {
  if constexpr (!is_pack<T>) {
    if (!(d < activation)) return {T(0), T(0), T(0)};
  }
  auto const s = kernels::relative_distance(d, activation);
  BarrierValues<T> r{square(activation) * barrier.value(s), activation * barrier.slope(s),
                     barrier.curvature(s)};
  if constexpr (is_pack<T>) {
    for (T* value : {&r.value, &r.slope, &r.curvature})
      *value = select(d < activation, *value, T(0));
  }
  return r;
}
template <Barrier B, class T>
KOKKOS_INLINE_FUNCTION BarrierValues<T> evaluate_barrier(T d, T activation) {
  return evaluate_barrier(B(), d, activation);
}

/// b(after) - b(before) with an error relative to itself. `step` is after - before, which the
/// caller knows better than the rounded distances do.
template <Barrier B, class T>
KOKKOS_INLINE_FUNCTION T barrier_change(B const& barrier, T before, T after, T step, T activation) {
  if constexpr (!is_pack<T>) {
    if (!(before < activation)) return evaluate_barrier(barrier, after, activation).value;
    if (!(after < activation)) return -evaluate_barrier(barrier, before, activation).value;
  }
  auto const from = kernels::relative_distance(before, activation);
  auto const to = kernels::relative_distance(after, activation);
  auto const opens = step > T(0);
  T const log_ratio = log1p(select(opens, T(step / before), T(-step / after)));
  T const change = barrier.change(
      from, to, RelativeStep<T>{step / activation, select(opens, log_ratio, T(-log_ratio))});
  if constexpr (is_pack<T>) {
    T const gained = select(after < activation, barrier.value(to), T(0));
    T const lost = select(after < activation, change, T(-barrier.value(from)));
    return square(activation) * select(before < activation, lost, gained);
  } else {
    return square(activation) * change;
  }
}
template <Barrier B, class T>
KOKKOS_INLINE_FUNCTION T barrier_change(T before, T after, T step, T activation) {
  return barrier_change(B(), before, after, step, activation);
}

}  // namespace taut

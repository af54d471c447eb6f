// How particles and grid nodes see each other: uniform B-splines, w_ip = N(x) N(y) N(z) of the
// distance in cells (Steffen, Kirby and Berzins 2008; Jiang et al. 2016, section 5).
//
//   linear      width 2, C0: gradients jump between cells; for comparison
//   quadratic   width 3, C1: the default
//   cubic       width 4, C2
//
// Along an axis, with x in cells, a particle sees the nodes base(x), ..., base(x) + width - 1. What
// the weights depend on is t = x - base(x) - start in [0, 1), which fits into any precision.
// Sum w = 1, Sum w' = 0 and Sum w x_i = x for all three.
#pragma once

#include <taut/core/math/matrix.hpp>

#include <concepts>

namespace taut {

struct LinearSpline {
  static constexpr char const* name = "linear";
  static constexpr int width = 2;
  static constexpr double start = 0;
  /// Sum w (x_i - x)^2 in cells^2, where it does not depend on x; 0: it does.
  static constexpr double inertia = 0;

  template <class T>
  KOKKOS_FORCEINLINE_FUNCTION static void weights(T const& t, T (&w)[2], T (&d)[2]) {
    w[0] = T(1) - t;
    w[1] = t;
    d[0] = T(-1);
    d[1] = T(1);
  }
};

struct QuadraticSpline {
  static constexpr char const* name = "quadratic";
  static constexpr int width = 3;
  static constexpr double start = 0.5;
  static constexpr double inertia = 1.0 / 4;

  template <class T>
  KOKKOS_FORCEINLINE_FUNCTION static void weights(T const& t, T (&w)[3], T (&d)[3]) {
    T const s = T(1) - t;
    w[0] = T(0.5) * s * s;
    w[1] = T(0.5) + t * s;
    w[2] = T(0.5) * t * t;
    d[0] = -s;
    d[1] = s - t;
    d[2] = t;
  }
};

struct CubicSpline {
  static constexpr char const* name = "cubic";
  static constexpr int width = 4;
  static constexpr double start = 1;
  static constexpr double inertia = 1.0 / 3;

  template <class T>
  KOKKOS_FORCEINLINE_FUNCTION static void weights(T const& t, T (&w)[4], T (&d)[4]) {
    T const s = T(1) - t, third(ValueType<T>(2.0 / 3)), sixth(ValueType<T>(1.0 / 6));
    w[0] = sixth * s * s * s;
    w[1] = third - t * t * (T(1) - T(0.5) * t);
    w[2] = third - s * s * (T(1) - T(0.5) * s);
    w[3] = sixth * t * t * t;
    d[0] = T(-0.5) * s * s;
    d[1] = t * (T(1.5) * t - T(2));
    d[2] = s * (T(2) - T(1.5) * s);
    d[3] = T(0.5) * t * t;
  }
};

/// `K` is one of those, or another partition of unity of compact support.
template <class K>
concept Spline = requires(double t, double (&w)[K::width], double (&d)[K::width]) {
  { K::name } -> std::convertible_to<char const*>;
  { K::start } -> std::convertible_to<double>;
  { K::inertia } -> std::convertible_to<double>;
  {K::weights(t, w, d)};
};

/// The lowest node that a particle at x (in cells) sees along an axis.
template <Spline K>
KOKKOS_FORCEINLINE_FUNCTION double base_node(double x) {
  return Kokkos::floor(x - K::start);
}

/// t of a particle at x (in cells) that was sorted into the cell of `base`. Kernels take it from
/// that cell instead of finding theirs: a device may round x otherwise in each of them, and where x
/// is on the border of two cells the weights of one would fall on the nodes of the other. So t may
/// be a round-off outside of [0, 1), which the weights do not mind.
template <Spline K>
KOKKOS_FORCEINLINE_FUNCTION double place_in_cell(double x, int base) {
  return (x - base) - K::start;
}

/// Weights and slopes (per cell) along the three axes.
template <Spline K, class T>
struct Weights {
  T w[3][K::width], d[3][K::width];

  /// From t along each axis.
  KOKKOS_FORCEINLINE_FUNCTION explicit Weights(Vec3<T> const& t) {
    for (int c = 0; c < 3; ++c) K::weights(t[c], w[c], d[c]);
  }
  KOKKOS_FORCEINLINE_FUNCTION T weight(int a, int b, int c) const {
    return w[0][a] * w[1][b] * w[2][c];
  }
  /// Per cell: to be divided by dx.
  KOKKOS_FORCEINLINE_FUNCTION Vec3<T> gradient(int a, int b, int c) const {
    return {d[0][a] * w[1][b] * w[2][c], w[0][a] * d[1][b] * w[2][c], w[0][a] * w[1][b] * d[2][c]};
  }
};

}  // namespace taut

// What a step bound proves, and what it must know of two bodies to prove it.
//
// Two convex bodies move along straight lines, corner i by a p_i with a in [0, alpha]. For any unit
// vector n whatever, the distance d(a) of the first from the second is at least
//
//   g_n(a) = min over corners i of the first and j of the second of  n . (x_i - x_j) + a n . (p_i -
//   p_j),
//
// the gap between their shadows on n: a minimum of affine functions, hence concave in a. Where it
// is large enough at both ends of an interval of a, it is so in between. A proof of this kind needs
// no accuracy of n: how n was found decides how long a step comes out, never whether it is safe.
// (The directional certificate of the PPF contact solver; conservative advancement, Mirtich 1996.)
//
// Round-off. Let u be the unit round-off of the kernel's scalar T and v that of the type P in which
// positions are stored. What is computed is a lower bound of the gap of the positions as they are
// stored, before the step and after it. What is charged, with all lengths relative to one corner of
// the pair, so that coordinates far from the origin cost only what storing them costs:
//
//   operation                                            error at most
//   a difference of stored positions or of displacements       u per component
//   a product with n and two sums                              3 u sum |n_c y_c|
//   the difference of two shadows, less what is charged        2 u (sum |n_c y_i,c| + sum |n_c
//   y_j,c|) |n| = 1 after normalising                                  5 u of the gap room = gap -
//   kept, room / slope                            1 u of each, 2 u of the quotient
//
// Six u of a shadow and six of the gap; `budget` = 16 u is charged for either. Where T is narrower
// than P, the difference is formed in P, and its rounding in P is v << u.
//   The stored end is x + a p, rounded: by v |x_c + a p_c| for the sum, v a |p_c| for the product,
// and v a |p_c| where alpha itself is rounded to P: at most v |x_c| + 4 v a |p_c| per component,
// for both sides together along n. Nothing where p_c = 0. For a very short step the sum is nearest
// to x + a p among numbers that x is one of, so the error is also at most (1 + 2 v) a |p_c|: then a
// bound is found even where the gap is below the spacing of the coordinates. The smallest normal
// number is charged on top, for products that underflow.
#pragma once

#include <taut/core/math/matrix.hpp>

#include <concepts>

namespace taut {

/// How much of a gap a step may use up, in metres. With g = distance - least, the distance stays
/// above least + (1 - share) min(g, ample).
struct Clearance {
  double share = 0.5;  ///< of the present gap, above 0 and below 1
  double least = 0;    ///< a distance never to go below (a thickness)
  double ample = Kokkos::Experimental::infinity_v<double>;  ///< gaps need not be kept above this

  /// By how much a pair at this distance may close; grows with the distance.
  template <class T>
  KOKKOS_INLINE_FUNCTION T usable(T distance) const {
    T const gap = distance - T(least);
    if (!(gap > T(0))) return T(0);
    return gap - (T(1) - T(share)) * min(gap, T(ample));
  }
};

/// Affine lower bounds at + a slope of a gap, the smallest of which counts.
template <class T, int n>
struct GapLines {
  T at[n], slope[n];
};

/// From certificates that cost no direction: the distance is at least `distance` now and falls by
/// at most `speed` per unit of a, and by `landing` once for storing the end of the step.
template <class T>
struct QuickGap {
  T distance, speed, landing;
};

/// Two bodies along a step: a pair of mesh features (`PairPath`), a vertex and an obstacle.
template <class P>
concept GapPath = requires(P const& path, Vec3<typename P::Scalar> const& n, typename P::Scalar a,
                           bool short_step) {
  typename P::Scalar;
  { path.at_rest() } -> std::same_as<bool>;
  /// The longest displacement of a corner, rounded up.
  { path.longest() } -> std::same_as<typename P::Scalar>;
  { path.quick() } -> std::same_as<QuickGap<typename P::Scalar>>;
  /// The unit vector from the second body to the first where they are closest at a; any other
  /// vector of length 1, or 0, is a poor one but no wrong one.
  { path.direction(a) } -> std::same_as<Vec3<typename P::Scalar>>;
  /// Lower bound of the gap along n as stored before the step.
  { path.separation(n) } -> std::same_as<typename P::Scalar>;
  /// Lower bounds of the gap along n, stored after a step of a; `short_step`: the other charge for
  /// storing, which vanishes with a.
  { path.along(n, short_step) } -> std::same_as<GapLines<typename P::Scalar, P::lines>>;
};

namespace kernels {

/// What is charged for round-off, relative to the numbers involved: 16 u.
template <class T>
inline constexpr T budget = 8 * Kokkos::Experimental::epsilon_v<T>;

/// The largest a for which all lines are certainly above `kept` on [from, a]; `from` where none is.
template <class T, int n>
KOKKOS_INLINE_FUNCTION T certified_until(GapLines<T, n> const& lines, T kept, T from) {
  T const target = kept * (T(1) + budget<T>);
  T last = Kokkos::Experimental::infinity_v<T>;
  for (int k = 0; k < n; ++k) {
    T const room = lines.at[k] - target;
    if (!(room + from * lines.slope[k] >= T(0))) return from;
    if (lines.slope[k] < T(0)) last = min(last, room / -lines.slope[k] * (T(1) - budget<T>));
  }
  return max(from, last);
}

}  // namespace kernels

}  // namespace taut

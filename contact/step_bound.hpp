// How far a step may go: policies that find, for two bodies along a path, the largest alpha in
// (0, at_most] for which the gap certainly stays above its clearance (gap_path.hpp), at every point
// of the path and where the step is stored after it.
//
//   AdditiveCcd      the default. Certificates first; then conservative advancement (Li et al.
//   2021,
//                    "Codimensional incremental potential contact", algorithm 1): from a time that
//                    is certified, find how much further is, and repeat. Theirs advances by gap
//                    over speed, with the mean velocity taken out; here by the gap along the
//                    direction of the closest points, which is never shorter and not throttled by
//                    sliding. It needs no mean: only differences of velocities enter.
//   PairwiseClosing  gap over the fastest closing of any two corners along that direction. Cheaper,
//                    shorter: turning and tumbling look like closing.
//   HalfDhatClamp    Shen et al. 2024: no vertex moves by more than dhat / 2. A baseline and NO
//                    guarantee: a pair that is closer than dhat already can cross.
//
// Bounds for each vertex by itself are in vertex_bound.hpp.
#pragma once

#include <taut/contact/gap_path.hpp>

namespace taut {

/// What settled how far a step may go.
enum class Settled : int {
  at_rest,    ///< nothing moves: all of it
  boxes,      ///< all of it, for the motion is shorter than what boxes leave to use, or than what
              ///< the distance where the pair was found leaves
  direction,  ///< all of it, by the shadows along the direction of the closest points
  advance,    ///< all of it, in several intervals
  cut,        ///< less than asked for
  uncertain,  ///< none of it: the gap is nil, or not above the round-off
  open        ///< by `certify` alone: not known yet
};
inline constexpr int settled_kinds = 6;  ///< those that a bound may return

template <class T>
struct Reach {
  T alpha;  ///< certified, also where it is rounded to the positions' scalar
  T kept;   ///< distance that is certified to be kept up to alpha, m; 0 at rest
  Settled settled;
};

/// A policy, on a path P. `certify` is the cheap part of `bound`: what it leaves open, `bound` may
/// decide, and at a higher price in a wider scalar. `by_gap`: it lets a pair go all the way if that
/// cannot use up more of the gap than the clearance allows.
template <class B, class P>
concept GapBound = GapPath<P> &&
    requires(B const& b, P const& path, Clearance const& clearance, typename P::Scalar at_most) {
  { B::by_gap } -> std::convertible_to<bool>;
  { b.certify(path, clearance, at_most) } -> std::same_as<Reach<typename P::Scalar>>;
  { b.bound(path, clearance, at_most) } -> std::same_as<Reach<typename P::Scalar>>;
};

namespace kernels {

/// What needs no direction: rest, and boxes that are further apart than the motion is long.
template <GapPath Path, class T = typename Path::Scalar>
KOKKOS_INLINE_FUNCTION Reach<T> certify_without_direction(Path const& path,
                                                          Clearance const& clearance, T at_most) {
  if (path.at_rest()) return {at_most, T(0), Settled::at_rest};
  QuickGap<T> const quick = path.quick();
  T const usable = clearance.usable(quick.distance);
  if (at_most * quick.speed + quick.landing <= usable * (T(1) - budget<T>)) {
    return {at_most, quick.distance - usable, Settled::boxes};
  }
  return {T(0), T(0), Settled::open};
}

/// `alpha` of what was asked for, once nothing more can be proved.
template <class T>
KOKKOS_INLINE_FUNCTION Reach<T> settle(T alpha, T kept, T at_most, Settled whole) {
  if (alpha >= at_most) return {at_most, kept, whole};
  return {alpha, kept, alpha > T(0) ? Settled::cut : Settled::uncertain};
}

}  // namespace kernels

struct AdditiveCcd {
  static constexpr bool by_gap = true;
  int iterations = 64;           ///< at most; what they have certified counts
  double tolerance = 1.0 / 256;  ///< ends where an iteration adds less than this share of alpha

  /// Rest, boxes, and one direction. Leaves open, with the alpha and the distance to keep that the
  /// direction gave, what needs more than one.
  template <GapPath Path, class T = typename Path::Scalar>
  KOKKOS_INLINE_FUNCTION Reach<T> certify(Path const& path, Clearance const& clearance,
                                          T at_most) const {
    Reach<T> const quick = kernels::certify_without_direction(path, clearance, at_most);
    if (quick.settled != Settled::open) return quick;
    Vec3<T> const n = path.direction(T(0));
    T const gap = path.separation(n);
    T const usable = clearance.usable(gap), kept = gap - usable;
    if (!(usable > T(0))) return {T(0), T(0), Settled::open};
    T alpha = kernels::certified_until(path.along(n, false), kept, T(0));
    if (alpha <= T(0)) alpha = kernels::certified_until(path.along(n, true), kept, T(0));
    if (alpha >= at_most) return {at_most, kept, Settled::direction};
    return {alpha, kept, Settled::open};
  }

  template <GapPath Path, class T = typename Path::Scalar>
  KOKKOS_INLINE_FUNCTION Reach<T> bound(Path const& path, Clearance const& clearance,
                                        T at_most) const {
    Reach<T> const known = certify(path, clearance, at_most);
    if (known.settled != Settled::open) return known;
    T alpha = known.alpha;
    for (int k = 0; k < iterations && alpha > T(0) && alpha < at_most; ++k) {
      T const next =
          kernels::certified_until(path.along(path.direction(alpha), false), known.kept, alpha);
      bool const arrived = !(next - alpha > T(tolerance) * next);
      alpha = next;
      if (arrived) break;
    }
    return kernels::settle(alpha, known.kept, at_most, Settled::advance);
  }
};

struct PairwiseClosing {
  static constexpr bool by_gap = true;

  template <GapPath Path, class T = typename Path::Scalar>
  KOKKOS_INLINE_FUNCTION Reach<T> certify(Path const& path, Clearance const& clearance,
                                          T at_most) const {
    return kernels::certify_without_direction(path, clearance, at_most);
  }

  template <GapPath Path, class T = typename Path::Scalar>
  KOKKOS_INLINE_FUNCTION Reach<T> bound(Path const& path, Clearance const& clearance,
                                        T at_most) const {
    Reach<T> const known = certify(path, clearance, at_most);
    if (known.settled != Settled::open) return known;
    Vec3<T> const n = path.direction(T(0));
    T const gap = path.separation(n);
    T const usable = clearance.usable(gap), kept = gap - usable;
    if (!(usable > T(0))) return {T(0), T(0), Settled::uncertain};
    GapLines<T, Path::lines> const lines = path.along(n, false);
    GapLines<T, 1> closest{{lines.at[0]}, {lines.slope[0]}};
    for (int k = 1; k < Path::lines; ++k) {
      closest.at[0] = min(closest.at[0], lines.at[k]);
      closest.slope[0] = min(closest.slope[0], lines.slope[k]);
    }
    // A sum that is not a number where any of them is not: min passes over those.
    T sum = T(0);
    for (int k = 0; k < Path::lines; ++k) sum += lines.at[k] + lines.slope[k];
    if (!(abs(sum) < Kokkos::Experimental::infinity_v<T>)) return {T(0), T(0), Settled::uncertain};
    T const alpha = kernels::certified_until(closest, kept, T(0));
    return kernels::settle(alpha, kept, at_most, Settled::direction);
  }
};

/// Not a guarantee (see above). `kept` is 0.
struct HalfDhatClamp {
  static constexpr bool by_gap = false;
  double dhat = 0;  ///< distance at which contact begins to act, m

  template <GapPath Path, class T = typename Path::Scalar>
  KOKKOS_INLINE_FUNCTION Reach<T> certify(Path const& path, Clearance const& clearance,
                                          T at_most) const {
    return bound(path, clearance, at_most);
  }
  template <GapPath Path, class T = typename Path::Scalar>
  KOKKOS_INLINE_FUNCTION Reach<T> bound(Path const& path, Clearance const&, T at_most) const {
    if (path.at_rest()) return {at_most, T(0), Settled::at_rest};
    T const longest = path.longest();
    T const alpha = T(dhat) / T(2) / longest;
    return kernels::settle(alpha > T(0) ? alpha : T(0), T(0), at_most, Settled::direction);
  }
};

}  // namespace taut

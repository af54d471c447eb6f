// A vertex and a triangle, or two edges, along a step: the lower bounds of their gap that step
// bounds are made of (gap_path.hpp has the equations and the round-off that is charged).
#pragma once

#include <taut/contact/closest_features.hpp>
#include <taut/contact/gap_path.hpp>

#include <type_traits>

namespace taut {

namespace kernels {

/// The corners that the closest points of a pair lean on, as edges that are orthogonal to each
/// other: those from one corner of a body to its others.
template <class T, int first>
struct Support {
  Vec3<T> edge[2];
  int edges = 0;
  int base[2] = {-1, -1};  ///< per body, the first of its corners
  bool leans[4] = {false, false, false, false};

  /// Adds corner k of the positions z. False where that changes nothing.
  KOKKOS_INLINE_FUNCTION bool lean(Vec3<T> const (&z)[4], int k) {
    int const side = k < first ? 0 : 1;
    if (leans[k]) return false;
    leans[k] = true;
    if (base[side] < 0) {
      base[side] = k;
      return true;
    }
    if (edges == 2) return false;
    Vec3<T> const whole = z[k] - z[base[side]];
    Vec3<T> const e = orthogonal(whole);
    // What is left of an edge that is parallel to the first is noise.
    constexpr T noise = budget<T> * budget<T>;
    if (!(dot(e, e) > noise * dot(whole, whole))) return false;
    edge[edges++] = e;
    return true;
  }

  KOKKOS_INLINE_FUNCTION Vec3<T> orthogonal(Vec3<T> n) const {
    for (int e = 0; e < edges; ++e) n = n - (dot(n, edge[e]) / dot(edge[e], edge[e])) * edge[e];
    return n;
  }
};

/// Above this, and below its inverse, squares of lengths may overflow or vanish.
template <class T>
inline constexpr T vast = std::is_same_v<T, float> ? T(1e15) : T(1e150);

}  // namespace kernels

/// The four vertices of a pair: a point and the corners of a triangle, or the ends of an edge and
/// of another. T is the scalar of the computation, whatever the positions are stored in.
template <class T, PairKind kind>
class PairPath {
public:
  using Scalar = T;
  /// The corners below this are the first body's.
  static constexpr int first = kind == PairKind::point_triangle ? 1 : 2;
  static constexpr int lines = first * (4 - first);

  /// `x` as stored, in metres; `p` the displacement of a step of length 1, in metres.
  template <class Position, class Real>
  KOKKOS_INLINE_FUNCTION PairPath(Vec3<Position> const (&x)[4], Vec3<Real> const (&p)[4]);

  KOKKOS_INLINE_FUNCTION bool at_rest() const;

  /// From the boxes of the two: their distance, and the largest relative displacement of a corner
  /// of one and a corner of the other. That of any two points is a mean of those.
  KOKKOS_INLINE_FUNCTION QuickGap<T> quick() const;

  /// That of the closest points, made to be as good as a normal: the difference of two points at
  /// distance d has an error of u R for corners R apart, which turns it by u R / d and would cost
  /// u R^2 / d of the gap at the far corners. So it is made orthogonal to the edges that the
  /// closest points lie on, and where a corner beside those still sticks out, to the edge that
  /// leads there.
  KOKKOS_INLINE_FUNCTION Vec3<T> direction(T a) const;

  KOKKOS_INLINE_FUNCTION T separation(Vec3<T> const& n) const;
  KOKKOS_INLINE_FUNCTION GapLines<T, lines> along(Vec3<T> const& n, bool short_step) const;

  /// The corners' shadows on n, for bounds that treat each vertex by itself.
  struct Shadow {
    T at[4], at_error[4];      ///< of the positions, and what is charged for each
    T rate[4], rate_error[4];  ///< of the displacements; the charge includes storing
    T landing;                 ///< what storing any of the corners costs, independent of a
  };
  /// `relative`: displacements relative to that of corner 0, without the charge for storing.
  KOKKOS_INLINE_FUNCTION Shadow shadow(Vec3<T> const& n, bool relative) const;

  /// Upper bound of the length of the displacement of corner k, with the charge for storing it.
  KOKKOS_INLINE_FUNCTION T travel(int k) const;
  KOKKOS_INLINE_FUNCTION T longest() const {
    T result = T(0), sum = T(0);
    for (int k = 0; k < 4; ++k) {
      result = max(result, travel(k));
      sum += travel(k);
    }
    return sum < Kokkos::Experimental::infinity_v<T> ? result : sum;  // max passes over NaN
  }
  /// What storing all corners after the step may cost of the distance, independent of a.
  KOKKOS_INLINE_FUNCTION T landing() const {
    return (landing_[0] + landing_[1] + landing_[2]) * (T(1) + budget_) + tiny_;
  }

private:
  static constexpr T budget_ = kernels::budget<T>;
  static constexpr T tiny_ = 16 * Kokkos::Experimental::norm_min_v<T>;
  KOKKOS_INLINE_FUNCTION T moved() const { return moved_[0] + moved_[1] + moved_[2]; }
  KOKKOS_INLINE_FUNCTION static T weighted(Vec3<T> const& n, Vec3<T> const& lengths) {
    return abs(n[0]) * lengths[0] + abs(n[1]) * lengths[1] + abs(n[2]) * lengths[2];
  }
  KOKKOS_INLINE_FUNCTION static Vec3<T> magnitude(Vec3<T> const& a) {
    return {abs(a[0]), abs(a[1]), abs(a[2])};
  }

  Vec3<T> y_[4];  // x relative to corner 0
  Vec3<T> d_[4];  // p relative to corner 0
  Vec3<T> p_[4];
  Vec3<T> landing_;   // v |x_c|, the largest of each body, of both together
  Vec3<T> moved_;     // |p_c|, likewise
  T storage_budget_;  // 4 v
};

template <class T, PairKind kind>
template <class Position, class Real>
KOKKOS_INLINE_FUNCTION PairPath<T, kind>::PairPath(Vec3<Position> const (&x)[4],
                                                   Vec3<Real> const (&p)[4]) {
  using Wide = std::common_type_t<T, Position, Real>;
  constexpr T unit = T(Kokkos::Experimental::epsilon_v<Position> / 2);
  storage_budget_ = 4 * unit;
  for (int k = 0; k < 4; ++k) {
    for (int c = 0; c < 3; ++c) {
      y_[k][c] = T(Wide(x[k][c]) - Wide(x[0][c]));
      d_[k][c] = T(Wide(p[k][c]) - Wide(p[0][c]));
      p_[k][c] = T(p[k][c]);
    }
  }
  for (int c = 0; c < 3; ++c) {
    T far[2] = {T(0), T(0)}, moved[2] = {T(0), T(0)};
    for (int k = 0; k < 4; ++k) {
      int const side = k < first ? 0 : 1;
      if (p[k][c] == Real(0)) continue;  // stays exactly where it is
      far[side] = max(far[side], abs(T(x[k][c])));
      moved[side] = max(moved[side], abs(p_[k][c]));
    }
    landing_[c] = (far[0] + far[1]) * unit * (T(1) + budget_);
    moved_[c] = (moved[0] + moved[1]) * (T(1) + budget_);
  }
}

template <class T, PairKind kind>
KOKKOS_INLINE_FUNCTION bool PairPath<T, kind>::at_rest() const {
  bool rest = true;
  for (int k = 0; k < 4; ++k)
    for (int c = 0; c < 3; ++c) rest = rest && p_[k][c] == T(0);
  return rest;
}

template <class T, PairKind kind>
KOKKOS_INLINE_FUNCTION QuickGap<T> PairPath<T, kind>::quick() const {
  T square_of_gap = T(0);
  for (int c = 0; c < 3; ++c) {
    T low[2], high[2], size = T(0);
    for (int side = 0; side < 2; ++side) {
      int const from = side * first, to = side == 0 ? first : 4;
      low[side] = high[side] = y_[from][c];
      for (int k = from + 1; k < to; ++k) {
        low[side] = min(low[side], y_[k][c]);
        high[side] = max(high[side], y_[k][c]);
      }
      size = max(size, max(abs(low[side]), abs(high[side])));
    }
    T const gap = max(low[0] - high[1], low[1] - high[0]) - budget_ * size;
    if (gap > T(0)) square_of_gap += gap * gap;
  }
  T fastest = T(0), positions = T(0), displacements = T(0);
  for (int i = 0; i < first; ++i) {
    for (int j = first; j < 4; ++j) {
      Vec3<T> const v = d_[i] - d_[j];
      fastest = max(fastest, dot(v, v));
    }
  }
  for (int k = 1; k < 4; ++k) {
    positions += abs(y_[k][0]) + abs(y_[k][1]) + abs(y_[k][2]);
    displacements += abs(d_[k][0]) + abs(d_[k][1]) + abs(d_[k][2]);
  }
  // min and max pass over what is not a number; a sum does not.
  bool const sound = positions < kernels::vast<T> && displacements < kernels::vast<T>;
  return {sound ? sqrt(square_of_gap) * (T(1) - budget_) : T(0),
          sqrt(fastest) * (T(1) + budget_) + budget_ * displacements + storage_budget_ * moved() +
              T(1) / kernels::vast<T>,
          landing()};
}

template <class T, PairKind kind>
KOKKOS_INLINE_FUNCTION Vec3<T> PairPath<T, kind>::direction(T a) const {
  Vec3<T> z[4];
  for (int k = 0; k < 4; ++k) z[k] = y_[k] + a * d_[k];
  ClosestPoints<T> closest;
  if constexpr (kind == PairKind::point_triangle) {
    closest = closest_point_triangle(z);
  } else {
    closest = closest_edge_edge(z);
  }

  kernels::Support<T, first> support;
  for (int k = 0; k < 4; ++k) {
    if (closest.c[k] != T(0)) support.lean(z, k);
  }
  Vec3<T> best{T(0), T(0), T(0)};
  T best_gap = T(0);
  for (int attempt = 0; attempt < 3; ++attempt) {
    Vec3<T> n = support.orthogonal(closest.t);
    T const scale = max(abs(n[0]), max(abs(n[1]), abs(n[2])));
    if (!(scale > T(0))) break;
    for (int c = 0; c < 3; ++c) n[c] /= scale;
    n = (T(1) / norm(n)) * n;
    T shade[4];
    for (int k = 0; k < 4; ++k) shade[k] = dot(n, z[k]);
    int lowest = 0, highest = first;
    for (int k = 1; k < first; ++k) lowest = shade[k] < shade[lowest] ? k : lowest;
    for (int k = first + 1; k < 4; ++k) highest = shade[k] > shade[highest] ? k : highest;
    T const gap = shade[lowest] - shade[highest];
    if (gap > best_gap) {
      best_gap = gap;
      best = n;
    }
    if (support.base[0] < 0 || support.base[1] < 0) break;
    T const below = shade[support.base[0]] - shade[lowest];
    T const above = shade[highest] - shade[support.base[1]];
    if (!(max(below, above) > T(0)) || gap >= (T(1) - 4 * budget_) * closest.distance) break;
    if (!support.lean(z, below > above ? lowest : highest)) break;
  }
  return best;
}

template <class T, PairKind kind>
KOKKOS_INLINE_FUNCTION typename PairPath<T, kind>::Shadow PairPath<T, kind>::shadow(
    Vec3<T> const& n, bool relative) const {
  Shadow s;
  T const storing = relative ? T(0) : storage_budget_ * weighted(n, moved_);
  for (int k = 0; k < 4; ++k) {
    Vec3<T> const& rate = relative ? d_[k] : p_[k];
    s.at[k] = dot(n, y_[k]);
    s.at_error[k] = budget_ * weighted(n, magnitude(y_[k]));
    s.rate[k] = dot(n, rate);
    s.rate_error[k] = budget_ * weighted(n, magnitude(rate)) + storing;
  }
  s.landing = weighted(n, landing_) * (T(1) + budget_) + tiny_;
  return s;
}

template <class T, PairKind kind>
KOKKOS_INLINE_FUNCTION T PairPath<T, kind>::separation(Vec3<T> const& n) const {
  T least = Kokkos::Experimental::infinity_v<T>;
  for (int i = 0; i < first; ++i) {
    for (int j = first; j < 4; ++j) {
      T const charge = budget_ * (weighted(n, magnitude(y_[i])) + weighted(n, magnitude(y_[j])));
      T const gap = dot(n, y_[i]) - dot(n, y_[j]) - charge;
      least = gap > least ? least : gap;  // not a number stays
    }
  }
  return least * (T(1) - budget_);
}

template <class T, PairKind kind>
KOKKOS_INLINE_FUNCTION GapLines<T, PairPath<T, kind>::lines> PairPath<T, kind>::along(
    Vec3<T> const& n, bool short_step) const {
  Shadow const s = shadow(n, true);
  T const moved = weighted(n, moved_) * (T(1) + budget_);
  T const at_once = short_step ? tiny_ : s.landing;
  T const drift = short_step ? moved * (T(1) + storage_budget_) : moved * storage_budget_;
  GapLines<T, lines> r;
  for (int i = 0; i < first; ++i) {
    for (int j = first; j < 4; ++j) {
      int const k = i * (4 - first) + j - first;
      r.at[k] = s.at[i] - s.at[j] - (s.at_error[i] + s.at_error[j]) - at_once;
      r.slope[k] = s.rate[i] - s.rate[j] - (s.rate_error[i] + s.rate_error[j]) - drift;
    }
  }
  return r;
}

template <class T, PairKind kind>
KOKKOS_INLINE_FUNCTION T PairPath<T, kind>::travel(int k) const {
  return norm(p_[k]) * (T(1) + budget_) + storage_budget_ * moved() + T(1) / kernels::vast<T>;
}

}  // namespace taut

// Bounds that treat each vertex by itself: a step in which vertex i moves by any share of p_i up to
// its own alpha keeps the clearance of the pair. Where bodies move independently, a vertex that is
// cut then holds up no other.
//
//   PlanarScaling       half of what may be used of the gap belongs to each side: a vertex may move
//                       until it is that much beyond the plane through the foremost of its side,
//                       orthogonal to the direction of the closest points. Half-spaces are convex,
//                       so what holds for the vertices holds for all points between them (Chen et
//                       al. 2025, "Offset geometric contact", the planar form of their bound).
//   IsotropicPerVertex  no vertex moves by more than half of what may be used.
//
// Displacements count in full here, not relative to the partner's, for the partner may be cut.
// Round-off: as in gap_path.hpp.
#pragma once

#include <taut/contact/pair_path.hpp>
#include <taut/contact/step_bound.hpp>

namespace taut {

template <class T>
struct VertexReach {
  T alpha[4];  ///< of each vertex
  T kept;      ///< distance that is kept, m; 0 at rest
  Settled settled;
};

template <class B, class P>
concept VertexBound = requires(B const& b, P const& path, Clearance const& clearance,
                               typename P::Scalar at_most) {
  { b.bound(path, clearance, at_most) } -> std::same_as<VertexReach<typename P::Scalar>>;
};

namespace kernels {

/// Of what may be used of a gap, rounded down.
template <class T>
inline constexpr T half = T(0.5) - budget<T>;

template <class T>
KOKKOS_INLINE_FUNCTION VertexReach<T> same_for_all(Reach<T> const& reach) {
  return {{reach.alpha, reach.alpha, reach.alpha, reach.alpha}, reach.kept, reach.settled};
}

/// The largest of [0, at_most] for which alpha speed <= room; 0 where anything is not a number.
template <class T>
KOKKOS_INLINE_FUNCTION T share_of(T room, T speed, T at_most) {
  if (!(room >= T(0))) return T(0);
  if (speed <= T(0)) return at_most;
  T const alpha = room / speed * (T(1) - budget<T>);
  return alpha >= at_most ? at_most : alpha > T(0) ? alpha : T(0);
}

/// What the alphas amount to.
template <class T>
KOKKOS_INLINE_FUNCTION void settle(VertexReach<T>& reach, T at_most) {
  bool whole = true, some = true;
  for (int k = 0; k < 4; ++k) {
    whole = whole && reach.alpha[k] >= at_most;
    some = some && reach.alpha[k] > T(0);
  }
  reach.settled = whole ? Settled::direction : some ? Settled::cut : Settled::uncertain;
}

}  // namespace kernels

struct PlanarScaling {
  template <class T, PairKind kind>
  KOKKOS_INLINE_FUNCTION VertexReach<T> bound(PairPath<T, kind> const& path,
                                              Clearance const& clearance, T at_most) const {
    if (path.at_rest()) {
      return kernels::same_for_all(Reach<T>{at_most, T(0), Settled::at_rest});
    }
    Vec3<T> const n = path.direction(T(0));
    T const gap = path.separation(n), usable = clearance.usable(gap);
    VertexReach<T> r{{T(0), T(0), T(0), T(0)}, gap - usable, Settled::uncertain};
    if (!(usable > T(0))) return r;
    auto const shadow = path.shadow(n, false);
    T const mine = kernels::half<T> * usable - kernels::budget<T> * gap - shadow.landing;
    T front[2] = {Kokkos::Experimental::infinity_v<T>, Kokkos::Experimental::infinity_v<T>};
    for (int k = 0; k < 4; ++k) {
      int const side = k < path.first ? 0 : 1;
      front[side] = min(front[side], height(shadow, side, k));
    }
    for (int k = 0; k < 4; ++k) {
      int const side = k < path.first ? 0 : 1;
      T const room = height(shadow, side, k) - front[side] + mine;
      T const closing = (side == 0 ? -shadow.rate[k] : shadow.rate[k]) + shadow.rate_error[k];
      r.alpha[k] = kernels::share_of(room, closing, at_most);
    }
    kernels::settle(r, at_most);
    return r;
  }

private:
  /// Above the plane of its side, away from the other body, at least.
  template <class Shadow>
  KOKKOS_INLINE_FUNCTION static auto height(Shadow const& shadow, int side, int k) {
    return (side == 0 ? shadow.at[k] : -shadow.at[k]) - shadow.at_error[k];
  }
};

struct IsotropicPerVertex {
  template <class T, PairKind kind>
  KOKKOS_INLINE_FUNCTION VertexReach<T> bound(PairPath<T, kind> const& path,
                                              Clearance const& clearance, T at_most) const {
    if (path.at_rest()) {
      return kernels::same_for_all(Reach<T>{at_most, T(0), Settled::at_rest});
    }
    T const gap = path.separation(path.direction(T(0))), usable = clearance.usable(gap);
    VertexReach<T> r{{T(0), T(0), T(0), T(0)}, gap - usable, Settled::uncertain};
    if (!(usable > T(0))) return r;
    T const mine = kernels::half<T> * usable - path.landing();
    for (int k = 0; k < 4; ++k) {
      r.alpha[k] = kernels::share_of(mine, path.travel(k), at_most);
    }
    kernels::settle(r, at_most);
    return r;
  }
};

}  // namespace taut

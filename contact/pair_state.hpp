// One pair in contact at one configuration: closest points, barrier and mollifier of
//
//   E = K m(q) b(d),   d = |t|,   t = Sum_a c_a y_a      (Shen et al. 2024, equation 8)
//
// which is all that value, gradient and curvature are made of.
#pragma once

#include <taut/contact/barrier.hpp>
#include <taut/contact/closest_features.hpp>
#include <taut/contact/mollifier.hpp>

namespace taut {

template <class T>
struct PairParameters {
  T stiffness;        ///< K, N/m
  T activation;       ///< D, m: the pair has no energy from this distance on
  T mollifier_scale;  ///< Mollifier::scale of edges, 1/m^2; unused by NoMollifier and triangles
};

template <class T>
struct PairState {
  Vec3<T> y[4];         ///< vertices relative to y[1], m
  ClosestPoints<T> at;  ///< of these
  Vec3<T> n;            ///< t / d; zero at d = 0
  T activation;         ///< D, m
  T b, b1, b2;          ///< K b, K b' and K b'': J, N, N/m
  Mollification<T> m;
};

namespace kernels {
template <Barrier B, Mollifier M, class T>
KOKKOS_INLINE_FUNCTION PairState<T> evaluate_local(PairKind kind,
                                                   PairParameters<T> const& parameters,
                                                   Vec3<T> const (&y)[4]) {
  PairState<T> s;
  for (int a = 0; a < 4; ++a) s.y[a] = y[a];
  s.at = closest_points(kind, y);
  s.n = select(s.at.distance > T(0), T(T(1) / s.at.distance), T(0)) * s.at.t;
  s.activation = parameters.activation;
  auto const b = evaluate_barrier<B>(s.at.distance, s.activation);
  s.b = parameters.stiffness * b.value;
  s.b1 = parameters.stiffness * b.slope;
  s.b2 = parameters.stiffness * b.curvature;
  // Packs are for pairs that no mollifier acts on.
  if constexpr (!is_pack<T>) {
    if (kind == PairKind::edge_edge) s.m = M::evaluate(y, parameters.mollifier_scale);
  }
  return s;
}
}  // namespace kernels

/// Evaluates a pair at vertices y, m. Positions may be wider than T: only their differences are
/// rounded to it.
template <Barrier B, Mollifier M, class T, class Position>
KOKKOS_INLINE_FUNCTION PairState<T> evaluate_pair(PairKind kind,
                                                  PairParameters<T> const& parameters,
                                                  Vec3<Position> const (&y)[4]) {
  Vec3<T> local[4];
  for (int a = 0; a < 4; ++a)
    for (int k = 0; k < 3; ++k) local[a][k] = static_cast<T>(y[a][k] - y[1][k]);
  return kernels::evaluate_local<B, M>(kind, parameters, local);
}

/// d(after) - d(before) for the move `step` of the vertices, without cancellation. The change of
/// t = Sum c y is Sum c_before step + Sum (c_after - c_before) y_after. The last sum runs within
/// the features, so it is normal to t but for terms of second order; taken from the closest points,
/// the round-off of the coefficients is so too.
template <class T>
KOKKOS_INLINE_FUNCTION T distance_change(PairState<T> const& before, PairState<T> const& after,
                                         Vec3<T> const (&step)[4]) {
  int const second = after.at.feature < Feature::edge_edge ? 1 : 2;  // where the second side starts
  Vec3<T> first_point{}, second_point{};
  for (int a = 0; a < second; ++a) first_point = first_point + after.at.c[a] * after.y[a];
  for (int a = second; a < 4; ++a) second_point = second_point - after.at.c[a] * after.y[a];
  Vec3<T> dt{};
  for (int a = 0; a < 4; ++a) {
    Vec3<T> const within = after.y[a] - (a < second ? first_point : second_point);
    dt = dt + before.at.c[a] * (step[a] - step[1]) + (after.at.c[a] - before.at.c[a]) * within;
  }
  T const sum = after.at.distance + before.at.distance;
  return select(sum > T(0), T(dot(dt, after.at.t + before.at.t) / sum), T(0));
}

}  // namespace taut

// The closest points of the two kinds of pairs that surface meshes have in contact: a vertex and a
// triangle, two edges. Both are one problem for four vertices y and four coefficients c, whose sum
// is zero (Shen et al. 2024, equation 8):
//
//   t = Sum_a c_a y_a,   distance = |t|,   c = (1, -w0, -w1, -w2)         point, triangle
//                                          c = (1 - s, s, -(1 - u), -u)   edges a0 a1 and b0 b1
//
// The interior of the triangle, or of both edges, is the least-squares problem
// min |b - x1 e1 - x2 e2|. Modified Gram-Schmidt on e1, e2 and b together is backward stable
// whatever the angle between e1 and e2 (Bjorck 1967): what it returns is the exact answer for
// vertices moved by round-off, so needles and nearly parallel edges cost no accuracy of the
// distance. If its answer lies inside, it is the closest pair; if not, some end or edge is, and the
// nearest of all projections on edges is taken.
//
// Error of the distance: at most 4 epsilon (|b| + |e1| + |e2|), for any pair, degenerate or not,
// whose size is within 1e-10 and 1e15 (fp32) or 1e-100 and 1e150 (fp64). Only differences of
// vertices are used, so coordinates far from the origin cost no more than their own rounding.
#pragma once

#include <taut/core/math/matrix.hpp>

#include <cstdint>

namespace taut {

enum class PairKind : std::uint8_t { point_triangle, edge_edge };

/// Where the closest points lie: the Voronoi region of a pair.
enum class Feature : std::uint8_t {
  face,  ///< of the triangle: its interior, the interior of an edge, a vertex
  edge_01,
  edge_12,
  edge_20,
  vertex_0,
  vertex_1,
  vertex_2,
  edge_edge,  ///< of two edges: inside both
  a0_b,       ///< an end of one, inside the other
  a1_b,
  a_b0,
  a_b1,
  a0_b0,  ///< an end of each
  a0_b1,
  a1_b0,
  a1_b1
};

template <class T>
struct ClosestPoints {
  Vec3<T> t;        ///< Sum_a c_a y_a, from the second closest point to the first, m
  T distance;       ///< |t|
  T c[4];           ///< each in [-1, 1], zero for vertices that the feature does not touch
  Feature feature;  ///< fits c: c is zero where the feature says so, and nowhere else
};

namespace kernels {

/// What comparing two T gives: bool, or a mask of lanes.
template <class T>
using MaskOf = decltype(T() < T());

/// min over x of |b - x1 e1 - x2 e2|, by modified Gram-Schmidt.
template <class T>
struct LeastSquares {
  MaskOf<T> regular;  ///< e1 and e2 are not parallel to round-off; only then is there an answer
  T x1, x2;
};

template <class T>
KOKKOS_INLINE_FUNCTION LeastSquares<T> least_squares(Vec3<T> const& b, Vec3<T> const& e1,
                                                     Vec3<T> const& e2) {
  // Below this sine e1 and e2 are parallel after a change of either by round-off, and the closest
  // points may be taken at an end.
  constexpr auto parallel = 4 * Kokkos::Experimental::epsilon_v<ValueType<T>>;
  T const e11 = dot(e1, e1);
  T const r = dot(e1, e2) / e11;
  Vec3<T> const q = e2 - r * e1;
  T const qq = dot(q, q);
  T const s = dot(e1, b) / e11;
  T const x2 = dot(q, b - s * e1) / qq;
  // A comparison with what is not a number fails.
  return {e11 > T(0) && qq > T(square(parallel)) * dot(e2, e2), s - r * x2, x2};
}

/// The nearest point s e, 0 <= s <= 1, of a segment to b.
template <class T>
struct Foot {
  T s;
  Vec3<T> t;  ///< b - s e
  T t2;       ///< |t|^2
  KOKKOS_FORCEINLINE_FUNCTION MaskOf<T> inside() const { return s > T(0) && s < T(1); }
};

template <class T>
KOKKOS_INLINE_FUNCTION Foot<T> foot_on_segment(Vec3<T> const& b, Vec3<T> const& e) {
  T const ee = dot(e, e), be = dot(b, e);
  T const s = select(be > T(0), select(be < ee, T(be / ee), T(1)), T(0));
  Vec3<T> const t = b - s * e;
  return {s, t, dot(t, t)};
}

/// Whether foot `a` is the nearer. Close to an end of an edge, the foot inside it and that end,
/// which is the foot on a neighbour, have distances that agree to second order: the inside is right
/// there, and gives the direction to full accuracy, but round-off could prefer the end.
template <class T>
KOKKOS_INLINE_FUNCTION MaskOf<T> nearer(Foot<T> const& a, Foot<T> const& b) {
  constexpr auto tie = 1 - 16 * Kokkos::Experimental::epsilon_v<ValueType<T>>;
  auto const a_inside = a.inside(), b_inside = b.inside();
  return select(a_inside && !b_inside, T(tie), T(1)) * a.t2 <
         select(b_inside && !a_inside, T(tie), T(1)) * b.t2;
}

template <class T>
KOKKOS_FORCEINLINE_FUNCTION Vec3<T> select_vector(MaskOf<T> const& mask, Vec3<T> const& a,
                                                  Vec3<T> const& b) {
  return {select(mask, a[0], b[0]), select(mask, a[1], b[1]), select(mask, a[2], b[2])};
}

/// Takes over t and c of `other` in the lanes of a mask.
template <class T>
KOKKOS_FORCEINLINE_FUNCTION void replace(MaskOf<T> const& mask, ClosestPoints<T> const& other,
                                         ClosestPoints<T>& r) {
  r.t = select_vector(mask, other.t, r.t);
  for (int a = 0; a < 4; ++a) r.c[a] = select(mask, other.c[a], r.c[a]);
}

/// The closest points of a pair per lane, without branches. They tell no features but the interior.
template <class T>
KOKKOS_INLINE_FUNCTION ClosestPoints<T> closest_points_of_lanes(PairKind kind,
                                                                Vec3<T> const (&y)[4]) {
  bool const edges = kind == PairKind::edge_edge;
  // Of the feet, in the order in which the scalars take them: the vertex that is projected, and the
  // edge.
  constexpr int foot_of[2][4] = {{0, 0, 0, 0}, {0, 1, 2, 3}};
  constexpr int edge_of[2][4][2] = {{{1, 2}, {2, 3}, {3, 1}, {3, 1}},
                                    {{2, 3}, {2, 3}, {0, 1}, {0, 1}}};
  ClosestPoints<T> r{};
  Foot<T> nearest{};
  for (int k = 0; k < (edges ? 4 : 3); ++k) {
    int const v = foot_of[edges][k], from = edge_of[edges][k][0], to = edge_of[edges][k][1];
    T const sign = v < (edges ? 2 : 1) ? T(1) : T(-1);
    auto const foot = foot_on_segment(y[v] - y[from], y[to] - y[from]);
    ClosestPoints<T> at{};
    at.t = sign * foot.t;
    at.c[v] = sign;
    at.c[from] = sign * (foot.s - T(1));
    at.c[to] = -(sign * foot.s);
    if (k == 0) {
      r = at;
      nearest = foot;
    } else {
      auto const better = nearer(foot, nearest);
      replace(better, at, r);
      nearest.s = select(better, foot.s, nearest.s);
      nearest.t2 = select(better, foot.t2, nearest.t2);
    }
  }
  r.distance = sqrt(nearest.t2);

  ClosestPoints<T> inner{};
  MaskOf<T> inside;
  if (edges) {
    Vec3<T> const b = y[0] - y[2], e1 = y[0] - y[1], e2 = y[3] - y[2];
    auto const [regular, s, u] = least_squares(b, e1, e2);
    inside = regular && s > T(0) && s < T(1) && u > T(0) && u < T(1);
    inner.t = b - s * e1 - u * e2;
    inner.c[0] = T(1) - s, inner.c[1] = s, inner.c[2] = u - T(1), inner.c[3] = -u;
  } else {
    Vec3<T> const b = y[0] - y[1], e1 = y[2] - y[1], e2 = y[3] - y[1];
    auto const [regular, w1, w2] = least_squares(b, e1, e2);
    inside = regular && w1 > T(0) && w2 > T(0) && w1 + w2 < T(1);
    inner.t = b - w1 * e1 - w2 * e2;
    inner.c[0] = T(1), inner.c[1] = w1 + w2 - T(1), inner.c[2] = -w1, inner.c[3] = -w2;
  }
  replace(inside, inner, r);
  r.distance = select(inside, norm(inner.t), r.distance);
  r.feature = edges ? Feature::edge_edge : Feature::face;
  return r;
}

}  // namespace kernels

/// y = the point and the corners of the triangle, finite, m.
template <class T>
KOKKOS_INLINE_FUNCTION ClosestPoints<T> closest_point_triangle(Vec3<T> const (&y)[4]) {
  Vec3<T> const b = y[0] - y[1], e1 = y[2] - y[1], e2 = y[3] - y[1];
  auto const [regular, w1, w2] = kernels::least_squares(b, e1, e2);
  if (regular && w1 > T(0) && w2 > T(0) && w1 + w2 < T(1)) {
    Vec3<T> const t = b - w1 * e1 - w2 * e2;
    return {t, norm(t), {T(1), w1 + w2 - T(1), -w1, -w2}, Feature::face};
  }
  int edge = 0;
  auto nearest = kernels::foot_on_segment(b, e1);
  for (int k = 1; k < 3; ++k) {
    auto const foot = kernels::foot_on_segment(y[0] - y[1 + k], y[1 + (k + 1) % 3] - y[1 + k]);
    if (kernels::nearer(foot, nearest)) {
      nearest = foot;
      edge = k;
    }
  }
  int const from = edge, to = (edge + 1) % 3;
  ClosestPoints<T> r{nearest.t, sqrt(nearest.t2), {T(1), T(0), T(0), T(0)}, Feature::edge_01};
  for (int v = 0; v < 3; ++v) {
    r.c[1 + v] = v == from ? nearest.s - T(1) : (v == to ? -nearest.s : T(0));
  }
  Feature const first = nearest.inside() ? Feature::edge_01 : Feature::vertex_0;
  int const which = nearest.inside() || nearest.s == T(0) ? from : to;
  r.feature = static_cast<Feature>(static_cast<int>(first) + which);
  return r;
}

/// y = the ends of edge a and of edge b, finite, m.
template <class T>
KOKKOS_INLINE_FUNCTION ClosestPoints<T> closest_edge_edge(Vec3<T> const (&y)[4]) {
  Vec3<T> const b = y[0] - y[2], e1 = y[0] - y[1], e2 = y[3] - y[2];
  auto const [regular, s, u] = kernels::least_squares(b, e1, e2);
  if (regular && s > T(0) && s < T(1) && u > T(0) && u < T(1)) {
    Vec3<T> const t = b - s * e1 - u * e2;
    return {t, norm(t), {T(1) - s, s, u - T(1), -u}, Feature::edge_edge};
  }
  int end = 0;  // of a0, a1, b0, b1 the one that is projected on the other edge
  auto nearest = kernels::foot_on_segment(b, e2);
  for (int k = 1; k < 4; ++k) {
    int const from = k < 2 ? 2 : 0;
    auto const foot = kernels::foot_on_segment(y[k] - y[from], y[from + 1] - y[from]);
    if (kernels::nearer(foot, nearest)) {
      nearest = foot;
      end = k;
    }
  }
  bool const of_a = end < 2;
  int const from = of_a ? 2 : 0;
  T const sign = of_a ? T(1) : T(-1);
  ClosestPoints<T> r{sign * nearest.t, sqrt(nearest.t2), {}, Feature::edge_edge};
  for (int v = 0; v < 4; ++v) {
    T const other = v == from ? nearest.s - T(1) : (v == from + 1 ? -nearest.s : T(0));
    r.c[v] = sign * (v == end ? T(1) : other);
  }
  if (nearest.inside()) {
    r.feature = static_cast<Feature>(static_cast<int>(Feature::a0_b) + end);
  } else {
    int const other = nearest.s > T(0) ? 1 : 0;
    int const end_of_a = of_a ? end : other, end_of_b = of_a ? other : end - 2;
    r.feature = static_cast<Feature>(static_cast<int>(Feature::a0_b0) + 2 * end_of_a + end_of_b);
  }
  return r;
}

/// Of either kind. In packs, `feature` says no more than the kind.
template <class T>
KOKKOS_INLINE_FUNCTION ClosestPoints<T> closest_points(PairKind kind, Vec3<T> const (&y)[4]) {
  if constexpr (is_pack<T>) {
    return kernels::closest_points_of_lanes(kind, y);
  } else {
    return kind == PairKind::edge_edge ? closest_edge_edge(y) : closest_point_triangle(y);
  }
}

/// Between the boxes around the two primitives, squared: no more than their distance, for little.
template <class T>
KOKKOS_INLINE_FUNCTION T square_box_gap(PairKind kind, Vec3<T> const (&y)[4]) {
  bool const edges = kind == PairKind::edge_edge;
  T sum = T(0);
  for (int c = 0; c < 3; ++c) {
    // Vertex 1 belongs to the first edge, or to the triangle.
    T const low = min(y[2][c], y[3][c]), high = max(y[2][c], y[3][c]);
    T const first_low = edges ? min(y[0][c], y[1][c]) : y[0][c];
    T const first_high = edges ? max(y[0][c], y[1][c]) : y[0][c];
    T const second_low = edges ? low : min(low, y[1][c]);
    T const second_high = edges ? high : max(high, y[1][c]);
    T const gap = max(max(T(second_low - first_high), T(first_low - second_high)), T(0));
    sum += gap * gap;
  }
  return sum;
}

}  // namespace taut

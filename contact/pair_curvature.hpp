// Curvature of a pair's energy E = m(q) b(d), as policies. With delta = Sum_a c_a p_a and n = t / d
// the second derivative along a motion p of the vertices is
//
//   m [ b'' (n.delta)^2 + b'/d (|delta|^2 - (n.delta)^2) ]     with c held
//   - m b'/d Sum_k (k.delta + d n.(dc_k p))^2                  as c follows: Schur complement
//   + 2 m' b' dq (n.delta) + b (m'' dq^2 + m' d2q)             of the mollifier
//
// where k runs over orthonormal directions in which the closest points may slide, and dc_k p =
// Sum_a (dc_a/dk) p_a. The first line is all that Shen et al. 2024 keep (equation 10); as b' < 0 it
// is below the truth, and negative more often. The Gauss-Newton form takes (w, d) as functions of p
// to first order; it is never negative.
#pragma once

#include <taut/contact/pair_state.hpp>
#include <taut/core/math/psd_projection.hpp>

namespace taut {

/// How a pair's second derivative is modelled: the form p'Hp and the 3x3 blocks H_ab.
template <class C>
concept ContactCurvature = requires(PairState<double> const& s, Vec3<double> const (&p)[4]) {
  { C::name } -> std::convertible_to<char const*>;
  { C::positive } -> std::convertible_to<bool>;  // semi-definite as it is; else it gets clamped
  { C::form(s, p) } -> std::same_as<double>;
  { C::block(s, 0, 0) } -> std::same_as<Mat3<double>>;
};

namespace kernels {

/// [a]x with [a]x b = a x b.
template <class T>
KOKKOS_FORCEINLINE_FUNCTION Mat3<T> cross_matrix(Vec3<T> const& a) {
  return {{T(0), a[2], -a[1], -a[2], T(0), a[0], a[1], -a[0], T(0)}};
}

/// [a]x' [b]x
template <class T>
KOKKOS_FORCEINLINE_FUNCTION Mat3<T> cross_product_form(Vec3<T> const& a, Vec3<T> const& b) {
  return dot(a, b) * identity3<T>() - outer(b, a);
}

/// Sum_a c_a p_a, in differences.
template <class T>
KOKKOS_FORCEINLINE_FUNCTION Vec3<T> combine(T const (&c)[4], Vec3<T> const (&p)[4]) {
  return c[0] * (p[0] - p[1]) + c[2] * (p[2] - p[1]) + c[3] * (p[3] - p[1]);
}

/// The edges along which the closest points of a feature may slide, by their ends.
struct SlidingEdges {
  int count;
  int from[2], to[2];
};

KOKKOS_INLINE_FUNCTION SlidingEdges sliding_edges(Feature feature) {
  switch (feature) {
    case Feature::face:
      return {2, {1, 1}, {2, 3}};
    case Feature::edge_edge:
      return {2, {0, 2}, {1, 3}};
    case Feature::edge_01:
      return {1, {1, 0}, {2, 0}};
    case Feature::edge_12:
      return {1, {2, 0}, {3, 0}};
    case Feature::edge_20:
      return {1, {3, 0}, {1, 0}};
    case Feature::a0_b:
    case Feature::a1_b:
      return {1, {2, 0}, {3, 0}};
    case Feature::a_b0:
    case Feature::a_b1:
      return {1, {0, 0}, {1, 0}};
    default:
      return {0, {0, 0}, {0, 0}};
  }
}

/// Orthonormal directions of sliding, and the coefficients that slide along them: Sum_a rate[k][a]
/// y_a = direction[k].
template <class T>
struct Sliding {
  int count;
  Vec3<T> direction[2];
  T rate[2][4];
};

template <class T>
KOKKOS_INLINE_FUNCTION Sliding<T> sliding(PairState<T> const& s) {
  SlidingEdges const edges = sliding_edges(s.at.feature);
  Sliding<T> r{edges.count, {}, {}};
  for (int k = 0; k < edges.count; ++k) {
    Vec3<T> along = s.y[edges.to[k]] - s.y[edges.from[k]];
    r.rate[k][edges.to[k]] = T(1);
    r.rate[k][edges.from[k]] = T(-1);
    if (k == 1) {
      T const common = dot(r.direction[0], along);
      along = along - common * r.direction[0];
      for (int a = 0; a < 4; ++a) r.rate[1][a] -= common * r.rate[0][a];
    }
    // An edge that a closest point lies inside has a length, and two such are not parallel.
    T const inverse = T(1) / norm(along);
    r.direction[k] = inverse * along;
    for (int a = 0; a < 4; ++a) r.rate[k][a] *= inverse;
  }
  return r;
}

/// The full second derivative of E, with closest points that slide or that are held.
template <bool slides>
struct SecondDerivative {
  static constexpr bool positive = false;

  template <class T>
  KOKKOS_INLINE_FUNCTION static T form(PairState<T> const& s, Vec3<T> const (&p)[4]) {
    T const tension = s.b1 / s.at.distance;
    Vec3<T> const delta = combine(s.at.c, p);
    T const normal = dot(s.n, delta);
    T r = s.b2 * square(normal) + tension * (dot(delta, delta) - square(normal));
    if constexpr (slides) {
      auto const slide = sliding(s);
      for (int k = 0; k < slide.count; ++k) {
        T const turned = dot(s.at.t, combine(slide.rate[k], p));
        r -= tension * square(dot(slide.direction[k], delta) + turned);
      }
    }
    r *= s.m.value;
    if (!s.m.active) return r;
    Vec3<T> const dw = s.m.change_of_w(p);
    T const dq = T(2) * dot(s.m.w, dw);
    T const bend = s.m.scale * dot(s.m.w, cross(p[1] - p[0], p[3] - p[2]));
    return r + T(2) * s.m.first * s.b1 * dq * normal +
           s.b * (s.m.second * square(dq) + s.m.first * (T(2) * dot(dw, dw) + T(4) * bend));
  }

  template <class T>
  KOKKOS_INLINE_FUNCTION static Mat3<T> block(PairState<T> const& s, int a, int b) {
    T const tension = s.b1 / s.at.distance, ca = s.at.c[a], cb = s.at.c[b];
    Mat3<T> r = (ca * cb) * ((s.b2 - tension) * outer(s.n, s.n) + tension * identity3<T>());
    if constexpr (slides) {
      auto const slide = sliding(s);
      for (int k = 0; k < slide.count; ++k) {
        Vec3<T> const at_a = ca * slide.direction[k] + slide.rate[k][a] * s.at.t;
        Vec3<T> const at_b = cb * slide.direction[k] + slide.rate[k][b] * s.at.t;
        r = r - tension * outer(at_a, at_b);
      }
    }
    r = s.m.value * r;
    if (!s.m.active) return r;
    Vec3<T> const qa = s.m.gradient(a), qb = s.m.gradient(b);
    r = r + (s.m.first * s.b1) * (cb * outer(qa, s.n) + ca * outer(s.n, qb)) +
        (s.b * s.m.second) * outer(qa, qb) +
        (T(2) * s.b * s.m.first) * cross_product_form(s.m.arm(a), s.m.arm(b));
    if ((a < 2) == (b < 2)) return r;
    // w is bilinear in the two edges.
    T const sign = (a < 2) == ((a + b) % 2 == 0) ? T(-1) : T(1);
    return r + (T(2) * s.b * s.m.first * s.m.scale * sign) * cross_matrix(s.m.w);
  }
};

}  // namespace kernels

/// The paper's: the coefficients are held, and what comes out negative is clamped, per component of
/// the diagonal and per pair of p'Hp.
struct TruncatedCurvature : kernels::SecondDerivative<false> {
  static constexpr char const* name = "truncated";
};

/// The second derivative of E, clamped or projected to be semi-definite.
struct ExactCurvature : kernels::SecondDerivative<true> {
  static constexpr char const* name = "exact";
};

/// b'' n n' where there is no mollifier. Where there is, E = F(|w|, d) with w and d to first order
/// in p: the 2x2 second derivative of F, projected to be semi-definite, and the curvature of |w|
/// across w, which is positive. |w| and d / D are free of units, so that the projection does not
/// depend on the size of the scene.
struct GaussNewtonCurvature {
  static constexpr char const* name = "gauss_newton";
  static constexpr bool positive = true;
  static constexpr bool in_packs = true;  ///< for pairs that no mollifier acts on

  template <class T>
  KOKKOS_INLINE_FUNCTION static T form(PairState<T> const& s, Vec3<T> const (&p)[4]) {
    T const normal = dot(s.n, kernels::combine(s.at.c, p));
    if (!s.m.active) return s.b2 * square(normal);
    auto const f = reduced(s);
    Vec3<T> const dw = s.m.change_of_w(p);
    T const along = dot(f.w, dw), closing = normal / s.activation;
    T const across = max(dot(dw, dw) - square(along), T(0));
    return f.second(0, 0) * square(along) + T(2) * f.second(0, 1) * along * closing +
           f.second(1, 1) * square(closing) + f.across * across;
  }

  /// H over g g', g = dE/dy; -1 where it is not of that kind. Not finite where the force is next to
  /// nothing.
  template <class T>
  KOKKOS_INLINE_FUNCTION static T over_gradient(PairState<T> const& s) {
    return s.m.active ? T(-1) : s.b2 / square(s.b1);
  }

  template <class T>
  KOKKOS_INLINE_FUNCTION static Mat3<T> block(PairState<T> const& s, int a, int b) {
    T const ca = s.at.c[a], cb = s.at.c[b];
    if constexpr (!is_pack<T>) {
      if (s.m.active) return mollified_block(s, a, b);
    }
    return (ca * cb * s.b2) * outer(s.n, s.n);
  }

private:
  template <class T>
  KOKKOS_INLINE_FUNCTION static Mat3<T> mollified_block(PairState<T> const& s, int a, int b) {
    T const ca = s.at.c[a], cb = s.at.c[b];
    auto const f = reduced(s);
    Vec3<T> const wa = cross(f.w, s.m.arm(a)), wb = cross(f.w, s.m.arm(b));
    Vec3<T> const na = (ca / s.activation) * s.n, nb = (cb / s.activation) * s.n;
    return (f.second(0, 0) - f.across) * outer(wa, wb) +
           f.second(0, 1) * (outer(wa, nb) + outer(na, wb)) + f.second(1, 1) * outer(na, nb) +
           f.across * kernels::cross_product_form(s.m.arm(a), s.m.arm(b));
  }

  /// F(|w|, d / D): its projected second derivative, and its curvature across w.
  template <class T>
  struct Reduced {
    Vec3<T> w;  ///< w / |w|; zero at w = 0, where all directions are alike
    SquareMatrix<T, 2> second;
    T across;
  };
  template <class T>
  KOKKOS_INLINE_FUNCTION static Reduced<T> reduced(PairState<T> const& s) {
    T const size = sqrt(s.m.q);
    T const across = T(2) * s.b * s.m.first;
    T const along = across + T(4) * s.b * s.m.q * s.m.second;
    T const mixed = T(2) * s.m.first * size * s.b1 * s.activation;
    T const closing = s.m.value * s.b2 * square(s.activation);
    return {(size > T(0) ? T(1) / size : T(0)) * s.m.w,
            project_psd(SquareMatrix<T, 2>{{along, mixed, mixed, closing}}), across};
  }
};

}  // namespace taut

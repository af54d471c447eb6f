// The energy of one pair in contact, composed of a barrier, a curvature and a mollifier. What a
// contact term or a solver asks of a pair is here:
//
//   using Touch = PairEnergy<>;                                               // the defaults
//   using Paper = PairEnergy<LogBarrier, TruncatedCurvature, NoMollifier>;    // Shen et al. 2024
//
//   auto const s = Touch::evaluate(kind, parameters, y);
//   value(s), gradient(s, a), diagonal(s, a), block(s, a), quadratic(s, p), hessian(s)
//
// As the closest points minimise the distance, the gradient sees them held: K m b' c_a n.
#pragma once

#include <taut/contact/pair_curvature.hpp>

namespace taut {

template <Barrier Barrier_ = Normalised<LogBarrier>,
          ContactCurvature Curvature_ = GaussNewtonCurvature, Mollifier Mollifier_ = EdgeMollifier>
struct PairEnergy {
  using Barrier = Barrier_;
  using Curvature = Curvature_;
  using Mollifier = Mollifier_;

  /// At vertices y, m, of the type T of the parameters or wider. The state of touching vertices,
  /// d = 0, has no finite energy nor force (CubicBarrier: no direction): a step must not get there.
  template <class T, class Position>
  KOKKOS_INLINE_FUNCTION static PairState<T> evaluate(PairKind kind,
                                                      PairParameters<T> const& parameters,
                                                      Vec3<Position> const (&y)[4]) {
    return evaluate_pair<Barrier, Mollifier>(kind, parameters, y);
  }

  /// J
  template <class T>
  KOKKOS_INLINE_FUNCTION static T value(PairState<T> const& s) {
    return s.m.value * s.b;
  }

  /// E(y) - E(y - step) for the pair evaluated at y, with an error relative to itself; J.
  template <class T>
  KOKKOS_INLINE_FUNCTION static T change(PairKind kind, PairParameters<T> const& parameters,
                                         PairState<T> const& after, Vec3<T> const (&step)[4]) {
    Vec3<T> y[4];
    for (int a = 0; a < 4; ++a) y[a] = after.y[a] - (step[a] - step[1]);
    auto const before = kernels::evaluate_local<Barrier, Mollifier>(kind, parameters, y);
    T const db = parameters.stiffness *
                 barrier_change<Barrier>(before.at.distance, after.at.distance,
                                         distance_change(before, after, step), after.activation);
    if constexpr (is_pack<T>) {
      return db;
    } else {
      return after.m.value * db + mollifier_change(before.m, after.m, step) * before.b;
    }
  }

  /// dE/dy_a, N.
  template <class T>
  KOKKOS_INLINE_FUNCTION static Vec3<T> gradient(PairState<T> const& s, int a) {
    Vec3<T> const g = (s.m.value * s.b1 * s.at.c[a]) * s.n;
    return s.m.active ? g + (s.b * s.m.first) * s.m.gradient(a) : g;
  }

  /// The diagonal of H at vertex a, not negative, N/m.
  template <class T>
  KOKKOS_INLINE_FUNCTION static Vec3<T> diagonal(PairState<T> const& s, int a) {
    Mat3<T> const h = Curvature::block(s, a, a);
    Vec3<T> r{h(0, 0), h(1, 1), h(2, 2)};
    for (int k = 0; k < 3; ++k) r[k] = max(r[k], T(0));
    return r;
  }

  /// The 3x3 block of H at vertex a, positive semi-definite, N/m.
  template <class T>
  KOKKOS_INLINE_FUNCTION static Sym3<T> block(PairState<T> const& s, int a) {
    Sym3<T> const h = symmetric_part(Curvature::block(s, a, a));
    if constexpr (Curvature::positive) {
      return h;
    } else {
      return project_psd(h);
    }
  }

  /// p'Hp, not negative, J for p in m.
  template <class T>
  KOKKOS_INLINE_FUNCTION static T quadratic(PairState<T> const& s, Vec3<T> const (&p)[4]) {
    return max(Curvature::form(s, p), T(0));
  }

  /// H, positive semi-definite: row and column 3 a + k for component k of vertex a, N/m.
  template <class T>
  KOKKOS_INLINE_FUNCTION static SquareMatrix<T, 12> hessian(PairState<T> const& s) {
    SquareMatrix<T, 12> h;
    for (int b = 0; b < 4; ++b)
      for (int a = 0; a <= b; ++a) {
        Mat3<T> const block = Curvature::block(s, a, b);
        for (int j = 0; j < 3; ++j)
          for (int i = 0; i < 3; ++i) {
            h(3 * a + i, 3 * b + j) = h(3 * b + j, 3 * a + i) = block(i, j);
          }
      }
    return Curvature::positive ? h : project_psd(h);
  }
};

}  // namespace taut

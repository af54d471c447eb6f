// A factor m on the energy of two edges that takes it to zero as they become parallel. There the
// closest points jump from end to end, and with them the force; a minimiser would cycle at the kink
// (Li et al. 2020, Incremental Potential Contact; e is a threshold times the squared rest lengths):
//
//   m = (2 - q / e) q / e   for q = |u x v|^2 < e,   else 1
//
// With w = u x v / sqrt e it is a function of q = |w|^2 alone. The scale 1 / sqrt e, in 1/m^2, is
// what a pair carries: e itself would leave the range of fp32.
#pragma once

#include <taut/core/math/matrix.hpp>

#include <concepts>

namespace taut {

/// m(q) with derivatives in q, and how q depends on the four vertices.
template <class T>
struct Mollification {
  bool active = false;  ///< q < 1; else m = 1, and nothing but `value` is used
  T value = T(1), first = T(0), second = T(0);
  T q = T(1);
  Vec3<T> w{}, u{}, v{};  ///< scale u x v, scale u, scale v
  T scale = T(0);

  /// dw/dy_a = [arm]x: w changes by Sum_a arm(a) x p_a.
  KOKKOS_FORCEINLINE_FUNCTION Vec3<T> arm(int a) const {
    Vec3<T> const edge = a < 2 ? v : u;
    return a == 0 || a == 3 ? edge : -edge;
  }
  KOKKOS_FORCEINLINE_FUNCTION Vec3<T> change_of_w(Vec3<T> const (&p)[4]) const {
    return cross(p[1] - p[0], v) + cross(u, p[3] - p[2]);
  }
  /// dq/dy_a
  KOKKOS_FORCEINLINE_FUNCTION Vec3<T> gradient(int a) const { return T(2) * cross(w, arm(a)); }
};

/// What multiplies the energy of a pair of edges: m, made from the scale that the rest shape gives.
template <class M>
concept Mollifier = requires(Vec3<double> const (&y)[4], double scale) {
  { M::name } -> std::convertible_to<char const*>;
  { M::scale(y, scale) } -> std::same_as<double>;  // of rest positions and threshold
  { M::evaluate(y, scale) } -> std::same_as<Mollification<double>>;
};

struct EdgeMollifier {
  static constexpr char const* name = "edge";
  static constexpr double default_threshold = 1e-2;  ///< squared sine, for edges of rest length

  /// 1 / sqrt e from the rest positions of edges a0 a1 and b0 b1, none of length zero; 1/m^2.
  template <class T>
  KOKKOS_INLINE_FUNCTION static T scale(Vec3<T> const (&rest)[4],
                                        T threshold = T(default_threshold)) {
    return T(1) / (sqrt(threshold) * norm(rest[1] - rest[0]) * norm(rest[3] - rest[2]));
  }
  /// Whether m is less than 1, in each lane.
  template <class T>
  KOKKOS_INLINE_FUNCTION static auto acts(Vec3<T> const (&y)[4], T scale) {
    Vec3<T> const w = scale * cross(y[1] - y[0], y[3] - y[2]);
    return dot(w, w) < T(1);
  }
  template <class T>
  KOKKOS_INLINE_FUNCTION static Mollification<T> evaluate(Vec3<T> const (&y)[4], T scale) {
    Vec3<T> const u = y[1] - y[0], v = y[3] - y[2], w = scale * cross(u, v);
    T const q = dot(w, w);
    if (!(q < T(1))) return {};
    return {true, q * (T(2) - q), T(2) * (T(1) - q), T(-2), q, w, scale * u, scale * v, scale};
  }
};

/// The paper's: none.
struct NoMollifier {
  static constexpr char const* name = "none";
  template <class T>
  KOKKOS_FORCEINLINE_FUNCTION static T scale(Vec3<T> const (&)[4], T = T(0)) {
    return T(0);
  }
  template <class T>
  KOKKOS_FORCEINLINE_FUNCTION static auto acts(Vec3<T> const (&)[4], T) {
    return T(0) > T(0);
  }
  template <class T>
  KOKKOS_FORCEINLINE_FUNCTION static Mollification<T> evaluate(Vec3<T> const (&)[4], T) {
    return {};
  }
};

/// m(after) - m(before) for the move `step` of the vertices, with an error relative to itself.
template <class T>
KOKKOS_INLINE_FUNCTION T mollifier_change(Mollification<T> const& before,
                                          Mollification<T> const& after, Vec3<T> const (&step)[4]) {
  T const room_before = T(1) - before.q, room_after = T(1) - after.q;  // 0 where not active
  if (!(before.active && after.active)) return square(room_before) - square(room_after);
  Vec3<T> const dw = cross(step[1] - step[0], after.v) + cross(before.u, step[3] - step[2]);
  return dot(dw, before.w + after.w) * (room_before + room_after);
}

}  // namespace taut

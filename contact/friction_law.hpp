// Smoothed Coulomb friction of one contact (Li et al. 2020, "Incremental Potential Contact",
// section 5): with what a contact may exert at most, L = mu lambda (N), and what it slips within a
// step, u (m), normal to n,
//
//   D(u) = L e f(y),   y = |u| / e,   e = eps_v h,
//
//   f(y) = y^2 - y^3 / 3,   f'(y) = 2 y - y^2   for y < 1,
//          y - 1 / 3,              1            beyond.
//
// The force -L f'(y) u / |u| is that of Coulomb where the contact slips faster than eps_v; what
// sticks creeps: a load of t L is held at y = 1 - sqrt(1 - t). f is convex and grows with y, so the
// Hessian
//
//   L / e (f'/y (P - r r' / y^2) + f'' r r' / y^2),   r = u / e,   P = 1 - n n',
//
// is positive semi-definite as it is. All is computed from r, so that no length, however small,
// leaves the range of fp32.
#pragma once

#include <taut/core/math/matrix.hpp>

namespace taut {

/// A contact that slips by r = u / e.
template <class T>
struct SlipState {
  Vec3<T> r;
  T y;            ///< |r|
  T slope_ratio;  ///< f'(y) / y
  T curvature;    ///< f''(y)

  KOKKOS_FUNCTION bool slides() const { return !(y < T(1)); }
  /// r / y; nil where it makes no difference to the curvature, for there |r|^2 may underflow.
  KOKKOS_FUNCTION Vec3<T> direction() const {
    return (y > Kokkos::Experimental::epsilon_v<T> ? T(1) / y : T(0)) * r;
  }
};

template <class T>
KOKKOS_INLINE_FUNCTION SlipState<T> evaluate_slip(Vec3<T> const& r) {
  T const y = norm(r);
  bool const sticks = y < T(1);
  return {r, y, sticks ? T(2) - y : T(1) / y, sticks ? T(2) * (T(1) - y) : T(0)};
}

/// f(y)
template <class T>
KOKKOS_INLINE_FUNCTION T friction_energy(T y) {
  return y < T(1) ? square(y) * (T(1) - y / T(3)) : y - T(1) / T(3);
}

/// f after the step minus f before it, with an error relative to itself; the step is r after minus
/// r before.
template <class T>
KOKKOS_INLINE_FUNCTION T friction_energy_change(Vec3<T> const& before, Vec3<T> const& after,
                                                Vec3<T> const& step) {
  T const y0 = norm(before), y1 = norm(after), sum = y0 + y1;
  if (!(sum > T(0))) return T(0);
  T const dy = dot(step, before + after) / sum;
  if (y0 < T(1) && y1 < T(1)) {
    return dy * (sum - (square(y0) + y0 * y1 + square(y1)) / T(3));
  }
  // f is y - 1/3 + (1 - y)^3 / 3 below 1; one of the two at most is there.
  T const room0 = max(T(1) - y0, T(0)), room1 = max(T(1) - y1, T(0));
  return dy + (room1 * square(room1) - room0 * square(room0)) / T(3);
}

/// p' H p of e / L times the Hessian, for p normal to n.
template <class T>
KOKKOS_INLINE_FUNCTION T friction_form(SlipState<T> const& s, Vec3<T> const& p) {
  Vec3<T> const w = s.direction();
  T const along = dot(w, p);
  Vec3<T> const across = p - along * w;
  return s.slope_ratio * dot(across, across) + s.curvature * square(along);
}

/// e / L times the Hessian, for contacts of unit normal n.
template <class T>
KOKKOS_INLINE_FUNCTION Sym3<T> friction_hessian(SlipState<T> const& s, Vec3<T> const& n) {
  Vec3<T> const w = s.direction();
  T const h = s.slope_ratio, along = s.curvature - h;
  return {{h * (T(1) - square(n[0])) + along * square(w[0]),
           h * (T(1) - square(n[1])) + along * square(w[1]),
           h * (T(1) - square(n[2])) + along * square(w[2]), along * w[0] * w[1] - h * n[0] * n[1],
           along * w[1] * w[2] - h * n[1] * n[2], along * w[0] * w[2] - h * n[0] * n[2]}};
}

}  // namespace taut

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
// sticks creeps: a load of t L is held at y = 1 - sqrt(1 - t).
//
// The curvature is not that of D but of the paraboloid which touches D at u and lies above it
// everywhere, for f is a concave function of y^2:
//
//   L / e f'/y P,   P = 1 - n n'.
//
// Across the slip it is the Hessian of D; along it that one, L / e f'', is nil as soon as a contact
// slides, and a step that stops or turns a slip is then far too long. With the paraboloid no step
// is: a house of cards that starts in contact takes nonlinear CG 15 to 30 % fewer iterations, and
// Newton 7 instead of 26; a block that slides 5 instead of 8, and 1.4 instead of 5. Newton's
// last digits come linearly: 34 iterations instead of 11 to a tolerance of 1e-7.
// All is computed from r = u / e, so that no length, however small, leaves the range of fp32.
#pragma once

#include <taut/core/math/matrix.hpp>

namespace taut {

/// A contact that slips by r = u / e.
template <class T>
struct SlipState {
  Vec3<T> r;
  T y;            ///< |r|
  T slope_ratio;  ///< f'(y) / y, e / L times the curvature

  KOKKOS_FUNCTION bool slides() const { return !(y < T(1)); }
};

template <class T>
KOKKOS_INLINE_FUNCTION SlipState<T> evaluate_slip(Vec3<T> const& r) {
  T const y = norm(r);
  return {r, y, y < T(1) ? T(2) - y : T(1) / y};
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

/// e / L times the curvature, for contacts of unit normal n.
template <class T>
KOKKOS_INLINE_FUNCTION Sym3<T> friction_curvature(SlipState<T> const& s, Vec3<T> const& n) {
  T const h = s.slope_ratio;
  return {{h * (T(1) - square(n[0])), h * (T(1) - square(n[1])), h * (T(1) - square(n[2])),
           -h * n[0] * n[1], -h * n[1] * n[2], -h * n[0] * n[2]}};
}

}  // namespace taut

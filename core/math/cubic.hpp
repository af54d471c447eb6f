// Where a cubic first reaches zero: the exact step bound of a tetrahedron's volume along a line.
#pragma once

#include <Kokkos_Core.hpp>

#include <cfloat>

namespace taut {

/// Smallest t > 0 with a + b t + c t^2 + d t^3 <= 0, for a > 0; infinity if there is none. Never
/// larger than the root by more than the rounding of the polynomial's evaluation: the lower end of
/// the final bracket is returned. For a <= 0 the answer is 0. NaN coefficients give 0. A root
/// beyond `at_most` may be answered by infinity; others do not depend on it.
KOKKOS_INLINE_FUNCTION double smallest_positive_root(
    double a, double b, double c, double d,
    double at_most = Kokkos::Experimental::infinity_v<double>) {
  constexpr double infinity = Kokkos::Experimental::infinity_v<double>;
  double const b1 = Kokkos::abs(b), c1 = Kokkos::abs(c), d1 = Kokkos::abs(d);
  if (!(a > 0) || !(b1 + c1 + d1 < infinity)) return 0;
  // By one in a hundred, which no round-off comes near.
  if (at_most * (b1 + at_most * (c1 + at_most * d1)) < 0.99 * a) return infinity;
  auto const f = [&](double t) { return a + t * (b + t * (c + t * d)); };
  // Between its stationary points a cubic is monotone: look for the first piece that ends below
  // zero.
  double stationary[2] = {infinity, infinity};
  double const discriminant = c * c - 3 * b * d;
  if (discriminant > 0) {
    // Roots of b + 2 c t + 3 d t^2 without cancellation.
    double const q = -(c + (c < 0 ? -1 : 1) * Kokkos::sqrt(discriminant));
    double const r0 = d != 0 ? q / (3 * d) : infinity, r1 = q != 0 ? b / q : infinity;
    stationary[0] = Kokkos::min(r0, r1);
    stationary[1] = Kokkos::max(r0, r1);
  }
  // No term takes more than its share, 1/2 + 1/4 + 1/8, of a before `low`. What is left is searched
  // by magnitude first: coefficients that are round-off put stationary points anywhere up to 1e300.
  double const reach = Kokkos::max(b1 / a, Kokkos::max(Kokkos::sqrt(c1 / a), Kokkos::cbrt(d1 / a)));
  double low = reach > 0 ? 0.5 / reach : infinity, high = infinity;
  if (!(low < infinity)) return infinity;
  for (double s : stationary) {
    if (!(s > low) || !(s < infinity)) continue;
    if (f(s) <= 0) {
      high = s;
      break;
    }
    low = s;
  }
  if (high == infinity) {
    // The last piece: it ends below zero only if the leading coefficient is negative.
    double const leading = d != 0 ? d : (c != 0 ? c : b);
    if (!(leading < 0)) return infinity;
    high = low > 0 ? 2 * low : 1;
    while (f(high) > 0) {
      low = high;
      high *= 2;
      if (!(high < DBL_MAX / 2)) return infinity;
    }
  }
  while (low > 0 && high > 4 * low) {
    double const middle = Kokkos::sqrt(low) * Kokkos::sqrt(high);
    (f(middle) > 0 ? low : high) = middle;
  }
  // Newton steps inside a shrinking bracket [f > 0, f <= 0]; bisection where Newton leaves it.
  for (int k = 0; k < 100 && high - low > 4 * DBL_EPSILON * high; ++k) {
    double const middle = 0.5 * (low + high);
    double const value = f(middle), slope = b + middle * (2 * c + middle * 3 * d);
    double const newton = slope != 0 ? middle - value / slope : middle;
    (value > 0 ? low : high) = middle;
    // A little short of and a little past the Newton point, so that both ends close in.
    double const margin = 1e-3 * (high - low);
    if (newton - margin > low && newton + margin < high) {
      if (f(newton - margin) > 0) low = newton - margin;
      if (f(newton + margin) <= 0) high = newton + margin;
    }
  }
  return low;
}

}  // namespace taut

// What a segment and a triangle have in common, in rational numbers and from the definition: the
// parameters t of the points p + t (q - p) that satisfy linear equations and inequalities. Shares
// nothing with the library, which asks for signs of determinants only.
#pragma once

#include <taut/contact/edge_triangle.hpp>

#include <boost/multiprecision/cpp_int.hpp>

#include <array>
#include <cmath>

namespace taut::test {

using Rational = boost::multiprecision::cpp_rational;
using ExactPoint = std::array<Rational, 3>;

inline Rational exactly(double x) {
  using boost::multiprecision::cpp_int;
  int exponent;
  cpp_int const mantissa = static_cast<long long>(std::ldexp(std::frexp(x, &exponent), 53));
  exponent -= 53;
  return exponent >= 0 ? Rational(mantissa << exponent)
                       : Rational(mantissa, cpp_int(1) << -exponent);
}
inline ExactPoint exactly(Point const& x) { return {exactly(x[0]), exactly(x[1]), exactly(x[2])}; }

inline ExactPoint operator-(ExactPoint const& a, ExactPoint const& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
inline Rational dot(ExactPoint const& a, ExactPoint const& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
inline ExactPoint cross(ExactPoint const& a, ExactPoint const& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

/// The t in [0, 1] that satisfy what was required.
struct Solutions {
  Rational low = 0, high = 1;
  bool none = false;

  void require_not_negative(Rational const& at_0, Rational const& slope) {
    if (slope == 0) {
      none = none || at_0 < 0;
    } else {
      Rational const t = -at_0 / slope;
      if (slope > 0 && t > low) low = t;
      if (slope < 0 && t < high) high = t;
    }
    none = none || high < low;
  }
  void require_zero(Rational const& at_0, Rational const& slope) {
    require_not_negative(at_0, slope);
    require_not_negative(-at_0, -slope);
  }
};

inline std::optional<IntersectionKind> oracle_intersect(Point const& p_, Point const& q_,
                                                        Point const& a_, Point const& b_,
                                                        Point const& c_) {
  ExactPoint const p = exactly(p_), q = exactly(q_), a = exactly(a_), b = exactly(b_),
                   c = exactly(c_);
  ExactPoint const d = q - p, u = b - a, v = c - a, n = cross(u, v);
  Solutions t;
  Rational const area = dot(n, n);
  // Barycentric coordinates times area, at t = 0 and their slopes.
  std::array<Rational, 3> at_0, slope;
  if (area != 0) {
    t.require_zero(dot(n, p - a), dot(n, d));
    at_0 = {0, dot(cross(p - a, v), n), dot(cross(u, p - a), n)};
    slope = {0, dot(cross(d, v), n), dot(cross(u, d), n)};
    at_0[0] = area - at_0[1] - at_0[2];
    slope[0] = -slope[1] - slope[2];
    for (std::size_t k = 0; k < 3; ++k) t.require_not_negative(at_0[k], slope[k]);
  } else {
    // The longest side holds the triangle.
    std::array<std::array<ExactPoint, 2>, 3> const sides{{{a, b}, {b, c}, {c, a}}};
    auto side = sides[0];
    for (auto const& s : sides)
      if (dot(s[1] - s[0], s[1] - s[0]) > dot(side[1] - side[0], side[1] - side[0])) side = s;
    ExactPoint const e = side[1] - side[0], w = p - side[0];
    ExactPoint const beside = cross(e, w), drift = cross(e, d);
    for (std::size_t k = 0; k < 3; ++k) {
      t.require_zero(beside[k], drift[k]);
      if (dot(e, e) == 0) t.require_zero(w[k], d[k]);
    }
    t.require_not_negative(dot(e, w), dot(e, d));
    t.require_not_negative(dot(e, e) - dot(e, w), -dot(e, d));
  }
  if (t.none) return std::nullopt;
  if (dot(d, d) != 0 && t.low < t.high) return IntersectionKind::overlap;
  bool inner = area != 0 && dot(n, d) != 0 && t.low > 0 && t.low < 1;
  for (std::size_t k = 0; k < 3; ++k) inner = inner && at_0[k] + t.low * slope[k] > 0;
  return inner ? IntersectionKind::crossing : IntersectionKind::touching;
}

}  // namespace taut::test
